// What both ways through extract() share: particles in memory, and particles that stream.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "meniscus/device.hpp"
#include "meniscus/parameters.hpp"
#include "meniscus/source.hpp"
#include "meniscus/types.hpp"

namespace meniscus {

/// Frames of at least this many particles stream.
inline constexpr std::int64_t kStreamed = std::int64_t{1} << 18;

/// The particle radius (world units): the parameters', else the middle of the particles' own, else
/// the one stated, else an estimate from the spacing, with a warning.
///
///   order  of the particles with finite coordinates, canonical
double choose_radius(const BorrowedParticles& particles, const std::vector<std::size_t>& order,
                     const Parameters& params, std::vector<std::string>& warnings);

/// The same of a source, in memory or not. Throws InputError where its particles are too many to
/// estimate it.
double choose_radius(const ParticleSource& source, const Parameters& params,
                     std::vector<std::string>& warnings);

/// How many threads the host's loops of a frame may use on a device; 0: all there are.
inline unsigned host_threads(const DeviceInfo& device) {
  return device.is_part ? device.compute_units : 0;
}

}  // namespace meniscus
