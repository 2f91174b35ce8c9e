// mutant_kernels: a library to be preloaded that builds another text in the place of a kernel file,
// so that scripts/mutants.py needs no build of Meniscus for each mutant.
//
//   LD_PRELOAD=mutant_kernels.so MENISCUS_MUTANT=folder/settle.cl meniscus verify
//
// The file's name says which kernel file it stands for. Beside it, settle.cl.planted is made when a
// program with it is built.
#ifndef CL_TARGET_OPENCL_VERSION
#define CL_TARGET_OPENCL_VERSION 120
#endif
#include <CL/cl.h>
#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

namespace {

// Device::State::kernel() puts such a line before each file.
std::string head_of(const std::string& file) { return "\n#line 1 \"" + file + "\"\n"; }

std::string with_mutant(std::string source) {
  const char* const path = std::getenv("MENISCUS_MUTANT");
  if (!path) return source;
  const std::string whole = path, head = head_of(whole.substr(whole.rfind('/') + 1));
  const std::size_t at = source.find(head);
  if (at == std::string::npos) return source;
  std::ifstream file(whole, std::ios::binary);
  if (!file) std::abort();  // what is measured would not be the mutant
  const std::string text(std::istreambuf_iterator<char>(file), {});
  const std::size_t begin = at + head.size();
  const std::size_t end = std::min(source.find("\n#line 1 \"", begin), source.size());
  std::ofstream planted(whole + ".planted");
  return source.replace(begin, end - begin, text);
}

}  // namespace

extern "C" cl_program clCreateProgramWithSource(cl_context context, cl_uint count,
                                                const char** strings, const std::size_t* lengths,
                                                cl_int* error) {
  static auto* const real = reinterpret_cast<decltype(&::clCreateProgramWithSource)>(
      dlsym(RTLD_NEXT, "clCreateProgramWithSource"));
  std::string source;
  for (cl_uint k = 0; k < count; ++k)
    source += lengths && lengths[k] ? std::string(strings[k], lengths[k]) : std::string(strings[k]);
  source = with_mutant(std::move(source));
  const char* text = source.c_str();
  const std::size_t length = source.size();
  return real(context, 1, &text, &length, error);
}
