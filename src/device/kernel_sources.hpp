// The text of the kernels, put into the program by the build.
#pragma once

#include <string_view>
#include <vector>

namespace meniscus {

struct KernelSource {
  std::string_view file;  // "project.cl"
  std::string_view text;
};

/// Every embedded kernel file; "prelude.cl" is among them.
const std::vector<KernelSource>& kernel_sources();

}  // namespace meniscus
