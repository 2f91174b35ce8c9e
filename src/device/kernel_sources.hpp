// The text of the kernels, put into the program by the build.
#pragma once

#include <string_view>
#include <vector>

namespace meniscus {

struct KernelSource {
  std::string_view file;  // "density.cl"
  std::string_view text;
  std::string_view uses;  // "cells.cl field.cl": the files that go before it, see cmake/embed.cmake
};

/// Every embedded kernel file; "records.h", "nouns.h" and "prelude.cl", which go before all, are
/// among them.
const std::vector<KernelSource>& kernel_sources();

struct KernelArguments {
  std::string_view file, kernel;
  std::string_view names;  // of its arguments, those behind nouns too: "depth normal samples"
};

/// Of every kernel.
const std::vector<KernelArguments>& kernel_arguments();

}  // namespace meniscus
