#include "frame/sub_buffers.hpp"

#ifndef CL_TARGET_OPENCL_VERSION
#define CL_TARGET_OPENCL_VERSION 120
#endif
#include <CL/cl.h>
#include <dlfcn.h>

#include <map>
#include <mutex>

namespace meniscus::test {
namespace {

struct Part {
  cl_mem whole;
  std::size_t from, to;  // bytes
};

struct Parts {
  std::mutex mutex;
  std::map<cl_mem, Part> alive;
  int overlapping = 0;
};

// Lives as long as the process: drivers call back late.
Parts& parts() {
  static Parts& all = *new Parts;
  return all;
}

template <class Function>
Function* next(Function*, const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

int overlapping_sub_buffers() {
  const std::lock_guard lock(parts().mutex);
  return parts().overlapping;
}

}  // namespace meniscus::test

using meniscus::test::next;
using meniscus::test::parts;

// The program's own calls come here before they go to the runtime.
extern "C" {

cl_mem clCreateSubBuffer(cl_mem whole, cl_mem_flags flags, cl_buffer_create_type type,
                         const void* info, cl_int* error) {
  static auto* const create = next(&clCreateSubBuffer, "clCreateSubBuffer");
  const cl_mem made = create(whole, flags, type, info, error);
  if (!made) return made;
  const auto& region = *static_cast<const cl_buffer_region*>(info);
  const meniscus::test::Part own{whole, region.origin, region.origin + region.size};
  const std::lock_guard lock(parts().mutex);
  for (const auto& [memory, part] : parts().alive)
    if (part.whole == whole && part.from < own.to && own.from < part.to) {
      ++parts().overlapping;
      break;
    }
  parts().alive[made] = own;
  return made;
}

cl_int clReleaseMemObject(cl_mem memory) {
  static auto* const release = next(&clReleaseMemObject, "clReleaseMemObject");
  cl_uint references = 0;
  clGetMemObjectInfo(memory, CL_MEM_REFERENCE_COUNT, sizeof references, &references, nullptr);
  if (references == 1) {
    const std::lock_guard lock(parts().mutex);
    parts().alive.erase(memory);
  }
  return release(memory);
}

}  // extern "C"
