// parts: frames that pass in parts of space, for what needs all of the fluid (closed meshes). Each
// part's particles, and those around it that bear on it, are read and put in order by themselves.
#pragma once

#include <cstdint>
#include <vector>

#include "meniscus/source.hpp"
#include "prepare/fill.hpp"
#include "stages/closed/block_box.hpp"
#include "stages/closed/share_space.hpp"
#include "stages/frame/project.hpp"
#include "stages/space_box.hpp"
#include "stages/view.hpp"

namespace meniscus {

/// What a frame is like as a whole.
struct PartedFrame {
  double radius = 0;         // of the particles, world units
  View view;                 // make_world_view()
  SpaceBox within;           // of its eye space: what lies outside is dropped
  std::int64_t all = 0;      // particles
  bool moving = false;       // whether they carry velocities
  bool all_known = true;     // whether all values that they carry can be used
  bool misfit_told = false;  // whether survey_parts() has warned of the radius
  CubeCounts counts;         // of particles; none where the frame needs no parts
};

/// Looks at a frame whose blocks of cells have a side of `block` particle radii. Warns of what was
/// dropped, estimated or cannot be used. All processes of the source's team call this. Throws as
/// fill_everything(), which says what `farthest` is.
PartedFrame survey_parts(const Filling& filling, const ParticleSource& source, double block,
                         double farthest = SpaceBox::kFar);

/// Shares space out: boxes of blocks that fill it, of which none with the particles in `halo`
/// particle radii around it takes more than `memory` bytes, as far as boxes are not thinner than 64
/// particle radii; at least as many as there are processes where that leaves none of them thinner.
std::vector<BlockBox> share_parts(std::size_t memory, const PartedFrame& frame, double block,
                                  double halo, int processes);

/// Where the particles of a process's share go that are evened out (even_parts.hpp), as it reads
/// them: eye space, in the disorder's unit of length; NaN: left out.
struct EvenedPlaces {
  double unit = 1;  // of length, particle radii
  std::vector<float> x, y, z;
};

/// Particles that a process was sent, of all that some boxes hold.
struct PickedParticles {
  Particles particles;                         // in the order of who sent them
  std::vector<std::size_t> received;           // [processes] how many each sent
  std::vector<std::vector<std::size_t>> sent;  // [processes] which of this one's share they got
};

/// Picks particles for all processes, which call this with the same boxes, one for each of them
/// (eye space, particle radii); each gets those in its own, with what their order takes and no
/// more.
PickedParticles pick_to_even_out(const ParticleSource& source, const PartedFrame& frame,
                                 const std::vector<SpaceBox>& boxes);

/// What a part had, to be told once all have been.
struct PartTally {
  std::int64_t had = 0, dropped = 0, copies = 0;  // of its own particles
  double largest = 0;                             // crowd
  double too_large = 0, too_small = 0;            // its radius; 0: it is not
};

/// The canonical order of the particles of a part and of those around it, without crowds.
///
///   own  where the part ends and others begin
std::vector<std::size_t> order_of_part(const PartedFrame& frame, const Particles& particles,
                                       const SpaceBox& own, PartTally& tally);

/// Fills a part for each process. All call this with the same boxes as pick_to_even_out().
///
///   own  where this process's part ends and others' begin
PlacedParticles fill_part(const Filling& filling, const ParticleSource& source,
                          const PartedFrame& frame, const std::vector<SpaceBox>& boxes,
                          const SpaceBox& own, PartTally& tally);

/// The same of a frame whose particles were evened out, those that have gone to the boxes.
PlacedParticles fill_part(const Filling& filling, const ParticleSource& source,
                          const PartedFrame& frame, const std::vector<SpaceBox>& boxes,
                          const EvenedPlaces& evened);

/// Warns of what all parts together had.
void report(const std::vector<PartTally>& tallies, const PartedFrame& frame, Notices& notices);

}  // namespace meniscus
