# Makes two C++ files of the kernels in FILES (run by EmbedKernels.cmake):
#
#   OUT     their text, which other files each one uses (those that its line "// uses: a.cl b.cl" names,
#           and what these use, each once and in front of who uses it), and the names of all arguments
#   HEADER  a handle for every kernel, with the types of its arguments (kernel_handle.hpp), and a type for
#           every noun of kernels/nouns.h
#
# A kernel whose list has more than MOST arguments is an error, and so is a macro that two files define
# that are built together: the later one would count for both.
cmake_minimum_required(VERSION 3.25)

set(MOST 8)

foreach(file IN LISTS FILES)
  get_filename_component(name ${file} NAME)
  file(STRINGS ${file} line REGEX "^// uses: " LIMIT_COUNT 1)
  string(REGEX REPLACE "^// uses: *" "" line "${line}")
  string(REPLACE " " ";" "uses_${name}" "${line}")
  file(STRINGS ${file} defines REGEX "^ *# *define ")
  list(TRANSFORM defines REPLACE "^ *# *define +([A-Za-z_0-9]+).*$" "\\1")
  list(REMOVE_DUPLICATES defines)
  set("defines_${name}" "${defines}")
endforeach()

# Appends what `name` uses to `all`, and what that uses before it.
macro(append_used name)
  foreach(used IN LISTS "uses_${name}")
    if(NOT DEFINED "uses_${used}")
      message(FATAL_ERROR "${name} uses ${used}, which is not among the kernels' files")
    endif()
    append_used(${used})
    if(NOT used IN_LIST all)
      list(APPEND all ${used})
    endif()
  endforeach()
endmacro()

# "global const float* depth" sets type to Global<cl_float> and word to depth, "const int2 grid" cl_int2
# and grid, "const Lattice samples" records::Lattice and samples.
function(read_argument argument place)
  string(REGEX REPLACE " (const|restrict|access) " " " argument " ${argument} ")
  string(STRIP "${argument}" argument)
  if(argument MATCHES "^(global|constant) (const )?([a-zA-Z0-9_]+) ?\\* ?(const )?([a-zA-Z0-9_#]+)$")
    set(value "${CMAKE_MATCH_3}")
    set(form "Global<@>")
    set(word "${CMAKE_MATCH_5}")
  elseif(argument MATCHES "^(const )?([a-zA-Z0-9_]+) ([a-zA-Z0-9_#]+)$")
    set(value "${CMAKE_MATCH_2}")
    set(form "@")
    set(word "${CMAKE_MATCH_3}")
  else()
    message(FATAL_ERROR "${place}: what is \"${argument}\"?")
  endif()
  if(value MATCHES "^(char|uchar|short|ushort|int|uint|long|ulong|float)[0-9]*$")
    set(value "cl_${value}")
  else()
    set(value "records::${value}")
    set_property(GLOBAL APPEND PROPERTY records "${value}")
  endif()
  string(REPLACE "@" "${value}" type "${form}")
  set(type "${type}" PARENT_SCOPE)
  set(word "${word}" PARENT_SCOPE)
endfunction()

# Of each noun its parameters, and the names that its members have in its own text: "of##depth".
set(nouns "")
foreach(file IN LISTS FILES)
  if(NOT file MATCHES "/nouns\\.h$")
    continue()
  endif()
  file(READ ${file} text)
  string(REGEX REPLACE "//[^\n]*" "" text "${text}")
  string(REGEX REPLACE "\\\\\n *" "" text "${text}")
  string(REGEX MATCHALL "#define [A-Z_]+\\([a-z_, ]*\\) *(global|const) [^\n]*" lines "${text}")
  foreach(line IN LISTS lines)
    string(REGEX MATCH "^#define ([A-Z_]+)\\(([^)]*)\\) *(.*)$" line "${line}")
    set(noun "${CMAKE_MATCH_1}")
    set(members "${CMAKE_MATCH_3}")
    string(REGEX REPLACE ", *" ";" "parameters_${noun}" "${CMAKE_MATCH_2}")
    string(REGEX REPLACE ", *" ";" members "${members}")
    set(types "")
    set(words "")
    foreach(member IN LISTS members)
      read_argument("${member}" "kernels/nouns.h: ${noun}")
      list(APPEND types "${type}")
      list(APPEND words "${word}")
    endforeach()
    set("words_${noun}" "${words}")
    list(TRANSFORM words REPLACE "^.*##" "" OUTPUT_VARIABLE own)
    list(TRANSFORM own PREPEND "value.")
    list(JOIN types ", " types)
    list(JOIN own ", " own)
    string(APPEND nouns "struct ${noun} {
  using Types = ArgumentTypes<${types}>;
  static auto parts(const auto& value) { return std::tie(${own}); }
};
")
  endforeach()
endforeach()

# The names behind a noun's arguments, separated by "|", as the kernel has them.
function(names_behind noun arguments)
  set(names "")
  string(REPLACE "|" ";" arguments "${arguments}")
  list(LENGTH "parameters_${noun}" wanted)
  list(LENGTH arguments given)
  foreach(word IN LISTS "words_${noun}")
    string(REGEX REPLACE "##.*" "" key "${word}")
    string(REGEX REPLACE "^${key}(##)?" "" rest "${word}")
    list(FIND "parameters_${noun}" "${key}" at)
    if(at GREATER -1)
      if(NOT at LESS given)
        set(key "")
      else()
        list(GET arguments ${at} key)
        string(STRIP "${key}" key)
      endif()
    endif()
    list(APPEND names "${key}${rest}")
  endforeach()
  set(names "${names}" PARENT_SCOPE)
endfunction()

set(entries "")
set(handles "")
set(names_of_kernels "")
set(number 0)
foreach(file IN LISTS FILES)
  file(READ ${file} text)
  get_filename_component(name ${file} NAME)
  set(all "")
  append_used(${name})
  set(defined "")
  foreach(part IN ITEMS ${all} ${name})
    foreach(macro IN LISTS "defines_${part}")
      if(macro IN_LIST defined)
        message(FATAL_ERROR "${macro} is defined by ${part} and by another file that is built "
          "with it, for ${name}; give one of them another name")
      endif()
    endforeach()
    list(APPEND defined ${defines_${part}})
  endforeach()
  list(JOIN all " " used)
  string(APPEND entries "    {\"${name}\", R\"cl_source(${text})cl_source\", \"${used}\"},\n")

  string(REGEX REPLACE "//[^\n]*" "" code "${text}")
  string(REGEX MATCHALL "kernel void [a-z_0-9]+\\(([^()]|\\([^()]*\\))*\\)" heads "${code}")
  foreach(head IN LISTS heads)
    string(REGEX REPLACE "[ \n]+" " " head "${head}")
    string(REGEX MATCH "^kernel void ([a-z_0-9]+)\\((.*)\\)$" head "${head}")
    set(kernel "${CMAKE_MATCH_1}")
    set(head "${CMAKE_MATCH_2}")
    # "SHOWN(const, closed_)" becomes "SHOWN(const| closed_)".
    while(head MATCHES "\\([^(),]*(\\|[^(),]*)*,[^()]*\\)")
      string(REGEX REPLACE "\\(([^(),]*),([^()]*)\\)" "(\\1|\\2)" head "${head}")
    endwhile()
    string(REPLACE "," ";" arguments "${head}")
    list(LENGTH arguments count)
    if(count GREATER MOST)
      message(FATAL_ERROR "${name}: ${kernel} has ${count} arguments, wanted ${MOST} at most "
                          "(put values into a record, buffers into a noun: docs/architecture.md)")
    endif()
    set(types "")
    set(all_names "")
    foreach(argument IN LISTS arguments)
      string(STRIP "${argument}" argument)
      if(argument MATCHES "^([A-Z_]+)\\(([^)]*)\\)$")
        set(noun "${CMAKE_MATCH_1}")
        set(given "${CMAKE_MATCH_2}")
        if(NOT DEFINED "words_${noun}")
          message(FATAL_ERROR "${name}: ${kernel} takes ${noun}, which kernels/nouns.h lacks")
        endif()
        names_behind(${noun} "${given}")
        list(APPEND types "nouns::${noun}")
        list(APPEND all_names ${names})
      else()
        read_argument("${argument}" "${name}: ${kernel}")
        list(APPEND types "${type}")
        list(APPEND all_names "${word}")
      endif()
    endforeach()
    list(JOIN types ", " types)
    list(JOIN all_names " " all_names)
    string(APPEND handles
      "inline constexpr KernelHandle<${types}> ${kernel}{\"${name}\", \"${kernel}\", ${number}};\n")
    string(APPEND names_of_kernels "    {\"${name}\", \"${kernel}\", \"${all_names}\"},\n")
    math(EXPR number "${number} + 1")
  endforeach()
endforeach()
get_property(records GLOBAL PROPERTY records)
list(REMOVE_DUPLICATES records)
list(TRANSFORM records REPLACE "(.+)" "static_assert(records::is_record<\\1>)")
list(JOIN records ";\n" checks)
file(WRITE ${OUT} "// Made by cmake/embed.cmake from kernels/*.
#include \"device/kernel_sources.hpp\"

namespace meniscus {

const std::vector<KernelSource>& kernel_sources() {
  static const std::vector<KernelSource> sources = {
${entries}  };
  return sources;
}

const std::vector<KernelArguments>& kernel_arguments() {
  static const std::vector<KernelArguments> arguments = {
${names_of_kernels}  };
  return arguments;
}

}  // namespace meniscus
")
# Left alone where it stays the same: the heads of kernels change less often than what is in them.
file(WRITE ${HEADER}.new "// Made by cmake/embed.cmake from kernels/*.
#pragma once

#include <tuple>

#include \"device/kernel_handle.hpp\"
#include \"device/records.hpp\"

/// The nouns of kernels/nouns.h: what is behind each, and how a value is taken apart into it.
namespace meniscus::nouns {

${nouns}
}  // namespace meniscus::nouns

namespace meniscus {
${checks};
}  // namespace meniscus

/// A handle for every kernel, by its name.
namespace meniscus::kernels {

${handles}
}  // namespace meniscus::kernels
")
file(COPY_FILE ${HEADER}.new ${HEADER} ONLY_IF_DIFFERENT)
file(REMOVE ${HEADER}.new)
