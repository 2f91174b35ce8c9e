#include "stages/fit/particle_fit.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/parallel.hpp"
#include "device/kernels.hpp"
#include "device/together.hpp"

namespace meniscus {
namespace {

constexpr float kHeight = 0.6f;          // h_0 of fit_particles, particle radii
constexpr float kHeightGrowth = 0.075f;  // h_1, 1 / particle radii

// Of firm fits. Their gradient follows bends, so that their sigma can be narrower by so much:
// beside a crease of 60 degrees it leaves out the particles in it. By 8 degrees noise alone turns
// normals. Particles of the other sheet lie in front.
constexpr double kFirmer = 0.29;
constexpr float kFirmLeeway = 0.01f;
constexpr float kFirmAhead = 0.5f;

// Where supports are narrowed: what residual noise alone explains against the frame's least, and
// over which fits residuals are averaged.
constexpr float kOverLeast = 1.5f;
constexpr std::size_t kNoiseItems = records::TILE * records::TILE;  // TILE_ITEMS in prelude.cl
constexpr SheetWeights kSheet{kResidualReach, 0.8f, 0.95f};

constexpr std::size_t kRecord = 4;  // values of a particle's records, see neighbours.cl
// What fits have of their roundness, see falloff_of in neighbours.cl.
records::FitModel model_of(const FitParams& params) {
  const auto gain = [](double round, double flat) { return static_cast<float>(round - flat); };
  return {static_cast<float>(params.normal_sigma),
          static_cast<float>(params.tau),
          static_cast<float>(params.off_surface),
          static_cast<float>(params.ridge),
          gain(std::max(params.normal_sigma, kRoundSigma), params.normal_sigma),
          gain(std::max(params.tau, kRoundTau), params.tau),
          gain(std::min(params.off_surface, kRoundOffSurface), params.off_surface),
          gain(std::min(params.ridge, kRoundRidge), params.ridge)};
}

// How many times more of 2 / sigma^2 a firm fit has.
float sharpness_of(const FitParams& params) {
  const double firm = std::max(params.normal_sigma - kFirmer, 0.1 * params.normal_sigma);
  return static_cast<float>(std::pow(params.normal_sigma / firm, 2) - 1);
}

records::FitPass pass_of(const FitSurface& surface, const FitLanes& lanes, const LaneSheet& sheet,
                         const FitPass& pass, const FitParams& params) {
  return {lanes.count(),
          surface.nobody,
          sheet.fits(),
          pass.done,
          pass.left,
          pass.groups,
          lanes.trials > 1,
          pass.noise.size > 0,
          static_cast<float>(params.support),
          static_cast<float>(std::min(params.round_support, params.support) - params.support),
          static_cast<float>(params.least_support),
          model_of(params),
          kEdgeReach,
          sharpness_of(params),
          kFirmLeeway,
          kFirmAhead,
          kHeight,
          kHeightGrowth};
}

// Writes the records of the surface's particles and of nobody, those of normals to several places.
// A roundness that is empty is 0.
void write_records(const Projected& projected, const SurfaceParticles& around,
                   const std::vector<float>& roundness, float* places,
                   const std::vector<float*>& normals) {
  const std::size_t n = around.index.size();
  constexpr std::size_t kGrain = 2048;  // particles that are worth a thread
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t i = static_cast<std::size_t>(around.index[k]);
      float* const place = places + kRecord * k;
      place[0] = projected.x[i];
      place[1] = projected.y[i];
      place[2] = projected.z[i];
      place[3] = static_cast<float>(around.weight[k]);
      for (float* const all : normals) {
        float* const normal = all + kRecord * k;
        normal[0] = static_cast<float>(around.normal[k].x);
        normal[1] = static_cast<float>(around.normal[k].y);
        normal[2] = static_cast<float>(around.normal[k].z);
        normal[3] = roundness.empty() ? 0 : roundness[k];
      }
    }
  });
  std::fill_n(places + kRecord * n, kRecord, 0.0f);
  for (float* const all : normals) std::fill_n(all + kRecord * n, kRecord, 0.0f);
}

// What noise explains of the residuals in a sheet, [1].
Buffer<float> noise_of(Device& device, const LaneSheet& sheet, std::optional<double> known) {
  if (known) return upload(device, std::vector<float>{static_cast<float>(*known)});
  const auto noise = allocate<float>(device, 1);
  const int width = device.state().wide_width();
  const std::size_t items = width == 1 ? kNoiseItems : 1;
  launch(device, kernels::find_noise, width, {items, 1, items, 1}, sheet.found.part<2>(), noise,
         records::Noise{sheet.fits(), static_cast<float>(kLeastNoise), kOverLeast});
  return noise;
}

// Room for the fits of the seen particles, with what is known of them without a fit.
ParticleFits unfitted(const Projected& projected, const Visible& seen,
                      const SurfaceParticles& around) {
  const std::size_t count = seen.index.size();
  const std::vector<std::int32_t> place = places_in(around.index, seen.index);
  ParticleFits fits;
  fits.position.reserve(count);
  for (const std::int32_t i : seen.index)
    fits.position.push_back(projected.eye(static_cast<std::size_t>(i)));
  for (std::size_t k = 0; k < count; ++k) {
    fits.visible.push_back(visibility(seen.owned[k]));
    fits.surface.push_back(around.weight[static_cast<std::size_t>(place[k])]);
  }
  fits.foot = fits.position;
  for (std::vector<double>* values :
       {&fits.edge, &fits.firmness, &fits.spread, &fits.supporters, &fits.support, &fits.roundness})
    values->resize(count);
  fits.residual.resize(count);
  fits.normal.resize(count);
  fits.quadric.resize(count);
  return fits;
}

// Takes what the device found of the fits of a part.
void take_fits(const FitLanes& part, const ViewTogether<float, float, float, float>& found,
               double offset, ParticleFits& fits) {
  const std::size_t lanes = static_cast<std::size_t>(part.count());
  const float *const c = found.data<0>(), *const residual = found.data<1>(),
                     *const row = found.data<2>();
  constexpr double kShare = double{records::kFitReach} * records::kFitReach;
  constexpr std::size_t kGrain = 1024;  // lanes that are worth a thread
  parallel_for(lanes, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t l = begin; l < end; ++l) {
      const std::int32_t fit = part.part->lists.fit[l];
      if (fit < 0) continue;
      const std::size_t k = static_cast<std::size_t>(fit);
      fits.residual[k] = residual[l];
      const auto measured = [&](std::size_t which) { return row[which * lanes + l]; };
      fits.edge[k] = measured(records::EDGE_ROW);
      fits.firmness[k] = measured(records::FIRMNESS_ROW);
      fits.spread[k] = measured(records::SPREAD_ROW);
      fits.supporters[k] = measured(records::SUPPORTERS_ROW) / kShare;
      fits.normal[k] = {measured(records::NORMAL_ROW), measured(records::NORMAL_ROW + 1),
                        measured(records::NORMAL_ROW + 2)};
      fits.support[k] = measured(records::SUPPORT_ROW);
      fits.roundness[k] = measured(records::ROUNDNESS_ROW);
      std::array<float, 10>& quadric = fits.quadric[k];
      for (std::size_t r = 0; r < 10; ++r) quadric[r] = c[r * lanes + l];
      if (fits.residual[k] < 0) continue;
      const double behind = std::clamp(-double{quadric[0]}, -1.0, 1.0);
      fits.foot[k] += fits.normal[k] * (offset + behind);
      quadric[0] -= static_cast<float>(offset);
    }
  });
}

}  // namespace

QuadricLevel level_at(const std::array<float, 10>& c, const Vec3d& x) {
  const Vec3d gradient{c[1] + 2 * c[4] * x.x + c[7] * x.y + c[9] * x.z,
                       c[2] + 2 * c[5] * x.y + c[7] * x.x + c[8] * x.z,
                       c[3] + 2 * c[6] * x.z + c[8] * x.y + c[9] * x.x};
  return {c[0] + dot(gradient + Vec3d{c[1], c[2], c[3]}, x) / 2, gradient};
}

double noise_of(std::vector<float> residual) {
  std::erase_if(residual, [](float value) { return !(value > 0); });
  if (residual.empty()) return kLeastNoise;
  const auto least = residual.begin() + static_cast<std::ptrdiff_t>(residual.size() / 20);
  std::nth_element(residual.begin(), least, residual.end());
  return std::max(double{kOverLeast} * *least, kLeastNoise);
}

FitSurface upload_surface(Device& device, const Projected& projected,
                          const SurfaceParticles& around, const std::vector<float>& roundness) {
  const std::size_t values = kRecord * (around.index.size() + 1);
  UploadTogether<float, float, float, float> records(device,
                                                     {values, values, values, kTrials * values});
  std::vector<float*> normals{records.data<1>(), records.data<2>()};
  for (std::size_t trial = 0; trial < kTrials; ++trial)
    normals.push_back(records.data<3>() + trial * values);
  write_records(projected, around, roundness, records.data<0>(), normals);
  const auto [place, normal, turned, tried] = records.done();
  return {place, normal, turned, tried, static_cast<cl_int>(around.index.size())};
}

FitLanes::FitLanes(Device& device, const FitNeighbours::Part& of, int in_trials, std::size_t means)
    : part(&of),
      trials(in_trials),
      support(allocate<float>(device, 3 * static_cast<std::size_t>(trials) * of.lists.fit.size())),
      found(device, {10 * static_cast<std::size_t>(trials) * of.lists.fit.size(),
                     static_cast<std::size_t>(trials) * of.lists.fit.size(),
                     records::FIT_ROWS * of.lists.fit.size(), means}),
      quadric(found.part<0>()),
      residual(found.part<1>()),
      rows(found.part<2>()),
      mean(found.part<3>()),
      weight(allocate<float>(device, of.neighbour.size)) {}

Range range_of_lanes(Device& device, const FitLanes& lanes) {
  // Small work-groups spread few items of much work over the compute units. A CPU's compiler keeps
  // what one item computes in registers, and not what a group does.
  const auto width = static_cast<std::size_t>(device.state().wide_width());
  const std::size_t group = width == 1 ? 8 : 1;
  return {static_cast<std::size_t>(lanes.count()) / width, 1, group, 1};
}

Range range_of_trials(Device& device, const FitLanes& lanes) {
  Range range = range_of_lanes(device, lanes);
  range.ny = static_cast<std::size_t>(lanes.trials);
  return range;
}

void fit_lanes(Device& device, const FitSurface& surface, const FitLanes& lanes,
               const LaneSheet& sheet, std::size_t part, const Buffer<float>& from,
               const Buffer<float>& turned, const FitPass& pass, const FitParams& params) {
  struct Narrowed {
    const Buffer<float>&mean, &noise;
  };
  const Buffer<float>& mean = sheet.found.part<3>();
  launch(device, kernels::fit_particles, device.state().wide_width(),
         range_of_trials(device, lanes), surface.place, from, *lanes.part, lanes, turned,
         part_in_sheet(sheet, part), Narrowed{mean, pass.noise.size > 0 ? pass.noise : mean},
         pass_of(surface, lanes, sheet, pass, params));
}

LaneSheet::LaneSheet(Device& device, const LaneCells& of, int values)
    : cells(&of), found(device, [&]() -> std::array<std::size_t, 4> {
        const std::size_t n = of.host.item.size(), rows = static_cast<std::size_t>(values);
        return {3 * n, n, rows * n, rows * n};
      }()) {}

InSheet part_in_sheet(const LaneSheet& sheet, std::size_t part) {
  const auto& [toward, share, value, mean] = sheet.found.parts;
  return {sheet.cells->to[part], toward, share, value};
}

void average_lanes(Device& device, const LaneSheet& sheet, const SheetWeights& weights) {
  const auto& [toward, share, value, mean] = sheet.found.parts;
  average_sheet(device, {sheet.cells->cells, toward, share, value}, weights, mean);
}

DeviceFits make_fits(Device& device, const FitSurface& surface, const Projected& projected,
                     const Visible& seen, const SurfaceParticles& around,
                     const FitNeighbours& neighbours, const FitParams& params,
                     const std::vector<double>& extent, std::optional<double> noise) {
  DeviceFits fits;
  fits.neighbours = &neighbours;
  fits.offset = params.offset;
  if (seen.index.empty()) return fits;
  fits.surface = surface;
  Buffer<float>&normals = fits.surface.normal, &turned = fits.surface.turned;
  std::size_t means = kSurroundings * seen.index.size();
  for (const FitNeighbours::Part& part : neighbours.parts)
    fits.parts.emplace_back(device, part, 1, std::exchange(means, 0));
  const LaneSheet sheet(device, neighbours.sheet, 1);
  for (int pass = 0; pass < params.passes; ++pass) {
    FitPass now{pass, params.passes - 1 - pass, !extent.empty()};
    if (pass > 0 && now.left == 0 && params.least_support < 1) {
      average_lanes(device, sheet, kSheet);
      now.noise = noise_of(device, sheet, noise);
      fits.rough = sheet.found.part<2>();
    }
    for (std::size_t part = 0; part < fits.parts.size(); ++part)
      fit_lanes(device, fits.surface, fits.parts[part], sheet, part, normals, turned, now, params);
    std::swap(normals, turned);
    // While the device is at the first pass.
    if (pass == 0) fits.known = unfitted(projected, seen, around);
  }
  fits.around.emplace(device, neighbours.sheet, static_cast<int>(kSurroundings));
  fits.feet = allocate<float>(device, 6 * seen.index.size());
  for (std::size_t part = 0; part < fits.parts.size(); ++part) {
    const FitLanes& lanes = fits.parts[part];
    launch(device, kernels::measure_edges, device.state().wide_width(),
           range_of_lanes(device, lanes), fits.surface.place, normals, *lanes.part, lanes,
           part_in_sheet(*fits.around, part), fits.feet,
           pass_of(fits.surface, lanes, sheet, {params.passes, 0, !extent.empty()}, params),
           records::Feet{static_cast<float>(params.offset), kDeep});
  }
  fits.known.extent = extent;
  return fits;
}

std::vector<float> rough_residuals(Device& device, const DeviceFits& fits) {
  if (fits.rough.size == 0) return std::vector<float>(fits.known.size(), 0.0f);
  const HostView found(device, fits.rough);
  return by_item(fits.neighbours->sheet.host, found.data());
}

ParticleFits download(Device& device, DeviceFits made) {
  ParticleFits& fits = made.known;
  const Cells& cells = made.neighbours->sheet.host;
  for (const FitLanes& part : made.parts) {
    const ViewTogether found(device, part.found);
    take_fits(part, found, made.offset, fits);
    if (!made.knows_surroundings || part.mean.size == 0) continue;
    const float* const mean = found.data<3>();
    fits.dense = by_item(cells, mean);
    fits.deep = by_item(cells, mean + fits.size());
    fits.apart = by_item(cells, mean + 2 * fits.size());
  }
  return std::move(fits);
}

}  // namespace meniscus
