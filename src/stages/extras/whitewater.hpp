// whitewater: foam, spray and bubbles, drawn as discs that face the camera into sums of whole
// numbers, which come out the same in whatever order the particles come. All lengths are in
// particle radii of the water but where a comment says otherwise.
#pragma once

#include <vector>

#include "device/device.hpp"
#include "stages/stage_data.hpp"

namespace meniscus {

/// The depths at which a type of particles is seen, for each pixel, both ends included.
struct ShownDepths {
  Buffer<float> from, to;
  float slack = 0;  // of bubbles: the water's front lies so far behind `from`
};

/// Where there is water, from what is known of it.
///
///   depth      [pixels] of the front, world units; kNoSurface where there is none
///   exit       [pixels] where rays leave the first body, world units; empty: not known
///   tolerance  how far behind the front foam and spray are seen, and before it bubbles
ShownDepths shown_depths(Device& device, const View& view, WhitewaterType type,
                         const std::vector<float>& depth, const std::vector<float>& exit,
                         double tolerance);

/// Sums over the particles of a type, on the device (kernels/extras/whitewater.cl).
struct WhitewaterSums {
  bool moves = false;        // with velocities
  bool lies_behind = false;  // with depths behind the front
  Buffer<cl_uint> sum;       // [rows][2][pixels]
  Buffer<cl_uint> depth;     // [pixels] bits of the nearest
};

/// Sums of no particle. Throws InvalidArgument for an image that is too large.
WhitewaterSums no_whitewater(Device& device, const View& view, bool moves, bool lies_behind);

/// Particles on the device, world units.
struct WhitewaterParticles {
  Buffer<float> x, y, z;     // [count]; what is not finite is not drawn
  Buffer<float> radius;      // [count] 0: not drawn
  Buffer<float> vx, vy, vz;  // [count] world units per second, finite; where the sums move
};

/// Adds `count` particles to the sums. Does not wait.
void draw_whitewater(Device& device, const View& view, const WhitewaterParticles& particles,
                     std::size_t count, const ShownDepths& shown, const WhitewaterSums& sums);

/// The maps that the sums stand for. Waits.
WhitewaterMaps finish_whitewater(Device& device, const View& view, WhitewaterType type,
                                 const WhitewaterSums& sums);

}  // namespace meniscus
