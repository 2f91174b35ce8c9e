// What OpenCL's errors are called.
#pragma once

#include <string>

#include "device/opencl.hpp"

namespace meniscus {

/// The name of an error in the OpenCL headers, "CL_OUT_OF_RESOURCES"; of one that is not known
/// "OpenCL error".
const char* symbol_of(cl_int error);

/// The call that failed and how: "clCreateBuffer failed with CL_OUT_OF_RESOURCES (-5)".
std::string describe(const cl::Error& error);

/// Throws DeviceError in a child of a process that has asked this before, which is asked before
/// anything is asked of OpenCL: a fork takes no threads of drivers along, and who waits for them
/// waits for ever.
void check_not_forked();

/// Whether less at a time might have worked.
bool is_out_of_memory(cl_int error);

/// What the compiler said of a program, or nothing where that cannot be asked.
std::string build_log(const cl::Program& program, const cl::Device& device);

/// The first line of a compiler's log that speaks of an error, or the first line.
std::string first_error(const std::string& log);

}  // namespace meniscus
