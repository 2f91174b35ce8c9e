// A library to be preloaded: the MENISCUS_END_CALL-th launch of a kernel in a process crashes it, or
// hangs where MENISCUS_END_BY is "hang", as drivers do.
#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>
#include <dlfcn.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <cstring>

extern "C" cl_int clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions,
                                         const size_t* offset, const size_t* global,
                                         const size_t* local, cl_uint count, const cl_event* wait,
                                         cl_event* event) {
  static std::atomic<long> calls{0};
  const char* const wanted = std::getenv("MENISCUS_END_CALL");
  if (wanted && ++calls == std::atol(wanted)) {
    const char* const by = std::getenv("MENISCUS_END_BY");
    if (by && std::strcmp(by, "hang") == 0)
      for (;;) pause();
    kill(getpid(), SIGKILL);  // drivers may handle other signals
  }
  const auto real =
      reinterpret_cast<decltype(&clEnqueueNDRangeKernel)>(dlsym(RTLD_NEXT, "clEnqueueNDRangeKernel"));
  return real(queue, kernel, dimensions, offset, global, local, count, wait, event);
}
