// The steps that closed surfaces share, whether all of the fluid is at hand (closed.cpp) or a part
// of it at a time (closed_parts.cpp).
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "device/device.hpp"
#include "device/stage_clock.hpp"
#include "meniscus/parameters.hpp"
#include "meniscus/types.hpp"
#include "methods/placed_fluid.hpp"
#include "stages/closed/dual_mesh.hpp"
#include "stages/closed/implicit.hpp"
#include "stages/fit/particle_fit.hpp"
#include "stages/frame/cells.hpp"
#include "stages/frame/density.hpp"
#include "stages/frame/project.hpp"
#include "stages/frame/relax.hpp"

namespace meniscus {

/// See drop_crumbs(); in the unit of length, cubed. A lone particle is drawn as 4.2; a particle
/// takes 8. Among particles anywhere there are gaps as large as several.
inline constexpr double kLeastFluid = 1;
inline double least_air(const Disorder& disorder) { return between(8, 128, disorder.anywhere()); }

/// Corners of cells of side `cell` are evaluated this near to particles that see air, particle
/// radii; the surface is one radius outside them, and wherever else it goes more corners are added.
double band_of(double cell);

/// The density field of particles.
struct FluidField {
  DeviceCells cells, levelled;
  Buffer<float> gradients;  // measure_gradients() over the cells, near air
};

/// Its level is that of the fluid's disorder. Does not wait.
FluidField measure_field(Device& device, const PlacedFluid& fluid, const RegionParams& params);

/// Which particles are fitted, and what is known of a whole frame of which these are a part; by
/// default they are all there are.
struct FitScope {
  std::function<bool(const Vec3d&position)> tried, fitted;  // whose roundness is measured; who is
                                                            // fitted; none: all of the surface
  std::optional<double> noise;  // see make_fits(); given: FittedFluid::rough is wanted
  double reach = 1;             // of the frame's fits, see make_implicit()
};

/// The fluid as a function of space.
struct FittedFluid {
  ImplicitFunction function;
  Points seeds;  // particles that see air
  ParticleFits fits;
  std::vector<float> rough;  // [fits] residuals before the last pass, where FitScope asks for them
  std::vector<float> reach;  // [fits] 0: the fit does not count
};

/// The first steps of a closed surface (section 2.1 to 2.3 of the paper): field, surface, fits and
/// their trust; of the fluid with_voids().
FittedFluid fit_fluid(Device& device, const PlacedFluid& placed, const Parameters& params,
                      StageClock& clock, const FitScope& scope = {});

/// The last steps (2.4, 2.5): where the edges of a closed grid cross the surface, and the mesh of
/// those that begin in `within`.
DualMesh mesh_grid(Device& device, const ImplicitFunction& function, const SpaceGrid& grid,
                   StageClock& clock, const CornerBox& within = {});

/// A mesh from eye space into the world, without what particles carry.
Mesh to_world(const View& view, DualMesh made);

}  // namespace meniscus
