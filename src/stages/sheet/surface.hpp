// surface: which particles stand for the fluid's surface, whether the camera sees them or not.
//
// Departs from the paper, which fits the visible particles alone (2.1, 2.3): on grazing and hidden
// slopes too few of them are seen, their normals come from slivers of triangles, and every step of
// the camera changes which they are. The density field's gradient gives the surface's particles and
// their normals from any direction (docs/method.md).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stages/frame/cells.hpp"
#include "stages/sheet/triangulate.hpp"

namespace meniscus {

/// Share of its footprint from which a particle is fitted, and from which it counts in full; the
/// visible ones (VisibleParams::owned) lie between.
inline constexpr double kLeastFitted = 0.02, kFullyVisible = 0.10;

/// Up to where hidden particles of the surface are fitted, from the nearest seen one, particle
/// radii; method groups, where ones further away change hardly anything and take time; and over how
/// much of it they fade (docs/method.md).
inline constexpr double kRimReach = 6, kRimReachGroups = 4.2, kRimFade = 0.5;

/// Particles of the surface with less u are not fitted unless they are seen.
inline constexpr double kLeastSurface = 0.5;

/// v = max(1e-4, smoothstep(kLeastFitted, kFullyVisible, owned)): particles fade in and out.
double visibility(double owned);

/// The particles of `visible` that own at least `least_owned` of their footprint.
Visible more_visible(const Visible& visible, double least_owned);

/// The place of each of `particles` in `index`, which holds them all; both are ascending.
std::vector<std::int32_t> places_in(const std::vector<std::int32_t>& index,
                                    const std::vector<std::int32_t>& particles);

/// From which vertices seen particles have their first normals, and how much each counts.
struct NormalSources {
  std::vector<std::int32_t> particle;  // [n] places in Visible
  std::vector<std::int32_t> start;     // [n + 1] where each one's vertices begin
  std::vector<std::int32_t> vertex;    // those with kept triangles: its own, else those within 4
  std::vector<double> share;           //   particle radii, each of which counts 1 - distance / 4
};

///   mesh      triangulation of some of the seen particles
///   seen      ascending; the particles of `mesh` among them
///   particle  places in `seen`
NormalSources normal_sources(const Projected& projected, const Visible& seen,
                             const Triangulation& mesh, std::vector<std::int32_t> particle);

/// First normals of some seen particles, others' are 0: area-weighted means of the kept triangles'
/// (smoothed) normals; without triangles the mean of the neighbours', else towards the camera.
///
///   normals  [triangles] unit; those around the sources count
std::vector<Vec3d> first_normals(const View& view, const Projected& projected, const Visible& seen,
                                 const Triangulation& mesh, const std::vector<Vec3d>& normals,
                                 const NormalSources& sources);

/// The particles that stand for the surface, and how far each does.
struct SurfaceParticles {
  std::vector<std::int32_t> index;  // [n] places in Projected, ascending
  std::vector<double> weight;       // [n] u, (0, 1]
  std::vector<Vec3d> normal;        // [n] unit, outward
};

/// The same before the normals of the seen ones are known.
struct FieldSurface {
  std::vector<std::int32_t> index;  // [n] places in Projected, ascending
  std::vector<double> weight;       // [n] u, (0, 1]
  std::vector<Vec3d> descent;       // [n] - grad C, 1 / particle radii
};

/// All particles on the surface: with the density C and its gradient at the particle, in s,
///   u = smoothstep(.22, .42, hypot(|grad C|, 1.5 max(0, .97 - C))),
/// for a disorder of 1 (relax.hpp) smoothstep(.3, .5), for one of 2 smoothstep(.38, .58), because
/// the field of irregular particles has steeper slopes inside, 0 inside the fluid, 1 on a face
/// (|grad C| = .51, C = .85) and in a single layer (0, .70). Hidden particles with u below .01, or
/// whose normal the field does not give (|grad C| below .1), are left out.
///
///   cells      of all projected particles, side kDensitySupport
///   gradients  [4][n] of measure_gradients over these cells
FieldSurface find_surface(const Visible& seen, const Cells& cells, std::span<const float> gradients,
                          double disorder = 0);

/// The places of the seen particles whose normal in the triangulation with_normals looks at.
std::vector<std::int32_t> without_descent(const Visible& seen, const FieldSurface& surface);

/// Gives them normals: the descent of C, where that is flat (.15 .. .35) and the particle is seen
/// its normal in the triangulation.
///
///   normals  [seen] first_normals of those without_descent
SurfaceParticles with_normals(FieldSurface surface, const Visible& seen,
                              const std::vector<Vec3d>& normals);

/// The particles to fit: the seen ones and, with an owned share of 0, those of the surface (u at
/// least 1/2) within `reach` particle radii of one, which show where the fluid turns away from the
/// camera. A hidden one comes in as soon as one near it is seen, so its influence on its neighbours
/// (Visible::influence) fades:
///   max over the seen ones of smoothstep(kLeastFitted, kFullyVisible, owned)
///                           * (1 - smoothstep(reach - kRimFade, reach, distance)).
Visible with_rim(const Projected& projected, const Visible& seen, const FieldSurface& surface,
                 double reach = kRimReach);

}  // namespace meniscus
