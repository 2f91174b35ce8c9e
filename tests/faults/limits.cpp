// limits: a library to be preloaded that makes every OpenCL device look, and behave, like one
// without extras: small buffers, little local memory, small work-groups, no 64-bit atomics, no
// doubles, no halves, no images, OpenCL 1.2. What a program asks for beyond them is refused with
// the error that the specification names, and with a line on stderr.
//
//   LD_PRELOAD=limits.so MENISCUS_LIMIT_GROUP=64 meniscus extract ...
//
//   MENISCUS_LIMIT_BUFFER  largest buffer, bytes (default 16 MiB)
//   MENISCUS_LIMIT_LOCAL   local memory, bytes (default 32 KiB)
//   MENISCUS_LIMIT_GROUP   largest work-group, work-items (default 64)
//   MENISCUS_LIMIT_KIND    "gpu": devices call themselves GPUs (default: what they are)
#ifndef CL_TARGET_OPENCL_VERSION
#define CL_TARGET_OPENCL_VERSION 120
#endif
#include <CL/cl.h>
#include <CL/cl_ext.h>
#include <dlfcn.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <regex>
#include <string>

namespace {

std::size_t limit(const char* variable, std::size_t otherwise) {
  const char* value = std::getenv(variable);
  return value && *value ? std::stoull(value) : otherwise;
}

std::size_t largest_buffer() {
  static const std::size_t bytes = limit("MENISCUS_LIMIT_BUFFER", 16 << 20);
  return bytes;
}

std::size_t local_memory() {
  static const std::size_t bytes = limit("MENISCUS_LIMIT_LOCAL", 32 << 10);
  return bytes;
}

std::size_t largest_group() {
  static const std::size_t items = limit("MENISCUS_LIMIT_GROUP", 64);
  return items;
}

bool as_gpu() {
  const char* kind = std::getenv("MENISCUS_LIMIT_KIND");
  return kind && std::strcmp(kind, "gpu") == 0;
}

constexpr char kExtensions[] =
    "cl_khr_global_int32_base_atomics cl_khr_global_int32_extended_atomics "
    "cl_khr_local_int32_base_atomics cl_khr_local_int32_extended_atomics "
    "cl_khr_byte_addressable_store";

// The function of this name that would be called without this library.
template <class Function>
Function* real(const char* name, Function*) {
  static void* const found = dlsym(RTLD_NEXT, name);
  if (found) return reinterpret_cast<Function*>(found);
  std::fprintf(stderr, "limits: there is no %s\n", name);
  std::abort();
}
#define REAL(function) \
  ([] { static auto* const found = real(#function, &::function); return found; }())

cl_int refuse(const std::string& what, cl_int error) {
  std::fprintf(stderr, "limits: %s\n", what.c_str());
  return error;
}

// Answers a query as OpenCL does: with the size, the value, or both.
cl_int answer(const void* value, std::size_t bytes, std::size_t room, void* to,
              std::size_t* needed) {
  if (needed) *needed = bytes;
  if (!to) return CL_SUCCESS;
  if (room < bytes) return CL_INVALID_VALUE;
  std::memcpy(to, value, bytes);
  return CL_SUCCESS;
}
template <class T>
cl_int answer(const T& value, std::size_t room, void* to, std::size_t* needed) {
  return answer(&value, sizeof(T), room, to, needed);
}
cl_int answer(const std::string& text, std::size_t room, void* to, std::size_t* needed) {
  return answer(text.c_str(), text.size() + 1, room, to, needed);
}

std::mutex mutex;
std::map<cl_program, std::string> sources;

// What in a program needs a device with extras; empty: nothing.
std::string extra_in(const std::string& source, const std::string& options) {
  if (std::smatch found; std::regex_search(options, found, std::regex("-cl-std=CL(1\\.[3-9]|[2-9])")))
    return found.str();
  const std::string code = std::regex_replace(source, std::regex("//[^\n]*"), "");
  const std::regex extra(
      "\\b(double(2|3|4|8|16)?|half(2|3|4|8|16)?|image[123]d\\w*|sampler_t|atom_\\w+|"
      "atomic_\\w+_explicit|cl_khr_(fp64|fp16|int64\\w*))\\b");
  std::smatch found;
  return std::regex_search(code, found, extra) ? found.str() : "";
}

}  // namespace

extern "C" {

cl_int clGetDeviceInfo(cl_device_id device, cl_device_info what, std::size_t room, void* to,
                       std::size_t* needed) {
  const auto query = REAL(clGetDeviceInfo);
  switch (what) {
    case CL_DEVICE_MAX_MEM_ALLOC_SIZE:
    case CL_DEVICE_LOCAL_MEM_SIZE: {
      cl_ulong bytes = 0;
      if (const cl_int error = query(device, what, sizeof(bytes), &bytes, nullptr)) return error;
      const std::size_t most =
          what == CL_DEVICE_LOCAL_MEM_SIZE ? local_memory() : largest_buffer();
      return answer(std::min<cl_ulong>(bytes, most), room, to, needed);
    }
    case CL_DEVICE_MAX_WORK_GROUP_SIZE: {
      std::size_t items = 0;
      if (const cl_int error = query(device, what, sizeof(items), &items, nullptr)) return error;
      return answer(std::min(items, largest_group()), room, to, needed);
    }
    case CL_DEVICE_MAX_WORK_ITEM_SIZES: {
      const cl_int error = query(device, what, room, to, needed);
      if (error || !to) return error;
      auto* sizes = static_cast<std::size_t*>(to);
      for (std::size_t k = 0; k < room / sizeof(std::size_t) && k < 3; ++k)
        sizes[k] = std::min(sizes[k], largest_group());
      return CL_SUCCESS;
    }
    case CL_DEVICE_TYPE:
      if (as_gpu()) return answer(cl_device_type{CL_DEVICE_TYPE_GPU}, room, to, needed);
      return query(device, what, room, to, needed);
    case CL_DEVICE_VERSION:
      return answer(std::string("OpenCL 1.2 limited"), room, to, needed);
    case CL_DEVICE_OPENCL_C_VERSION:
      return answer(std::string("OpenCL C 1.2 limited"), room, to, needed);
    case CL_DEVICE_EXTENSIONS:
      return answer(std::string(kExtensions), room, to, needed);
    case CL_DEVICE_IMAGE_SUPPORT:
      return answer(cl_bool{CL_FALSE}, room, to, needed);
    case CL_DEVICE_DOUBLE_FP_CONFIG:
      return answer(cl_device_fp_config{0}, room, to, needed);
    case CL_DEVICE_PREFERRED_VECTOR_WIDTH_DOUBLE:
    case CL_DEVICE_NATIVE_VECTOR_WIDTH_DOUBLE:
    case CL_DEVICE_PREFERRED_VECTOR_WIDTH_HALF:
    case CL_DEVICE_NATIVE_VECTOR_WIDTH_HALF:
      return answer(cl_uint{0}, room, to, needed);
    default:
      return query(device, what, room, to, needed);
  }
}

cl_int clGetKernelWorkGroupInfo(cl_kernel kernel, cl_device_id device,
                                cl_kernel_work_group_info what, std::size_t room, void* to,
                                std::size_t* needed) {
  const auto query = REAL(clGetKernelWorkGroupInfo);
  if (what != CL_KERNEL_WORK_GROUP_SIZE) return query(kernel, device, what, room, to, needed);
  std::size_t items = 0;
  if (const cl_int error = query(kernel, device, what, sizeof(items), &items, nullptr))
    return error;
  return answer(std::min(items, largest_group()), room, to, needed);
}

cl_mem clCreateBuffer(cl_context context, cl_mem_flags flags, std::size_t bytes, void* host,
                      cl_int* error) {
  if (bytes <= largest_buffer()) return REAL(clCreateBuffer)(context, flags, bytes, host, error);
  const cl_int why = refuse("a buffer of " + std::to_string(bytes) + " bytes, at most " +
                            std::to_string(largest_buffer()) + " are allowed", CL_INVALID_BUFFER_SIZE);
  if (error) *error = why;
  return nullptr;
}

cl_mem clCreateImage(cl_context, cl_mem_flags, const cl_image_format*, const cl_image_desc*, void*,
                     cl_int* error) {
  const cl_int why = refuse("an image", CL_INVALID_OPERATION);
  if (error) *error = why;
  return nullptr;
}

cl_program clCreateProgramWithSource(cl_context context, cl_uint count, const char** texts,
                                     const std::size_t* lengths, cl_int* error) {
  const cl_program program =
      REAL(clCreateProgramWithSource)(context, count, texts, lengths, error);
  if (!program) return program;
  std::string source;
  for (cl_uint k = 0; k < count; ++k)
    source += lengths && lengths[k] ? std::string(texts[k], lengths[k]) : std::string(texts[k]);
  const std::lock_guard lock(mutex);
  sources[program] = source;
  return program;
}

cl_int clBuildProgram(cl_program program, cl_uint count, const cl_device_id* devices,
                      const char* options, void(CL_CALLBACK* notify)(cl_program, void*),
                      void* data) {
  std::string source;
  {
    const std::lock_guard lock(mutex);
    source = sources[program];
  }
  if (const std::string extra = extra_in(source, options ? options : ""); !extra.empty())
    return refuse("a program that needs " + extra, CL_BUILD_PROGRAM_FAILURE);
  return REAL(clBuildProgram)(program, count, devices, options, notify, data);
}

cl_int clSetKernelArg(cl_kernel kernel, cl_uint index, std::size_t bytes, const void* value) {
  if (!value && bytes > local_memory())
    return refuse("local memory of " + std::to_string(bytes) + " bytes", CL_INVALID_ARG_SIZE);
  return REAL(clSetKernelArg)(kernel, index, bytes, value);
}

cl_int clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions,
                              const std::size_t* offset, const std::size_t* global,
                              const std::size_t* local, cl_uint waits, const cl_event* wait_for,
                              cl_event* event) {
  std::size_t items = 1;
  for (cl_uint k = 0; local && k < dimensions; ++k) items *= local[k];
  if (items > largest_group())
    return refuse("a work-group of " + std::to_string(items) + ", at most " +
                      std::to_string(largest_group()) + " are allowed",
                  CL_INVALID_WORK_GROUP_SIZE);
  cl_device_id device = nullptr;
  cl_ulong used = 0;
  if (clGetCommandQueueInfo(queue, CL_QUEUE_DEVICE, sizeof(device), &device, nullptr) ==
          CL_SUCCESS &&
      clGetKernelWorkGroupInfo(kernel, device, CL_KERNEL_LOCAL_MEM_SIZE, sizeof(used), &used,
                               nullptr) == CL_SUCCESS &&
      used > local_memory())
    return refuse("a kernel with " + std::to_string(used) + " bytes of local memory",
                  CL_OUT_OF_RESOURCES);
  return REAL(clEnqueueNDRangeKernel)(queue, kernel, dimensions, offset, global, local, waits,
                                      wait_for, event);
}

}  // extern "C"
