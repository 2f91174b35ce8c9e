// What the two halves of the bindings share.
#pragma once

#include <nanobind/nanobind.h>

#include "meniscus/meniscus.hpp"

namespace meniscus::python {

/// A surface and what it was made with, which files of it say.
struct Made {
  Surface surface;
  Parameters parameters;
  std::vector<StageTime> timings;  // empty unless asked for
};

void bind_surface(nanobind::module_& module);

}  // namespace meniscus::python
