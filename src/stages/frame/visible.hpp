// visible: the depth map of the particles' spheres and the particles that own it (paper 2.1).
#pragma once

#include <limits>
#include <vector>

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/frame/bins.hpp"
#include "stages/frame/occupied_blocks.hpp"
#include "stages/frame/project.hpp"

namespace meniscus {

/// Particles on the device, as the splat kernels take them.
struct SplatParticles {
  Buffer<float> values;  // [6][stride] depth t, u, v, ku, kv, scale
  int count = 0, stride = 0;
  double pixels = 0;  // that a particle's own radius spans, on average
};

/// Uploads the particles with the given indices (canonical order), none larger than `largest`
/// particle radii. Does not wait.
SplatParticles upload_splats(Device& device, const Projected& projected,
                             const std::vector<std::int32_t>& indices,
                             float largest = std::numeric_limits<float>::infinity());

/// Particles as the kernels draw them, and what each may cover.
struct Discs {
  Buffer<float> records;  // [stride][8], see visible.cl
  cl_float2 sphere;       // footprint; bulge over footprint
  Outlines outlines;
};

enum class Drawn : cl_int {
  front = records::FRONT,
  behind = records::BEHIND,
  every = records::EVERY
};

/// sphere: footprint, particle radii, and bulge over footprint. Does not wait.
Discs outline_discs(Device& device, const SplatParticles& particles, const SampleGrid& grid,
                    cl_float2 sphere, Drawn drawn);

/// The nearest sphere front at every node (paper 2.1): the minimum of t - bulge sqrt(1 - d^2).
///
///   footprint  radius of the spheres, in particle radii
///   bulge      depth of the cap over the footprint: 1 is a sphere, 1/2 half as deep
///
/// Returns [ny*nx] depths in particle radii, kNoSurface where nothing is. Waits.
Buffer<float> splat_depth(Device& device, const SplatParticles& particles, const SampleGrid& grid,
                          double footprint, double bulge = 1);

/// The particle whose front is nearest at every node, the lowest index where several are;
/// INT_MAX where there is none. Waits.
Buffer<cl_int> splat_owner(Device& device, const SplatParticles& particles, const SampleGrid& grid,
                           double footprint);

/// Fronts, as by splat_depth, written in occupied blocks.
struct Fronts {
  Buffer<float> depth;
  OccupiedBlocks occupied;
};

/// Drawn into maps: occupied by none, and where the device draws by minima the depth is
/// kNoSurface. Waits, but for atomic minima.
void splat_fronts(Device& device, const SplatParticles& particles, const SampleGrid& grid,
                  double footprint, double bulge, const Fronts& into);

/// From the nearest front to the farthest back of the spheres at every node.
struct Extent {
  Buffer<float> from;  // [ny*nx] particle radii, in occupied blocks; kNoSurface where nothing is
  Buffer<float> to;    // where `from` is finite
  OccupiedBlocks occupied;
};

/// `from` is written in the blocks that are `needed`, too. Drawn into maps: occupied by none,
/// and where the device draws by minima `from` is kNoSurface and `to` 0. Waits, but for atomic
/// minima.
void splat_extent(Device& device, const SplatParticles& particles, const SampleGrid& grid,
                  double footprint, const OccupiedBlocks& needed, const Extent& into);

/// The fronts of some and the extent of others, which is `radius` of their radii, drawn so that it
/// is written where there are fronts.
void splat_fronts_and_extent(Device& device, const SampleGrid& grid, const SplatParticles& seen,
                             double footprint, double bulge, const Fronts& fronts,
                             const SplatParticles& others, double radius, const Extent& extent);

/// The particles that are seen.
struct Visible {
  std::vector<std::int32_t> index;  // into Projected, ascending
  std::vector<float> owned;         // share of its footprint's nodes that it owns
  std::vector<float> influence;     // on its neighbours' fits, 0 .. 1; empty: 1 each

  float influence_of(std::size_t k) const { return influence.empty() ? 1 : influence[k]; }
};

/// Counts into `owned`, [candidates] or more, how many nodes of the grid that it returns each of
/// them owns. Does not wait where the device draws by minima. Throws DeviceError.
///
///   splats  the candidates on the device
SampleGrid count_owned(Device& device, const View& view, const Projected& projected,
                       const std::vector<std::int32_t>& candidates, const SplatParticles& splats,
                       const VisibleParams& params, const Buffer<cl_int>& owned);

/// The particles among `candidates` that own at least `least_owned` of their footprint, or of the
/// image where that is smaller.
///
///   grid    of count_owned(), which counted the nodes
///   counts  [candidates]
Visible visible_among(const Projected& projected, const std::vector<std::int32_t>& candidates,
                      const SampleGrid& grid, const cl_int* counts, const VisibleParams& params,
                      double least_owned);

/// Both. Waits. Throws DeviceError.
Visible find_visible(Device& device, const View& view, const Projected& projected,
                     const std::vector<std::int32_t>& candidates, const VisibleParams& params,
                     double least_owned);

}  // namespace meniscus
