// A library to be preloaded: the kernel MENISCUS_FAULTY_KERNEL begins with the statement
// MENISCUS_FAULT, which is put into its text as the program gives it to the compiler. Or where that
// is "unwatched", the process ends at its launch where nobody has read a buffer since the last one.
#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>
#include <dlfcn.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <string>

namespace {

constexpr char kUnwatched[] = "unwatched";

std::string variable(const char* name) {
  const char* const value = std::getenv(name);
  return value ? value : "";
}

std::atomic<bool> has_read{true};  // since the last launch

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
  std::string text;
  for (cl_uint k = 0; k < count; ++k)
    text += lengths && lengths[k] ? std::string(strings[k], lengths[k]) : std::string(strings[k]);
  const std::string fault = variable("MENISCUS_FAULT");
  if (fault != kUnwatched) text = with_fault(text, variable("MENISCUS_FAULTY_KERNEL"), fault);
  const char* one = text.c_str();
  return real(context, 1, &one, nullptr, error);
}

extern "C" cl_int clEnqueueReadBuffer(cl_command_queue queue, cl_mem buffer, cl_bool blocking,
                                      size_t offset, size_t size, void* to, cl_uint count,
                                      const cl_event* wait, cl_event* event) {
  has_read = true;
  const auto real =
      reinterpret_cast<decltype(&clEnqueueReadBuffer)>(dlsym(RTLD_NEXT, "clEnqueueReadBuffer"));
  return real(queue, buffer, blocking, offset, size, to, count, wait, event);
}

extern "C" cl_int clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel,
                                         cl_uint dimensions, const size_t* offset,
                                         const size_t* global, const size_t* local, cl_uint count,
                                         const cl_event* wait, cl_event* event) {
  char name[256] = "";
  clGetKernelInfo(kernel, CL_KERNEL_FUNCTION_NAME, sizeof name, name, nullptr);
  const bool is_watched = has_read.exchange(false);
  if (variable("MENISCUS_FAULT") == kUnwatched && !is_watched &&
      variable("MENISCUS_FAULTY_KERNEL") == name)
    kill(getpid(), SIGKILL);
  const auto real = reinterpret_cast<decltype(&clEnqueueNDRangeKernel)>(
      dlsym(RTLD_NEXT, "clEnqueueNDRangeKernel"));
  return real(queue, kernel, dimensions, offset, global, local, count, wait, event);
}
