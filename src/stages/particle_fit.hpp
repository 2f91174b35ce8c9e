// particle_fit: one quadric around every fitted particle (paper 2.3). The group of a fit is the
// surface around its particle with similar normals, as far as one quadric can follow it.
#pragma once

#include <array>
#include <vector>

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/surface.hpp"

namespace meniscus {

/// The fitted particles and their fits.
struct ParticleFits {
  std::vector<Vec3d> position;  // [n] eye space, particle radii
  std::vector<Vec3d> normal;    // [n] unit, outward
  std::vector<double> visible;  // [n] v: how far the particle counts as visible, (0, 1]
  std::vector<double> surface;  // [n] u: how far the particle is one of the surface, (0, 1]
  std::vector<double> support;  // [n] rho, particle radii
  std::vector<double> edge;     // [n] e: how far its surroundings are smooth, (0, 1]
  std::vector<double> firmness;  // [n] as e, within a narrower angle: for its trust, (0, 1]
  std::vector<double> spread;   // [n] RMS distance of the surroundings from the fit, particle radii
  std::vector<double> supporters;  // [n] neighbours within the full support, each by its u
  std::vector<Vec3d> foot;         // [n] the fit's surface near the particle, eye space
  std::vector<std::array<float, 10>> quadric;  // [n] as in Quadrics, around `position`
  std::vector<float> residual;  // [n] weighted RMS of f, particle radii; negative: no fit
  std::size_t size() const { return position.size(); }
};

/// What the kernels read of each particle of the surface, and of nobody behind the last, whose u
/// is 0.
struct FitRecords {
  std::vector<float> place;   // [n + 1][4] eye space, particle radii; u
  std::vector<float> normal;  // [n + 1][4] unit; a value that is not used
};
FitRecords fit_records(const Projected& projected, const SurfaceParticles& around);

/// The neighbours of fits, as kernel fit_particles takes them: fits in batches of 16 lanes,
/// those with about as many neighbours together. Neighbour k of lane l is in slot first[l / 16] + l
/// % 16 + 16 k.
struct FitLists {
  std::vector<std::int32_t> fit;      // [lanes] -1: the lane is not in use
  std::vector<cl_int> particle;       // [lanes] the fit's place in the surface, else nobody's
  std::vector<cl_int> first, length;  // [batches] first slot; slots a lane
  std::vector<cl_int> neighbour;      // [slots] places in the surface; nobody's: not in use
};

/// Lists of all particles of `around` within `reach` of each of `centre`, one or several where that
/// makes more than `most_slots` slots.
std::vector<FitLists> list_neighbours(const Projected& projected,
                                      const std::vector<std::int32_t>& centre,
                                      const std::vector<std::int32_t>& around, double reach,
                                      std::size_t most_slots);

/// Lists of neighbours on the device, and the fits of their lanes.
struct FitNeighbours {
  struct Part {
    FitLists lists;  // but for the neighbours
    Buffer<cl_int> particle, neighbour, first, length;
  };
  std::vector<Part> parts;
};

/// What fit_particles needs of places alone: the neighbours within params.support of each of
/// `centre` among the surface's particles `around`. Waits. Throws DeviceError.
FitNeighbours find_neighbours(Device& device, const Projected& projected,
                              const std::vector<std::int32_t>& centre,
                              const std::vector<std::int32_t>& around, const FitParams& params);

/// Fits a quadric around every particle of `seen` to the surface around it in params.passes passes
/// (kernel fit_particles), each with the normals and the one-sided robust weights of the pass
/// before. The last pass narrows the support where one quadric cannot follow the surface:
///
///   rho = support min(1, max(least_support, (max(.14, 1.5 r_05) / r)^2))
///
/// with r the mean residual of the fits on the same sheet within six radii, particle radii, and
/// r_05 the 5th percentile of all residuals, which noise alone explains.
///
///   seen        particles to fit, ascending
///   around      the surface, `seen` among it
///   neighbours  of `seen` around
///
/// Waits. Throws DeviceError.
ParticleFits fit_particles(Device& device, const Projected& projected, const Visible& seen,
                           const SurfaceParticles& around, const FitNeighbours& neighbours,
                           const FitParams& params);

/// The same, with a search for the neighbours.
inline ParticleFits fit_particles(Device& device, const Projected& projected, const Visible& seen,
                                  const SurfaceParticles& around, const FitParams& params) {
  return fit_particles(device, projected, seen, around,
                       find_neighbours(device, projected, seen.index, around.index, params),
                       params);
}

}  // namespace meniscus
