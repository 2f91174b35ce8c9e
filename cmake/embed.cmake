# Writes OUT, a C++ source with the text of every kernel in FILES (run by EmbedKernels.cmake).
set(entries "")
foreach(file IN LISTS FILES)
  file(READ ${file} text)
  get_filename_component(name ${file} NAME)
  string(APPEND entries "    {\"${name}\", R\"cl_source(${text})cl_source\"},\n")
endforeach()
file(WRITE ${OUT} "// Made by cmake/embed.cmake from kernels/*.cl.
#include \"device/kernel_sources.hpp\"

namespace meniscus {

const std::vector<KernelSource>& kernel_sources() {
  static const std::vector<KernelSource> sources = {
${entries}  };
  return sources;
}

}  // namespace meniscus
")
