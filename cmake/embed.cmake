# Makes two C++ files of the kernels in FILES (run by EmbedKernels.cmake):
#
#   OUT     their text, and which other files each one uses: those that its line "// uses: a.cl b.cl"
#           names, and what these use, each once and in front of who uses it
#   HEADER  a handle for every kernel, with the types of its arguments (kernel_handle.hpp)
cmake_minimum_required(VERSION 3.25)

foreach(file IN LISTS FILES)
  get_filename_component(name ${file} NAME)
  file(STRINGS ${file} line REGEX "^// uses: " LIMIT_COUNT 1)
  string(REGEX REPLACE "^// uses: *" "" line "${line}")
  string(REPLACE " " ";" "uses_${name}" "${line}")
endforeach()

# Appends what `name` uses to `all`, and what that uses before it.
macro(append_used name)
  foreach(used IN LISTS "uses_${name}")
    if(NOT DEFINED "uses_${used}")
      message(FATAL_ERROR "kernels/${name} uses ${used}, which is not among the kernels' files")
    endif()
    append_used(${used})
    if(NOT used IN_LIST all)
      list(APPEND all ${used})
    endif()
  endforeach()
endmacro()

set(entries "")
set(handles "")
set(number 0)
foreach(file IN LISTS FILES)
  file(READ ${file} text)
  get_filename_component(name ${file} NAME)
  set(all "")
  append_used(${name})
  list(JOIN all " " used)
  string(APPEND entries "    {\"${name}\", R\"cl_source(${text})cl_source\", \"${used}\"},\n")

  # "global const float* depth" becomes Global<cl_float>, "const int2 grid" cl_int2.
  string(REGEX REPLACE "//[^\n]*" "" code "${text}")
  string(REGEX MATCHALL "kernel void [a-z_0-9]+\\([^)]*\\)" heads "${code}")
  foreach(head IN LISTS heads)
    string(REGEX REPLACE "[ \n]+" " " head "${head}")
    string(REGEX REPLACE "^kernel void ([a-z_0-9]+)\\((.*)\\)$" "\\1;\\2" head "${head}")
    list(POP_FRONT head kernel)
    string(REPLACE "," ";" arguments "${head}")
    set(types "")
    foreach(argument IN LISTS arguments)
      string(REGEX REPLACE " (const|restrict) " " " argument " ${argument}")
      string(STRIP "${argument}" argument)
      if(argument MATCHES "^(global|constant) (const )?([a-zA-Z0-9_]+) ?\\* ?(const )?[a-zA-Z0-9_]+$")
        set(type "${CMAKE_MATCH_3}")
        set(form "Global<@>")
      elseif(argument MATCHES "^(const )?([a-zA-Z0-9_]+) [a-zA-Z0-9_]+$")
        set(type "${CMAKE_MATCH_2}")
        set(form "@")
      else()
        message(FATAL_ERROR "kernels/${name}: what is \"${argument}\" in the head of ${kernel}?")
      endif()
      if(type MATCHES "^(char|uchar|short|ushort|int|uint|long|ulong|float)[0-9]*$")
        set(type "cl_${type}")
      else()
        set(type "records::${type}")
      endif()
      string(REPLACE "@" "${type}" type "${form}")
      list(APPEND types "${type}")
    endforeach()
    list(JOIN types ", " types)
    string(APPEND handles
      "inline constexpr KernelHandle<${types}> ${kernel}{\"${name}\", \"${kernel}\", ${number}};\n")
    math(EXPR number "${number} + 1")
  endforeach()
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
# Left alone where it stays the same: the heads of kernels change less often than what is in them.
file(WRITE ${HEADER}.new "// Made by cmake/embed.cmake from kernels/*.cl.
#pragma once

#include \"device/kernel_handle.hpp\"

/// A handle for every kernel, by its name.
namespace meniscus::kernels {

${handles}
}  // namespace meniscus::kernels
")
file(COPY_FILE ${HEADER}.new ${HEADER} ONLY_IF_DIFFERENT)
file(REMOVE ${HEADER}.new)
