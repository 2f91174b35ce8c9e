// The text of the kernels, put into the program by the build.
#pragma once

#include <string_view>
#include <vector>

namespace meniscus {

struct KernelSource {
  std::string_view file;  // "project.cl"
  std::string_view text;
  std::string_view uses;  // "cells.cl field.cl": the files that go before it, see cmake/embed.cmake
};

/// Every embedded kernel file; "prelude.cl" is among them.
const std::vector<KernelSource>& kernel_sources();

}  // namespace meniscus
