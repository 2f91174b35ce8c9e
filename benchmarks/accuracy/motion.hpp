// Water that moves a little from frame to frame, particles and truth alike.
#pragma once

#include <functional>

#include "accuracy/scene.hpp"
#include "meniscus/types.hpp"

namespace meniscus::accuracy {

/// Where points are in each frame; in frame 0 they are where they are.
struct Motion {
  std::function<Vec3d(const Vec3d&, int frame)> forth;  // frame 0 -> `frame`
  std::function<Vec3d(const Vec3d&, int frame)> back;   // `frame` -> frame 0
};

/// A shift by (.03, -.02, .04) s a frame, and a turn about the vertical through `centre` by .002
/// radians a frame, which is .06 s at a distance of 30 s.
Motion rigid_motion(const Vec3d& centre);

/// Three shears in turn, along x, y and z, each a sine of the next coordinate over 20 to 24 s with
/// an amplitude of .06 s a frame: smooth, keeps volumes, lengths to 2 % a frame.
Motion smooth_bend();

Particles moved(Particles particles, const Motion& motion, int frame);

/// The scene in that frame; the camera stays.
Scene moved(Scene scene, const Motion& motion, int frame);

}  // namespace meniscus::accuracy
