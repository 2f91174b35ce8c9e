// Making and checking cameras.
#pragma once

#include <string>

#include "meniscus/export.hpp"
#include "meniscus/source.hpp"
#include "meniscus/types.hpp"

namespace meniscus MENISCUS_API {

/// A perspective camera at `eye` that looks at `target`.
///
///   eye, target, up  world units; up must not be parallel to target - eye
///   fov_degrees      vertical field of view, in (0, 180)
///   width, height    pixels, >= 1
///
/// Throws InvalidArgument for a degenerate set-up.
Camera look_at(const std::array<double, 3>& eye, const std::array<double, 3>& target,
               const std::array<double, 3>& up, double fov_degrees, int width, int height);

/// How a camera that frames particles looks at them, e.g. {.width = 640, .height = 480}.
struct Framing {
  std::array<double, 3> up{0, 1, 0};  // of the world
  double fov = 40;                    // vertical field of view, degrees, in (0, 180)
  int width = 1024, height = 768;     // pixels, >= 1
};

/// A perspective camera that shows all finite particles with their radius (guessed from their
/// number where none is known), from above and to the side: the box around them fills 92 % of the
/// image's width or height. Of a hundred and more not those that a simulation threw away, farther
/// from the middle than 20 times what 98 % of them (or of a sample) reach. An empty set gets a
/// camera at a distance of 1 that looks at the origin. Throws InvalidArgument for a size below 1, a
/// field of view or an `up` that is not valid, or particles that check() refuses.
Camera frame_particles(const Particles& particles, const Framing& framing = {});
Camera frame_particles(const BorrowedParticles& particles, const Framing& framing = {});
/// The same. Throws also InputError when the source cannot be read.
Camera frame_particles(const ParticleSource& source, const Framing& framing = {});

/// The most pixels that a side of an image may have.
[[maybe_unused]] constexpr int kLargestSide = 16384;

/// Throws InvalidArgument unless the camera has a size of 1 to kLargestSide pixels a side, finite
/// matrices, a rigid view, and an invertible projection that is perspective or orthographic. The
/// message names the entry at fault.
void check(const Camera& camera);

/// The width of a pixel over its height as the projection has it: 1 within 2 %, which is what
/// rounding an image's sides to pixels may cost.
double pixel_aspect_ratio(const Camera& camera);

}  // namespace MENISCUS_API
