// extract() of particles that stream: what the frame is like, then what of it can matter, then the
// same pipeline as for any frame. Where several processes share the particles, each looks at its
// share, and what of it can matter goes to the first, which does the rest.
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "canonical_order.hpp"
#include "crowds.hpp"
#include "extract.hpp"
#include "meniscus/device.hpp"
#include "meniscus/meniscus.hpp"
#include "origin.hpp"
#include "pipeline.hpp"
#include "stage_clock.hpp"
#include "stream/gather.hpp"
#include "stream/spray.hpp"
#include "stream/survey.hpp"
#include "stream/team.hpp"
#include "stream/thin.hpp"
#include "to_world.hpp"
#include "velocities.hpp"

namespace meniscus {
namespace {

// Frames of more particles must say how large they are: an estimate looks at each many times.
constexpr std::int64_t kMostEstimated = std::int64_t{1} << 22;

std::array<std::vector<float>*, 7> arrays_of(Particles& particles) {
  return {&particles.x,  &particles.y,  &particles.z,     &particles.vx,
          &particles.vy, &particles.vz, &particles.radius};
}

// All particles, in the first process; the others get none.
Particles read_all(const ParticleSource& source) {
  Particles all;
  all.particle_radius = source.particle_radius();
  std::size_t size = 0, done = 0;
  for (const ParticleRange& range : source.share()) size += static_cast<std::size_t>(range.count);
  for (std::vector<float>* values : {&all.x, &all.y, &all.z}) values->resize(size);
  if (source.has_velocity())
    for (std::vector<float>* values : {&all.vx, &all.vy, &all.vz}) values->resize(size);
  if (source.has_radius()) all.radius.resize(size);
  for (const ParticleRange& range : source.share()) {
    const auto at = [&](std::vector<float>& values) {
      return values.empty() ? nullptr : values.data() + done;
    };
    const std::size_t count = static_cast<std::size_t>(range.count);
    source.read(
        range.first, count,
        {at(all.x), at(all.y), at(all.z), at(all.vx), at(all.vy), at(all.vz), at(all.radius)});
    done += count;
  }
  Team& team = source.team();
  if (team.size() == 1) return all;
  // Into the frame's order: messages name particles by it.
  std::vector<std::vector<ParticleRange>> shares;
  team.gather(source.share(),
              [&](int, std::vector<ParticleRange>&& share) { shares.push_back(std::move(share)); });
  for (std::vector<float>* values : arrays_of(all)) {
    std::vector<float> ordered;
    team.gather(std::move(*values), [&](int rank, std::vector<float>&& some) {
      if (some.empty()) return;
      ordered.resize(static_cast<std::size_t>(source.size()));
      auto from = some.begin();
      for (const ParticleRange& range : shares[static_cast<std::size_t>(rank)]) {
        std::copy_n(from, range.count, ordered.begin() + range.first);
        from += range.count;
      }
    });
    *values = std::move(ordered);
  }
  return all;
}

double radius_of(const ParticleSource& source, const Survey& survey, const Parameters& params,
                 std::vector<std::string>& warnings) {
  if (params.particle_radius > 0) return params.particle_radius;
  if (survey.middle_radius > 0) return survey.middle_radius;
  if (source.particle_radius() > 0) return source.particle_radius();
  if (survey.size >= kMostEstimated)
    throw InputError("no particle radius in the file, and with " + std::to_string(survey.size) +
                     " particles it is not estimated (give --particle-radius)");
  const Particles all = read_all(source);
  std::vector<std::string> repeated;  // of what is reported elsewhere
  double radius = 0;
  if (source.team().leads())
    radius = choose_radius(all, canonical_order(all, {}, repeated), params, warnings);
  return source.team().from_first(radius);
}

// How close particles lie on the screen: the upper quartile of their spacing over the sample's
// particles in view (pixels), and about how many are in view.
struct OnScreen {
  double spacing = 0, particles = 0;
};

OnScreen measure_spacing(const View& view, const Survey& survey) {
  std::vector<double> spacing;
  for (const std::array<float, 3>& p : survey.sample) {
    const Vec3d eye = eye_from_world(view, {p[0], p[1], p[2]});
    const PixelPosition at = project(view, eye);
    if (-eye.z > view.near_depth && at.u >= 0 && at.v >= 0 && at.u <= view.width &&
        at.v <= view.height)
      spacing.push_back(2 * std::min(view.u_scale, view.v_scale) / at.w);
  }
  if (spacing.empty()) return {};
  const auto quartile = spacing.begin() + static_cast<std::ptrdiff_t>(3 * spacing.size() / 4);
  std::nth_element(spacing.begin(), quartile, spacing.end());
  return {*quartile, static_cast<double>(spacing.size()) * static_cast<double>(survey.finite) /
                         static_cast<double>(survey.sample.size())};
}

// How many times as far apart the representatives lie as the particles: a power of the fourth root
// of two, so that it stays the same while a camera moves a little; 1: as they are.
double thinning(const OnScreen& screen, const Parameters& params) {
  constexpr double kLeast = 2, kStep = 1.189207115002721;  // less saves nothing
  const bool thins = params.method == Method::fit || params.method == Method::groups ||
                     params.method == Method::stable;
  if (!thins || screen.particles < kStreamed || !(kLeast * screen.spacing <= params.thin)) return 1;
  double factor = 1;
  while (factor * kStep * screen.spacing <= params.thin) factor *= kStep;
  return factor;
}

Vec3 checked_velocity(const ParticleChunk& chunk, std::size_t i, VelocityCheck& velocities) {
  return velocities.checked({chunk.vx[i], chunk.vy[i], chunk.vz[i]},
                            chunk.first + static_cast<std::int64_t>(i));
}

// Reports what all processes saw of the velocities of what passes.
void report(Team& team, const VelocityCheck& seen, const Parameters& params,
            std::vector<std::string>& warnings) {
  VelocityCheck all;
  for (const VelocityCheck& one : team.joined<VelocityCheck>({seen})) all.add(one);
  all.report("particles near what is seen", params, warnings);
}

// Everything in view, or where that is much what lies near the front; in the first process.
Particles gather(Device& device, const View& view, const ParticleSource& source,
                 const Parameters& params, std::size_t memory, const OnScreen& screen,
                 StageClock& clock, std::vector<std::string>& warnings) {
  // No stage looks farther than this beyond the screen's edge, in radii.
  constexpr double kMargin = 16;
  FrontMap map;
  std::size_t chunk = 0;
  if (screen.particles < kStreamed) {
    map = empty_map(device, view, kMargin);
    chunk = chunk_size(memory, 0);
  } else {
    // Behind so many radii of fluid, and so far from a gap, nothing bears on what is seen.
    constexpr double kReach = 16, kAround = 12;
    const double cell = std::max(1.0, 1.5 * screen.spacing), radius = screen.spacing / 2;
    clock.start("fronts");
    const std::size_t map_bytes = map_size(view, cell, kAround * radius);
    chunk = chunk_size(memory, map_bytes);
    map = find_fronts(device, view, source, chunk, cell, kAround * radius, kMargin, 4 * cell,
                      kAround * radius, kReach, 0);
  }
  clock.start("select");
  Particles kept;
  VelocityCheck velocities;
  select_near(device, view, source, chunk, map, {.radius = true, .velocity = params.motion},
              [&](const ParticleChunk& now, const std::vector<cl_uint>& places) {
                for (const cl_uint place : places) {
                  const std::size_t i = place & ~kIsSeen;
                  kept.x.push_back(now.x[i]);
                  kept.y.push_back(now.y[i]);
                  kept.z.push_back(now.z[i]);
                  if (!now.radius.empty()) kept.radius.push_back(now.radius[i]);
                  if (now.vx.empty()) continue;
                  const Vec3 velocity = checked_velocity(now, i, velocities);
                  kept.vx.push_back(velocity.x);
                  kept.vy.push_back(velocity.y);
                  kept.vz.push_back(velocity.z);
                }
              });
  report(source.team(), velocities, params, warnings);
  for (std::vector<float>* values : arrays_of(kept)) {
    std::vector<float> all;
    source.team().gather(std::move(*values), [&](int rank, std::vector<float>&& some) {
      if (rank == 0)
        all = std::move(some);
      else
        all.insert(all.end(), some.begin(), some.end());
    });
    *values = std::move(all);
  }
  return kept;
}

// The voxels near what the camera sees, in the first process. All lengths on the screen are in
// pixels.
VoxelGrid fill_voxels(Device& device, const View& view, const ParticleSource& source,
                      double particle_radius, const Parameters& params, std::size_t memory,
                      const OnScreen& screen, StageClock& clock,
                      std::vector<std::string>& warnings) {
  // In radii of the representatives: how far beyond the screen, around a gap and behind the front
  // particles may matter to a fit near the edge.
  constexpr double kMargin = 10, kAround = 6, kReach = 10;
  // Thickness of the front layer, in the particles' own radii; the next layer lies 1.6 behind.
  constexpr double kLayer = 0.8;
  // Cells that hold two particles of a layer, so that hardly one is empty.
  const double cell = std::max(1.0, 1.5 * screen.spacing), radius = params.thin / 2;
  clock.start("fronts");
  const double border = kMargin * radius;
  const std::size_t chunk = chunk_size(memory, map_size(view, cell, border));
  const FrontMap map =
      find_fronts(device, view, source, chunk, cell, border, kMargin, params.thin, kAround * radius,
                  kReach, kLayer * particle_radius / view.radius);
  clock.start("select");
  const double side = 2 * view.radius, step = 1024 * side;
  const auto snapped = [&](double x) { return std::floor(x / step + 0.5) * step; };
  const bool moving = params.motion && source.has_velocity();
  VoxelGrid grid(side, {snapped(view.origin.x), snapped(view.origin.y), snapped(view.origin.z)},
                 moving);
  VelocityCheck velocities;
  select_near(device, view, source, chunk, map, {.velocity = moving},
              [&](const ParticleChunk& now, const std::vector<cl_uint>& places) {
                for (const cl_uint place : places) {
                  const std::size_t i = place & ~kIsSeen;
                  grid.add(now.x[i], now.y[i], now.z[i], (place & kIsSeen) != 0,
                           moving ? checked_velocity(now, i, velocities) : kNoVelocity);
                }
              });
  Team& team = source.team();
  report(team, velocities, params, warnings);
  if (team.size() > 1)
    team.gather(team.leads() ? std::vector<VoxelGrid::Voxel>() : grid.voxels(),
                [&](int, std::vector<VoxelGrid::Voxel>&& voxels) {
                  for (const VoxelGrid::Voxel& voxel : voxels) grid.add(voxel);
                });
  return grid;
}

void set_count(Extraction& extraction, const std::string& name, std::int64_t value) {
  for (auto& [known, count] : extraction.counts)
    if (known == name) count = value;
}

}  // namespace

double choose_radius(const ParticleSource& source, const Parameters& params,
                     std::vector<std::string>& warnings) {
  if (const Particles* all = source.in_memory())
    return choose_radius(*all, canonical_order(*all, {}, warnings), params, warnings);
  return radius_of(source, survey_of(source), params, warnings);
}

Surface extract(Device& device, const ParticleSource& source, const Camera& camera,
                const Parameters& params, std::vector<StageTime>* timings, std::size_t memory) {
  const Particles* const in_memory = source.in_memory();
  if (in_memory) check(*in_memory);
  if (source.size() < kStreamed) {
    if (in_memory) return extract(device, *in_memory, camera, params, timings);
    survey_of(source);  // throws as for a larger frame
    const Particles all = read_all(source);
    return source.team().leads() ? extract(device, all, camera, params, timings) : Surface{};
  }
  check(camera);
  check(params);
  Surface surface;
  surface.camera = camera;
  const TimedKernels timed(device, timings != nullptr);
  StageClock clock(device, timings);
  clock.start("survey");
  const Survey& survey = survey_of(source);
  report_dropped(survey.size - survey.finite, survey.size, survey.first_bad, params,
                 surface.warnings);
  const double radius = radius_of(source, survey, params, surface.warnings);
  surface.particle_radius = radius;
  const std::array<double, 3> origin = origin_of(survey.low, survey.high, survey.sample);
  // All processes see what the first one sees, to the last bit, whatever machines they run on.
  Team& team = source.team();
  const View view = team.from_first(make_view(camera, radius, origin));
  const OnScreen screen = team.from_first(measure_spacing(view, survey));
  const double factor = thinning(screen, params);

  if (factor > 1) {
    const View coarse = team.from_first(make_view(camera, factor * radius, origin));
    const VoxelGrid grid = fill_voxels(device, coarse, source, radius, params, memory, screen,
                                       clock, surface.warnings);
    clock.stop();
    if (!team.leads()) return surface;
    clock.start("thin");
    const Vec3d eye = world_from_eye(coarse, {0, 0, coarse.orthographic ? 1e5 : 0});
    const Thinned thinned = thin_particles(device, grid, radius, eye, params.fit.offset);
    clock.stop();
    Extraction extraction = run_pipeline(device, coarse, thinned.particles, params, timings);
    clock.start("spray");
    if (params.image) {
      SurfaceMap image = download(device, extraction.image);
      image.velocity = std::move(extraction.velocity);
      draw_spray(coarse, thinned.spray, image);
      extraction.image = upload(device, image);
      extraction.velocity = std::move(image.velocity);
    }
    clock.stop();
    for (float& residual : extraction.residual) residual *= static_cast<float>(factor);
    set_count(extraction, "particles", survey.size);
    extraction.counts.emplace_back("representatives",
                                   static_cast<std::int64_t>(thinned.particles.x.size()));
    extraction.counts.emplace_back("spray", static_cast<std::int64_t>(thinned.spray.size()));
    return to_world(device, coarse, std::move(extraction), std::move(surface), params, timings);
  }

  const Particles kept =
      gather(device, view, source, params, memory, screen, clock, surface.warnings);
  clock.stop();
  if (!team.leads()) return surface;
  clock.start("order");
  require(kept.size() < (std::size_t{1} << 31), "particles: more than 2^31 - 1 in view");
  WorldParticles world;
  world.moving = params.motion && source.has_velocity();
  const std::vector<std::size_t> order = without_crowds(
      kept, canonical_order(kept, params, surface.warnings), radius, surface.warnings);
  for (const std::size_t i : order) {
    world.x.push_back(kept.x[i]);
    world.y.push_back(kept.y[i]);
    world.z.push_back(kept.z[i]);
    if (!kept.radius.empty()) world.scale.push_back(static_cast<float>(kept.radius[i] / radius));
    if (world.moving) world.velocity.push_back({kept.vx[i], kept.vy[i], kept.vz[i]});
  }
  clock.stop();
  Extraction extraction = run_pipeline(device, view, world, params, timings);
  set_count(extraction, "particles", survey.size);
  return to_world(device, view, std::move(extraction), std::move(surface), params, timings);
}

}  // namespace meniscus
