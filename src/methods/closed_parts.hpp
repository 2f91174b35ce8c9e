// The closed surface of frames that are too large to be held at a time, or that several processes
// share: part by part, with the bytes of closed.cpp.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "base/team.hpp"
#include "meniscus/closed.hpp"
#include "methods/extraction.hpp"
#include "stages/closed/mesh_parts.hpp"
#include "stages/frame/relax.hpp"
#include "stages/space_box.hpp"

namespace meniscus {

/// How far around a part particles are needed, where they lie once they are evened out; particle
/// radii.
double halo_of_parts(double cell, const Parameters& params, const Disorder& disorder);

/// Fills a part for each process, of which there may be none: the particles in each one's box (eye
/// space, particle radii), which reaches beyond what is its own; placed where they lie once they
/// are evened out, in the disorder's unit of length.
///
///   part  this process's, among all; where there is none, the number of parts
///   own   what is this part's own
using FillPart = std::function<PlacedParticles(std::size_t part, const std::vector<SpaceBox>& boxes,
                                               const SpaceBox& own)>;

/// Meshes all particles, of which no more than those in one part and around it are held at a time.
/// All processes of the team call this; the first one gets the mesh.
///
///   view      make_world_view()
///   parts     fill all of space
///   disorder  of the whole frame, which no part could tell; they were evened out by it
///   carry     whether what particles carry goes to the mesh
///
/// Returns mesh and counts, the same as run_closed() of all particles with this disorder.
Extraction run_closed_in_parts(Device& device, const View& view, Team& team,
                               const std::vector<BlockBox>& parts, const FillPart& fill,
                               const ClosedParams& closed, const Parameters& params,
                               const Disorder& disorder, bool carry,
                               std::vector<StageTime>* timings);

}  // namespace meniscus
