// fill: the ways in which particles become a frame that a method works on. What a method sees does
// not tell them apart.
//
// A frame in memory is put in order as a whole. One of 2^18 particles and more streams: a survey
// says what it is like, then what of it can matter is picked, or thinned where particles lie closer
// than pixels can tell. Where several processes share a frame, each looks at its share, and the
// first one gets what matters.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/notices.hpp"
#include "device/stage_clock.hpp"
#include "meniscus/parameters.hpp"
#include "meniscus/source.hpp"
#include "prepare/thin.hpp"
#include "stages/frame/project.hpp"
#include "stages/space_box.hpp"
#include "stages/view.hpp"

namespace meniscus {

/// Frames of at least this many particles stream.
inline constexpr std::int64_t kStreamed = std::int64_t{1} << 18;

/// How a frame is to be filled.
struct Filling {
  Device& device;
  const Camera& camera;
  const Parameters& params;
  std::size_t memory;  // of the device that the passes over particles that stream may take, bytes
  StageClock& clock;   // runs nothing before and after
  Notices& notices;
};

/// A frame, ready for a method.
struct FilledFrame {
  double radius = 0;         // of the particles, world units
  View view;                 // in radii of `particles`
  WorldParticles particles;  // none but in the first process of the team
  std::int64_t all = -1;     // particles of the whole frame, where these are but some of them
  // Where these stand for others (thin.hpp):
  double factor = 1;                             // how many times as far apart they lie
  std::vector<SprayDrop> spray;                  // drops that are too small for the surface
  std::vector<std::vector<float>> of_the_spray;  // [attributes][drops]
};

/// Fills a frame. Warns of what was dropped, estimated or looks wrong. All processes of the
/// source's team call this. Waits. Throws InputError for values that are not finite where
/// params.strict, and as survey_of(), InvalidArgument where `memory` is too little, DeviceError.
FilledFrame fill_frame(const Filling& filling, const ParticleSource& source);

/// Fills a frame with all particles, however many, seen by filling.camera. All are held in memory.
/// As fill_frame() else.
FilledFrame fill_whole_frame(const Filling& filling, const ParticleSource& source);

/// Fills a frame with all particles, however many, for what needs no camera: filling.camera is not
/// looked at, and the view is make_world_view(). All are held in memory. Those that lie `farthest`
/// particle radii or more from the origin along an axis are dropped with a notice. Throws
/// InputError where params.strict, or none is left. As fill_frame() else.
FilledFrame fill_everything(const Filling& filling, const ParticleSource& source,
                            double farthest = SpaceBox::kFar);

/// Tells of particles that were dropped since they lie too far from the others, if there are any.
/// Throws InputError when params.strict, or where none of `size` is left.
///
///   farthest  as of fill_everything()
void report_far(std::int64_t far, std::int64_t size, double farthest, const Parameters& params,
                Notices& notices);

/// Whether any of the particles with these bounds, world units, lies outside a box of the eye space
/// of a make_world_view(); or, of any view, outside one whose sides lie at infinity: none does.
bool reaches_beyond(const View& view, const SpaceBox& box, const std::array<float, 3>& low,
                    const std::array<float, 3>& high);

/// Particles in an order, all of one radius (world units).
WorldParticles particles_in_order(const BorrowedParticles& particles,
                                  const std::vector<std::size_t>& order, double radius,
                                  bool moving);

}  // namespace meniscus
