// OpenCL's C++ headers, as all of the library sees them; what its own headers say names none of it.
#pragma once

#define CL_HPP_TARGET_OPENCL_VERSION 120
#define CL_HPP_MINIMUM_OPENCL_VERSION 120
#define CL_HPP_ENABLE_EXCEPTIONS
#include <CL/opencl.hpp>

#include "meniscus/device.hpp"

namespace meniscus {

struct DeviceHandle {
  cl::Device device;
};

inline const cl::Device& handle_of(const DeviceInfo& info) { return info.handle->device; }

}  // namespace meniscus
