// Probes of a device's arithmetic, memory and work-items: what explains why a kernel's bits differ.
#pragma once

#include "device/device.hpp"
#include "verify/row.hpp"

namespace meniscus::verify {

// What the same bits rest on, one thing a row (kernels/arithmetic.cl). A row names the section of
// the OpenCL 1.2 specification that promises it; what is not promised or not needed is not
// required. A probe that does not build or run is a failed row.

/// What is computed of single values, in widths 1 and 8.
void probe_expressions(Device& device, const Report& report);

/// Vectors, private memory, arguments, atomics, barriers, local memory, ranges, buffers and the
/// order of commands.
void probe_execution(Device& device, const Report& report);

/// Whether a kernel with `bytes` of local memory, or with work-groups of `items`, does what it
/// should.
bool local_memory_works(Device& device, std::size_t bytes);
bool work_group_works(Device& device, std::size_t items);

/// How many work-items that kernel's groups may have: CL_KERNEL_WORK_GROUP_SIZE.
std::size_t work_group_claimed(Device& device);

}  // namespace meniscus::verify
