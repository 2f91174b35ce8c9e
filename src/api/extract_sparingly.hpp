// A frame's second chance on a device that ran out of memory.
#pragma once

#include <cstddef>
#include <vector>

#include "meniscus/extract.hpp"

namespace meniscus {

/// extract() for a device that ran out of memory (`first`, the error): with nothing kept from
/// earlier frames, and an eighth of `memory` at a time. The result is the same; its warnings say
/// what was done. Throws `first` where `memory` cannot be less.
Surface extract_sparingly(Device& device, const ParticleSource& source, const Camera& camera,
                          const Parameters& parameters, std::vector<StageTime>* timings,
                          std::size_t memory, const OutOfDeviceMemory& first);

/// extract() that tells nothing that was told since the last call of extract() on the device
/// (Device::on_notice).
Surface extract_again(Device& device, const ParticleSource& source, const Camera& camera,
                      const Parameters& parameters, std::vector<StageTime>* timings,
                      std::size_t memory);

}  // namespace meniscus
