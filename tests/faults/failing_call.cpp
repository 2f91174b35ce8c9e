#include "failing_call.hpp"

#ifndef CL_TARGET_OPENCL_VERSION
#define CL_TARGET_OPENCL_VERSION 120
#endif
#include <CL/cl.h>
#include <dlfcn.h>

#include <cstdio>
#include <cstdlib>
#include <map>
#include <mutex>

namespace meniscus::test {
namespace {

struct Setting {
  std::string name;  // empty: any call
  long turn = 0;     // of those calls; 0: none fails
  bool all_after = false;
};

Setting parse(const std::string& which) {
  Setting setting;
  const std::size_t colon = which.find(':');
  if (colon != std::string::npos) setting.name = which.substr(0, colon);
  setting.turn = std::atol(which.c_str() + (colon == std::string::npos ? 0 : colon + 1));
  setting.all_after = which.ends_with('+');
  return setting;
}

std::string environment(const char* name) {
  const char* const value = std::getenv(name);
  return value ? value : "";
}

struct Calls {
  std::mutex mutex;
  Setting setting = parse(environment("MENISCUS_FAIL_CALL"));
  std::vector<std::string> made;
  long of_name = 0;
  std::string failed;
  std::FILE* log = environment("MENISCUS_COUNT_CALLS").empty()
                       ? nullptr
                       : std::fopen(environment("MENISCUS_COUNT_CALLS").c_str(), "w");
  std::size_t memory = 0;                 // of the buffers alive, bytes
  std::map<cl_mem, std::size_t> buffers;  // each one's
};

// Lives as long as the process: drivers call back late.
Calls& calls() {
  static Calls& all = *new Calls;
  return all;
}

template <class Function>
Function* next(Function*, const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

#define NEXT(name) next(&name, #name)

bool is_meant(cl_command_queue queue) {
  static const std::string wanted = environment("MENISCUS_FAIL_DEVICE");
  if (wanted.empty()) return true;
  if (!queue) return false;
  cl_device_id device = nullptr;
  char name[256] = "";
  NEXT(clGetCommandQueueInfo)(queue, CL_QUEUE_DEVICE, sizeof device, &device, nullptr);
  NEXT(clGetDeviceInfo)(device, CL_DEVICE_NAME, sizeof name, name, nullptr);
  return std::string(name).find(wanted) != std::string::npos;
}

// The error with which this call fails; CL_SUCCESS: it is made.
cl_int turn(const char* name, cl_int usual, cl_command_queue queue = nullptr) {
  static const std::string code = environment("MENISCUS_FAIL_CODE");
  Calls& all = calls();
  const std::lock_guard lock(all.mutex);
  if (!is_meant(queue)) return CL_SUCCESS;
  all.made.push_back(name);
  if (all.log) {
    std::fprintf(all.log, "%s\n", name);
    std::fflush(all.log);
  }
  if (!all.setting.name.empty() && all.setting.name != name) return CL_SUCCESS;
  const long now = ++all.of_name, wanted = all.setting.turn;
  if (wanted == 0 || (all.setting.all_after ? now < wanted : now != wanted)) return CL_SUCCESS;
  all.failed = name;
  return code.empty() ? usual : std::atoi(code.c_str());
}

// Whether the device still has that much, as far as it is limited.
bool fits(std::size_t size) {
  static const std::string most = environment("MENISCUS_DEVICE_MEMORY");
  const std::lock_guard lock(calls().mutex);
  return most.empty() || calls().memory + size <= std::strtoull(most.c_str(), nullptr, 10);
}

void CL_CALLBACK forget(cl_mem buffer, void*) {
  const std::lock_guard lock(calls().mutex);
  calls().memory -= calls().buffers[buffer];
  calls().buffers.erase(buffer);
}

}  // namespace

void fail_call(const std::string& which) {
  const std::lock_guard lock(calls().mutex);
  calls().setting = parse(which);
  calls().made.clear();
  calls().of_name = 0;
  calls().failed.clear();
}

std::vector<std::string> calls_made() { return calls().made; }
std::string failed_call() { return calls().failed; }

}  // namespace meniscus::test

using meniscus::test::turn;

// A call that returns how it went. `usual` is what it most likely fails with.
#define CODE(name, usual, queue, parameters, arguments)                                    \
  extern "C" cl_int name parameters {                                                      \
    if (const cl_int error = turn(#name, usual, queue); error != CL_SUCCESS) return error; \
    return meniscus::test::next(&name, #name) arguments;                                   \
  }

// A call that returns an object, or none and how it went through `errcode`.
#define OBJECT(type, name, usual, queue, parameters, arguments)                \
  extern "C" type name parameters {                                            \
    if (const cl_int error = turn(#name, usual, queue); error != CL_SUCCESS) { \
      if (errcode) *errcode = error;                                           \
      return nullptr;                                                          \
    }                                                                          \
    return meniscus::test::next(&name, #name) arguments;                       \
  }

CODE(clGetPlatformIDs, CL_OUT_OF_HOST_MEMORY, nullptr,
     (cl_uint n, cl_platform_id* platforms, cl_uint* found), (n, platforms, found))
CODE(clGetPlatformInfo, CL_OUT_OF_HOST_MEMORY, nullptr,
     (cl_platform_id platform, cl_platform_info what, size_t size, void* value, size_t* written),
     (platform, what, size, value, written))
CODE(clGetDeviceIDs, CL_OUT_OF_RESOURCES, nullptr,
     (cl_platform_id platform, cl_device_type type, cl_uint n, cl_device_id* devices,
      cl_uint* found),
     (platform, type, n, devices, found))
CODE(clGetDeviceInfo, CL_OUT_OF_RESOURCES, nullptr,
     (cl_device_id device, cl_device_info what, size_t size, void* value, size_t* written),
     (device, what, size, value, written))
CODE(clCreateSubDevices, CL_OUT_OF_RESOURCES, nullptr,
     (cl_device_id device, const cl_device_partition_property* properties, cl_uint n,
      cl_device_id* devices, cl_uint* made),
     (device, properties, n, devices, made))
OBJECT(cl_context, clCreateContext, CL_DEVICE_NOT_AVAILABLE, nullptr,
       (const cl_context_properties* properties, cl_uint n, const cl_device_id* devices,
        void(CL_CALLBACK* notify)(const char*, const void*, size_t, void*), void* user,
        cl_int* errcode),
       (properties, n, devices, notify, user, errcode))
OBJECT(cl_command_queue, clCreateCommandQueue, CL_OUT_OF_HOST_MEMORY, nullptr,
       (cl_context context, cl_device_id device, cl_command_queue_properties properties,
        cl_int* errcode),
       (context, device, properties, errcode))
OBJECT(cl_program, clCreateProgramWithSource, CL_OUT_OF_HOST_MEMORY, nullptr,
       (cl_context context, cl_uint n, const char** texts, const size_t* sizes, cl_int* errcode),
       (context, n, texts, sizes, errcode))
OBJECT(cl_program, clCreateProgramWithBinary, CL_INVALID_BINARY, nullptr,
       (cl_context context, cl_uint n, const cl_device_id* devices, const size_t* sizes,
        const unsigned char** binaries, cl_int* status, cl_int* errcode),
       (context, n, devices, sizes, binaries, status, errcode))
CODE(clBuildProgram, CL_BUILD_PROGRAM_FAILURE, nullptr,
     (cl_program program, cl_uint n, const cl_device_id* devices, const char* options,
      void(CL_CALLBACK* notify)(cl_program, void*), void* user),
     (program, n, devices, options, notify, user))
CODE(clGetProgramInfo, CL_OUT_OF_HOST_MEMORY, nullptr,
     (cl_program program, cl_program_info what, size_t size, void* value, size_t* written),
     (program, what, size, value, written))
CODE(clGetProgramBuildInfo, CL_OUT_OF_HOST_MEMORY, nullptr,
     (cl_program program, cl_device_id device, cl_program_build_info what, size_t size, void* value,
      size_t* written),
     (program, device, what, size, value, written))
OBJECT(cl_kernel, clCreateKernel, CL_INVALID_KERNEL_NAME, nullptr,
       (cl_program program, const char* name, cl_int* errcode), (program, name, errcode))
CODE(clGetMemObjectInfo, CL_OUT_OF_HOST_MEMORY, nullptr,
     (cl_mem memory, cl_mem_info name, size_t size, void* value, size_t* returned),
     (memory, name, size, value, returned))
CODE(clGetKernelInfo, CL_OUT_OF_HOST_MEMORY, nullptr,
     (cl_kernel kernel, cl_kernel_info what, size_t size, void* value, size_t* written),
     (kernel, what, size, value, written))
CODE(clGetKernelWorkGroupInfo, CL_OUT_OF_HOST_MEMORY, nullptr,
     (cl_kernel kernel, cl_device_id device, cl_kernel_work_group_info what, size_t size,
      void* value, size_t* written),
     (kernel, device, what, size, value, written))
CODE(clSetKernelArg, CL_OUT_OF_RESOURCES, nullptr,
     (cl_kernel kernel, cl_uint index, size_t size, const void* value),
     (kernel, index, size, value))
CODE(clSetMemObjectDestructorCallback, CL_OUT_OF_HOST_MEMORY, nullptr,
     (cl_mem buffer, void(CL_CALLBACK* notify)(cl_mem, void*), void* user), (buffer, notify, user))
CODE(clEnqueueFillBuffer, CL_OUT_OF_RESOURCES, queue,
     (cl_command_queue queue, cl_mem buffer, const void* pattern, size_t pattern_size,
      size_t offset, size_t size, cl_uint n, const cl_event* wait, cl_event* event),
     (queue, buffer, pattern, pattern_size, offset, size, n, wait, event))
CODE(clEnqueueWriteBuffer, CL_OUT_OF_RESOURCES, queue,
     (cl_command_queue queue, cl_mem buffer, cl_bool blocking, size_t offset, size_t size,
      const void* from, cl_uint n, const cl_event* wait, cl_event* event),
     (queue, buffer, blocking, offset, size, from, n, wait, event))
CODE(clEnqueueReadBuffer, CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST, queue,
     (cl_command_queue queue, cl_mem buffer, cl_bool blocking, size_t offset, size_t size, void* to,
      cl_uint n, const cl_event* wait, cl_event* event),
     (queue, buffer, blocking, offset, size, to, n, wait, event))
CODE(clEnqueueCopyBuffer, CL_OUT_OF_RESOURCES, queue,
     (cl_command_queue queue, cl_mem from, cl_mem to, size_t from_offset, size_t to_offset,
      size_t size, cl_uint n, const cl_event* wait, cl_event* event),
     (queue, from, to, from_offset, to_offset, size, n, wait, event))
OBJECT(void*, clEnqueueMapBuffer, CL_MAP_FAILURE, queue,
       (cl_command_queue queue, cl_mem buffer, cl_bool blocking, cl_map_flags flags, size_t offset,
        size_t size, cl_uint n, const cl_event* wait, cl_event* event, cl_int* errcode),
       (queue, buffer, blocking, flags, offset, size, n, wait, event, errcode))
CODE(clEnqueueUnmapMemObject, CL_OUT_OF_RESOURCES, queue,
     (cl_command_queue queue, cl_mem buffer, void* mapped, cl_uint n, const cl_event* wait,
      cl_event* event),
     (queue, buffer, mapped, n, wait, event))
CODE(clEnqueueNDRangeKernel, CL_OUT_OF_RESOURCES, queue,
     (cl_command_queue queue, cl_kernel kernel, cl_uint dimensions, const size_t* offset,
      const size_t* global, const size_t* local, cl_uint n, const cl_event* wait, cl_event* event),
     (queue, kernel, dimensions, offset, global, local, n, wait, event))
CODE(clGetEventProfilingInfo, CL_PROFILING_INFO_NOT_AVAILABLE, nullptr,
     (cl_event event, cl_profiling_info what, size_t size, void* value, size_t* written),
     (event, what, size, value, written))
CODE(clFlush, CL_OUT_OF_RESOURCES, queue, (cl_command_queue queue), (queue))
CODE(clFinish, CL_OUT_OF_RESOURCES, queue, (cl_command_queue queue), (queue))
CODE(clWaitForEvents, CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST, nullptr,
     (cl_uint n, const cl_event* events), (n, events))

extern "C" cl_mem clCreateBuffer(cl_context context, cl_mem_flags flags, size_t size, void* host,
                                 cl_int* errcode) {
  using namespace meniscus::test;
  cl_int error = turn("clCreateBuffer", CL_MEM_OBJECT_ALLOCATION_FAILURE);
  if (!fits(size)) error = CL_MEM_OBJECT_ALLOCATION_FAILURE;
  if (error != CL_SUCCESS) {
    if (errcode) *errcode = error;
    return nullptr;
  }
  const cl_mem buffer = NEXT(clCreateBuffer)(context, flags, size, host, errcode);
  if (!buffer) return buffer;
  {
    const std::lock_guard lock(calls().mutex);
    calls().memory += size;
    calls().buffers[buffer] = size;
  }
  NEXT(clSetMemObjectDestructorCallback)(buffer, forget, nullptr);
  return buffer;
}

extern "C" cl_mem clCreateSubBuffer(cl_mem buffer, cl_mem_flags flags, cl_buffer_create_type type,
                                    const void* region, cl_int* errcode) {
  using namespace meniscus::test;
  const cl_int error = turn("clCreateSubBuffer", CL_OUT_OF_RESOURCES);
  if (error != CL_SUCCESS) {
    if (errcode) *errcode = error;
    return nullptr;
  }
  return NEXT(clCreateSubBuffer)(buffer, flags, type, region, errcode);
}
