// A library to be preloaded: the kernel MENISCUS_FAULTY_KERNEL really hangs, or with
// MENISCUS_FAULT=crash writes where no memory is. What it does wrong is put into its text as the
// program gives it to the compiler.
#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>
#include <dlfcn.h>

#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

namespace {

// The text with a statement at the beginning of the kernel's body.
std::string with_fault(std::string text, const std::string& kernel, const std::string& fault) {
  const std::size_t at = text.find("kernel void " + kernel + "(");
  if (at == std::string::npos) return text;
  const std::size_t body = text.find(") {", at);
  return body == std::string::npos ? text : text.insert(body + 3, fault);
}

}  // namespace

extern "C" cl_program clCreateProgramWithSource(cl_context context, cl_uint count,
                                                const char** strings, const size_t* lengths,
                                                cl_int* error) {
  const auto real = reinterpret_cast<decltype(&clCreateProgramWithSource)>(
      dlsym(RTLD_NEXT, "clCreateProgramWithSource"));
  const char* const kernel = std::getenv("MENISCUS_FAULTY_KERNEL");
  if (!kernel) return real(context, count, strings, lengths, error);
  const char* const kind = std::getenv("MENISCUS_FAULT");
  const bool crashes = kind && std::strcmp(kind, "crash") == 0;
  const std::string fault = crashes ? " *(volatile global int*)(size_t)64 = 1;"
                                    : " for (volatile int again = 1; again;) {}";
  std::string text;
  for (cl_uint k = 0; k < count; ++k)
    text += lengths && lengths[k] ? std::string(strings[k], lengths[k]) : std::string(strings[k]);
  text = with_fault(text, kernel, fault);
  const char* one = text.c_str();
  return real(context, 1, &one, nullptr, error);
}
