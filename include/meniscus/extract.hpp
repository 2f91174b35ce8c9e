// The one call: particles and a camera in, the visible surface out.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "meniscus/borrowed.hpp"
#include "meniscus/camera.hpp"
#include "meniscus/error.hpp"
#include "meniscus/export.hpp"
#include "meniscus/io.hpp"
#include "meniscus/motion.hpp"
#include "meniscus/parameters.hpp"
#include "meniscus/source.hpp"
#include "meniscus/types.hpp"
#include "meniscus/version.hpp"

namespace meniscus MENISCUS_API {

class Device;

/// Device memory that the passes over particles that stream may take, where nothing else is said:
/// bytes.
inline constexpr std::size_t kStreamMemory = std::size_t{128} << 20;

/// Time spent in one stage, in milliseconds.
struct StageTime {
  std::string stage;
  double host_ms = 0;    // wall time on the host
  double device_ms = 0;  // sum of the stage's kernels, from their events
  std::vector<std::pair<std::string, double>>
      kernels;  // each launch's name and device_ms, in order
};

/// Extracts the surface of `particles` seen by `camera` (the whole paper, 2.1 to 2.5).
///
///   particles  any order; the result does not depend on it. Borrowed ones are read where they lie
///   camera     see types.hpp
///   timings    when given, receives an entry each time a stage runs, in order
///
/// Returns a valid, empty surface with a warning when nothing is in view.
/// Throws InvalidArgument for bad parameters, camera or arrays, InputError for values that are not
/// finite where parameters.strict is set, DeviceError when the device fails.
Surface extract(Device& device, const Particles& particles, const Camera& camera,
                const Parameters& parameters = {}, std::vector<StageTime>* timings = nullptr);
Surface extract(Device& device, const BorrowedParticles& particles, const Camera& camera,
                const Parameters& parameters = {}, std::vector<StageTime>* timings = nullptr);

/// The same for particles that need not fit into memory. Frames of 2^18 particles and more stream:
/// they pass through the device in parts, and only what bears on the image is kept. Where three
/// quarters of the particles in view lie closer than half of params.thin, methods fit, groups and
/// stable work on fewer that stand for them, about params.thin pixels apart.
///
///   memory  of the device that the passes over the particles may take, bytes; never changes the
///           result
///
/// Where several processes share the source, all call this; the first returns the surface, the
/// others one without maps and mesh.
///
/// Throws as for particles in memory, InvalidArgument when `memory` is too little, and InputError
/// when the source cannot be read or, where it is not in memory, one of its radii is not a
/// positive, finite number.
Surface extract(Device& device, const ParticleSource& source, const Camera& camera,
                const Parameters& parameters = {}, std::vector<StageTime>* timings = nullptr,
                std::size_t memory = kStreamMemory);

/// The version, "major.minor.patch".
std::string version();

}  // namespace MENISCUS_API
