// What the two halves of the bindings share.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstddef>
#include <vector>

#include "meniscus/extract.hpp"

namespace meniscus::python {

/// A surface and what it was made with, which files of it say.
struct Made {
  Surface surface;
  Parameters parameters;
  std::vector<StageTime> timings;  // empty unless asked for
};

/// An array of numpy's. Its type is in the stub of the module, for type checkers.
template <class Number>
using Array = nanobind::ndarray<nanobind::numpy, Number>;

/// A dictionary of the attributes by name, each as an array of this shape that shares its memory
/// and keeps `owner` alive.
using Arrays = nanobind::typed<nanobind::dict, nanobind::str, Array<float>>;
inline Arrays dict_of(nanobind::handle owner, std::vector<Attribute>& attributes,
                      const std::vector<std::size_t>& shape) {
  nanobind::dict all;
  for (Attribute& attribute : attributes)
    all[attribute.name.c_str()] =
        Array<float>(attribute.values.data(), shape.size(), shape.data(), owner).cast();
  return Arrays(all);
}

/// meniscus.Notice.
nanobind::object notice_of(const Notice& notice);

void bind_surface(nanobind::module_& module);

}  // namespace meniscus::python
