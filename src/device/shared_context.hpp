// One OpenCL context for all that is open on a device.
#pragma once

#include <memory>

#include "device/opencl.hpp"

namespace meniscus {

/// The context of a device while somebody holds it, else a new one. A GPU runs work of one context
/// at a time, and work of one context's queues side by side: with a context for all, frames in
/// flight come 1.3 times as fast (docs/performance_appendix.md). Throws cl::Error.
std::shared_ptr<cl::Context> shared_context(const cl::Device& device);

/// Whoever asks for it from now on gets another: this one may be broken.
void forget_shared_context(const cl::Device& device);

}  // namespace meniscus
