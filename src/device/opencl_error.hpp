// What OpenCL's errors are called.
#pragma once

#include <string>

#include "meniscus/device.hpp"

namespace meniscus {

/// The name of an error in the OpenCL headers, "CL_OUT_OF_RESOURCES"; of one that is not known
/// "OpenCL error".
const char* symbol_of(cl_int error);

/// The call that failed and how: "clCreateBuffer failed with CL_OUT_OF_RESOURCES (-5)".
std::string describe(const cl::Error& error);

/// Whether less at a time might have worked.
bool is_out_of_memory(cl_int error);

}  // namespace meniscus
