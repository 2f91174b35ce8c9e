// The programs that a method's kernels are in.
#pragma once

#include <vector>

#include "device/building.hpp"
#include "device/device.hpp"
#include "meniscus/parameters.hpp"

namespace meniscus {

/// What method `fit` builds on a device, in the order in which it needs them, for BuildAhead and
/// for bars; of other methods nothing is listed. Large frames need `stream.cl` besides, and
/// particles with velocities `motion.cl`.
std::vector<ProgramName> programs_of(const Parameters& params, const Device::State& device);

/// The same of a closed mesh.
std::vector<ProgramName> closed_programs(const Parameters& params, const Device::State& device);

}  // namespace meniscus
