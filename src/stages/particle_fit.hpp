// particle_fit: one quadric around every visible particle (paper 2.3 without 2.2's groups).
#pragma once

#include <array>
#include <vector>

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/triangulate.hpp"

namespace meniscus {

/// Share of its footprint from which a particle is fitted, and from which it counts in full; the
/// visible ones (VisibleParams::owned) lie between.
inline constexpr double kLeastFitted = 0.02, kFullyVisible = 0.10;

/// The fitted particles and their fits.
struct ParticleFits {
  std::vector<Vec3d> position;  // [n] eye space, particle radii
  std::vector<Vec3d> normal;    // [n] unit, outward
  std::vector<double> visible;  // [n] v: how far the particle counts as visible, (0, 1]
  std::vector<double> edge;     // [n] e: how far its surroundings are smooth, (0, 1]
  std::vector<Vec3d> foot;      // [n] the fit's surface near the particle, eye space
  std::vector<std::array<float, 10>> quadric;  // [n] as in Quadrics, around `position`
  std::vector<float> residual;  // [n] weighted RMS of f, particle radii; negative: no fit
  std::size_t size() const { return position.size(); }
};

/// The particles of `visible` that own at least `least_owned` of their footprint.
Visible more_visible(const Visible& visible, double least_owned);

/// The place in `visible` of each of `particles`, which are among them.
std::vector<std::int32_t> places_in(const Visible& visible,
                                    const std::vector<std::int32_t>& particles);

/// First normals of the fitted particles: area-weighted means of the kept triangles' (smoothed)
/// normals; without triangles the mean of the neighbours' within 4 radii, else towards the camera.
///
///   mesh     triangulation of some of the fitted particles
///   normals  [triangles] unit
///   seen     fitted particles, ascending; those of `mesh` among them
std::vector<Vec3d> first_normals(const View& view, const Projected& projected, const Visible& seen,
                                 const Triangulation& mesh, const std::vector<Vec3d>& normals);

/// Fits a quadric around every particle of `seen` in params.passes passes (kernels
/// weigh_neighbours, fit_groups, turn_normals), each with the normals and the one-sided robust
/// weights of the pass before. Waits. Throws DeviceError.
ParticleFits fit_particles(Device& device, const Projected& projected, const Visible& seen,
                           const std::vector<Vec3d>& normals, const FitParams& fit,
                           const StableParams& params);

}  // namespace meniscus
