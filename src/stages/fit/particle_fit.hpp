// particle_fit: one quadric around every fitted particle (paper 2.3). The group of a fit is the
// surface around its particle with similar normals, as far as one quadric can follow it.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "device/device.hpp"
#include "device/records.hpp"
#include "device/together.hpp"
#include "meniscus/parameters.hpp"
#include "stages/fit/neighbours.hpp"
#include "stages/sheet/sheet.hpp"
#include "stages/sheet/surface.hpp"

namespace meniscus {

/// The fitted particles and their fits.
struct ParticleFits {
  std::vector<Vec3d> position;    // [n] eye space, particle radii
  std::vector<Vec3d> normal;      // [n] unit, outward
  std::vector<double> visible;    // [n] v: how far the particle counts as visible, (0, 1]
  std::vector<double> surface;    // [n] u: how far the particle is one of the surface, (0, 1]
  std::vector<double> support;    // [n] rho, particle radii
  std::vector<double> roundness;  // [n] 0: between two sheets .. 1: one quadric, see roundness.hpp
  std::vector<double> edge;       // [n] e: how far its surroundings are smooth, (0, 1]
  std::vector<double> firmness;   // [n] as e, within a narrower angle: for its trust, (0, 1]
  std::vector<double> spread;  // [n] RMS distance of the surroundings from the fit, particle radii
  std::vector<double>
      supporters;  // [n] neighbours within fit_reach(), each by its u, over its share squared
  // [n] what trust follows from, see measure_surroundings(): densities at the feet and behind them,
  // spread; empty: not measured.
  std::vector<float> dense, deep, apart;
  std::vector<Vec3d> foot;                     // [n] the fit's surface near the particle, eye space
  std::vector<std::array<float, 10>> quadric;  // [n] as in Quadrics, around `position`
  std::vector<float> residual;  // [n] weighted RMS of f, particle radii; negative: no fit
  std::vector<double> extent;   // [n] of the group, particle radii; empty: particles alone
  std::size_t size() const { return position.size(); }
};

/// A quadric's value and gradient.
struct QuadricLevel {
  double value;
  Vec3d gradient;
};
/// At a place, from where the quadric is around. With its second derivatives, which are the same
/// everywhere, the quadric around that place.
QuadricLevel level_at(const std::array<float, 10>& quadric, const Vec3d& place);

/// Within which neighbours weigh in a fit, particle radii.
inline double fit_reach(const FitParams& params) { return records::kFitReach * params.support; }

/// What residual noise alone explains, particle radii, from the residuals of all fits of a
/// frame before the last pass; those that are not above 0 do not count: 1.5 times their 5th
/// percentile, at least .14. Kernel find_noise does the same.
double noise_of(std::vector<float> residual);
inline constexpr double kLeastNoise = 0.14;

/// How far a fit's edge e looks (kernel measure_edges), particle radii.
inline constexpr float kEdgeReach = 4;

/// How far behind fits' feet the density is measured, too (trust.hpp), particle radii.
inline constexpr float kDeep = 3;

/// What fits have where one quadric explains the surroundings (roundness 1), where FitParams says
/// it for roundness 0.
inline constexpr double kRoundSigma = 1.2;  // normal difference that a fit crosses, unitless
inline constexpr double kRoundTau = 0.6;    // one-sided robust scale, particle radii
inline constexpr double kRoundOffSurface =
    1.25;                                    // distance of the off-surface rows, radii, at most
inline constexpr double kRoundRidge = 5e-5;  // on the quadratic terms, at most: bends need them

/// Trial fits of a particle (roundness.hpp).
inline constexpr int kTrials = 2;

/// What the kernels read of each particle of the surface, and of nobody behind the last, whose u
/// is 0.
struct FitSurface {
  Buffer<float> place;   // [n + 1][4] eye space, particle radii; u
  Buffer<float> normal;  // [n + 1][4] unit; roundness, 0
  Buffer<float> turned;  // as `normal`; passes turn the normals of those that are fitted
  Buffer<float> tried;   // the same of each trial
  cl_int nobody = 0;
};

/// Copies them. Roundness may be given of each particle; else it is 0 until measure_roundness()
/// tells.
FitSurface upload_surface(Device& device, const Projected& projected,
                          const SurfaceParticles& around, const std::vector<float>& roundness = {});

/// Values that trust follows from (trust.hpp).
inline constexpr std::size_t kSurroundings = 3;

/// The fits of one part's lanes on the device, in one or several trials that are made together.
struct FitLanes {
  /// `means`: how many values are read with what is found.
  FitLanes(Device& device, const FitNeighbours::Part& of, int trials = 1, std::size_t means = 0);
  int count() const { return static_cast<int>(part->lists.fit.size()); }

  const FitNeighbours::Part* part;
  int trials;
  Buffer<float> support;  // [trials][3][lanes] rho, particle radii; roundness; firmness
  Together<float, float, float, float> found;  // the next four, to be read by one command
  Buffer<float> quadric;                       // [trials][10][lanes] through the particles
  Buffer<float> residual;                      // [trials][lanes] particle radii; negative: no fit
  Buffer<float> rows;                          // [FIT_ROWS][lanes] what is measured
  Buffer<float> mean;                          // [means]
  Buffer<float> weight;                        // [slots] of the last pass
};

/// Which of how many passes is made.
struct FitPass {
  int done, left;       // passes before and after it
  bool groups = false;  // fits of groups: not firm; e and firmness times the influence of each
  Buffer<float>
      noise{};  // [1] what supports are narrowed by, with the sheet's means; empty: are not
};

/// What kernels measure of the fits of lanes, in a sheet in which it is averaged. One command reads
/// it: normals [3][n], shares [n], values and their means [values][n], all in bucket order. Values
/// are one or three.
struct LaneSheet {
  LaneSheet(Device& device, const LaneCells& cells, int values);
  int fits() const { return static_cast<int>(cells->host.item.size()); }

  const LaneCells* cells;
  Together<float, float, float, float> found;
};

/// The part of a sheet's fits that some lanes have, as kernels take it.
struct InSheet {
  const Buffer<cl_int>& to;
  const Buffer<float>&toward, &share, &value;
};
InSheet part_in_sheet(const LaneSheet& sheet, std::size_t part);

/// Averages the values over the sheet around each fit (average_sheet()), weights.reach being
/// kResidualReach at most. Does not wait.
void average_lanes(Device& device, const LaneSheet& sheet, const SheetWeights& weights);

/// One pass over a part's lanes (kernel fit_particles), in several trials side by side if they are
/// trial fits: from the normals `from` to `turned`. The last but one puts the residuals into the
/// sheet. Enqueues.
void fit_lanes(Device& device, const FitSurface& surface, const FitLanes& lanes,
               const LaneSheet& sheet, std::size_t part, const Buffer<float>& from,
               const Buffer<float>& turned, const FitPass& pass, const FitParams& params);

/// The range of kernels that take a fit a lane: few items of much work.
Range range_of_lanes(Device& device, const FitLanes& lanes);

/// The same for each trial.
Range range_of_trials(Device& device, const FitLanes& lanes);

/// Fits that the device has, or will have made.
struct DeviceFits {
  std::vector<FitLanes> parts;
  FitSurface surface;
  const FitNeighbours* neighbours = nullptr;
  Buffer<float> rough;              // residuals before the last pass, [fits] in bucket order;
                                    // empty: no supports are narrowed by them
  std::optional<LaneSheet> around;  // what their trust follows from, but for the densities
  Buffer<float> feet;               // [3][2 fits] where these are measured
  double offset = 0;                // FitParams::offset
  bool knows_surroundings = false;  // whether the first part's means are what trust follows from
  ParticleFits known;               // what the host knows of the fits before it has them
};

/// Fits a quadric around every particle of `seen` to the surface around it in params.passes passes
/// (kernel fit_particles), each with the normals and the one-sided robust weights of the pass
/// before. The last pass narrows the support where one quadric cannot follow the surface:
///
///   rho = support min(1, max(least_support, (max(.14, 1.5 r_05) / r)^2))
///
/// with r the mean residual of the fits on the same sheet within six radii by their influence
/// (Visible::influence), particle radii, and r_05 the 5th percentile of all residuals, which noise
/// alone explains.
///
///   seen        particles to fit, ascending
///   around      the surface, `seen` among it
///   surface     `around`, with how far one quadric explains each one's surroundings
///               (roundness.hpp), 0 .. 1: it takes sigma, tau, support, off-surface distance and
///               ridge to kRound...
///   neighbours  of `seen` within fit_reach(params); they outlive the fits
///   extent      [seen] as in MergedGroups, where the fits are those of groups: each counts as far
///               as its group is one of its own, and reaches as far as its members lie; 0: a
///               particle alone, fitted as groups are; else empty
///   noise       what noise explains, where more fits than these are known; else noise_of() these
///
/// Does not wait. Throws DeviceError.
DeviceFits make_fits(Device& device, const FitSurface& surface, const Projected& projected,
                     const Visible& seen, const SurfaceParticles& around,
                     const FitNeighbours& neighbours, const FitParams& params,
                     const std::vector<double>& extent = {}, std::optional<double> noise = {});

/// Their residuals before the last pass, [fits], as noise_of() takes them; 0 where no supports are
/// narrowed by them. Waits.
std::vector<float> rough_residuals(Device& device, const DeviceFits& fits);

/// The fits themselves. Waits.
ParticleFits download(Device& device, DeviceFits fits);

/// Makes fits with a search for the neighbours, of a given roundness [around]; empty: all of them
/// between sheets (0). Waits. Throws DeviceError.
inline ParticleFits fit_particles(Device& device, const Projected& projected, const Visible& seen,
                                  const SurfaceParticles& around, const FitParams& params,
                                  const std::vector<float>& roundness = {}) {
  const FitNeighbours neighbours =
      find_neighbours(device, projected, seen, around.index, fit_reach(params));
  return download(device, make_fits(device, upload_surface(device, projected, around, roundness),
                                    projected, seen, around, neighbours, params));
}

}  // namespace meniscus
