// The one call: particles and a camera in, the visible surface out.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "meniscus/camera.hpp"
#include "meniscus/error.hpp"
#include "meniscus/io.hpp"
#include "meniscus/parameters.hpp"
#include "meniscus/types.hpp"

namespace meniscus {

class Device;

/// Time spent in one stage, in milliseconds.
struct StageTime {
  std::string stage;
  double host_ms = 0;    // wall time on the host
  double device_ms = 0;  // sum of the stage's kernels, from their events
  std::vector<std::pair<std::string, double>> kernels;  // each launch's name and device_ms, in order
};

/// Extracts the surface of `particles` seen by `camera` (the whole paper, 2.1 to 2.5).
///
///   particles  any order; the result does not depend on it
///   camera     see types.hpp
///   timings    when given, receives one entry a stage, in order
///
/// Returns a valid, empty surface with a warning when nothing is in view.
/// Throws InvalidArgument for bad parameters or camera, DeviceError when the device fails.
Surface extract(Device& device, const Particles& particles, const Camera& camera,
                const Parameters& parameters = {}, std::vector<StageTime>* timings = nullptr);

/// The version, "major.minor.patch".
std::string version();

}  // namespace meniscus
