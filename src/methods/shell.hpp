// What the fits of a frame are made from: the fluid in view, the particles that are seen, and the
// shell around them (paper 2.1 and 2.2).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "device/stage_clock.hpp"
#include "device/together.hpp"
#include "methods/extraction.hpp"
#include "methods/placed_fluid.hpp"
#include "stages/fit/neighbours.hpp"
#include "stages/fit/roundness.hpp"
#include "stages/frame/density.hpp"
#include "stages/frame/near_lists.hpp"
#include "stages/frame/splash.hpp"
#include "stages/frame/visible.hpp"
#include "stages/sheet/surface.hpp"
#include "stages/sheet/triangulate.hpp"

namespace meniscus {

/// What every step of a frame of `fit`, `groups` and `stable` is given.
struct FitFrame {
  Device& device;
  const View& view;
  const Parameters& params;
  StageClock& clock;
};

/// The particles in view; their density field; which of them are splash.
struct Fluid : PlacedFluid {
  DeviceCells cells{}, levelled{};
  // The field at the particles (level_cells()), and how many nodes each of the body owns
  // (count_owned()).
  Together<float, cl_int> measured{};
  SplashSplit split{};
  SplatParticles body{};
};

/// Places the particles in view and begins to measure their field, which the device goes on with.
Fluid measure_fluid(const FitFrame& frame, const WorldParticles& particles);

/// What was measured of a fluid, on the host: the device gets no work while this lives.
using FluidView = ViewTogether<float, cl_int>;

/// The seen particles, and the fluid's field with them, by one command. Waits.
Visible look_at(const FitFrame& frame, const Fluid& fluid, std::optional<FluidView>& view);

/// The seen particles and those that stand for the surface around them, seen or not.
struct Shell {
  SeenMesh triangulated;
  FieldSurface found;
  Visible rim;           // the particles that are fitted, or merge first
  TrialPlaces trials;    // of the rim, for its roundness
  NearLists near;        // who is near, on the host, where particles merge
  FitNeighbours fitted;  // of the rim, where each of its particles is fitted
  SplatParticles splash;
  double least_radius = 0;  // of a particle on the screen, pixels
};

/// The places that get a quadric each, and what is known of them.
struct Seeds {
  Visible places;
  FitNeighbours neighbours;
  std::vector<double> extent;  // [places] of groups (merge.hpp); else empty
};

/// How a method chooses its seeds: what it looks for while the triangulation keeps the other
/// processor busy, and the rest.
struct Seeding {
  std::int64_t Counts::*counted;                   // what its fits count as
  double rim_reach;                                // see with_rim(), particle radii
  bool merges;                                     // whether Shell::near is wanted
  double (*near_reach)(const Parameters& params);  // of Shell::near, at least kTrialReach
  FitNeighbours (*look_ahead)(const FitFrame& frame, const Fluid& fluid, const Shell& shell);
  Seeds (*choose)(const FitFrame& frame, const Fluid& fluid, Shell& shell,
                  const SurfaceParticles& around);
};

/// Triangles keep some processors busy; meanwhile the surface's particles and their neighbours are
/// found. That side alone has the device.
Shell find_shell(const FitFrame& frame, const Fluid& fluid, const Visible& seen,
                 std::optional<FluidView>& measured, const Seeding& seeding);

/// The particles that stand for the surface with their normals: the field's, or the triangulation's
/// where that is flat (paper 2.2, step 3).
SurfaceParticles orient(const FitFrame& frame, const Fluid& fluid, const Visible& seen,
                        Shell& shell);

}  // namespace meniscus
