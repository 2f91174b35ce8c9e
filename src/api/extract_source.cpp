// extract() of particles that stream: what the frame is like, then what of it can matter, then the
// same pipeline as for any frame. Where several processes share the particles, each looks at its
// share, and what of it can matter goes to the first, which does the rest.
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "api/extract.hpp"
#include "api/pipeline.hpp"
#include "base/stage_clock.hpp"
#include "base/team.hpp"
#include "meniscus/device.hpp"
#include "meniscus/meniscus.hpp"
#include "output/spray.hpp"
#include "output/to_world.hpp"
#include "prepare/attributes.hpp"
#include "prepare/canonical_order.hpp"
#include "prepare/crowds.hpp"
#include "prepare/gather.hpp"
#include "prepare/origin.hpp"
#include "prepare/survey.hpp"
#include "prepare/thin.hpp"
#include "prepare/velocities.hpp"

namespace meniscus {
namespace {

// Frames of more particles must say how large they are: an estimate looks at each many times.
constexpr std::int64_t kMostEstimated = std::int64_t{1} << 22;

std::vector<std::vector<float>*> arrays_of(Particles& particles) {
  std::vector<std::vector<float>*> arrays{&particles.x,     &particles.y,  &particles.z,
                                          &particles.vx,    &particles.vy, &particles.vz,
                                          &particles.radius};
  for (Attribute& attribute : particles.attributes) arrays.push_back(&attribute.values);
  return arrays;
}

// All particles, in the first process; the others get none.
Particles read_all(const ParticleSource& source) {
  Particles all;
  all.particle_radius = source.particle_radius();
  std::size_t size = 0, done = 0;
  for (const ParticleRange& range : source.share()) size += static_cast<std::size_t>(range.count);
  for (std::vector<float>* values : {&all.x, &all.y, &all.z}) values->resize(size);
  for (const std::string& name : source.attributes())
    all.attributes.push_back({name, std::vector<float>(size)});
  if (source.has_velocity())
    for (std::vector<float>* values : {&all.vx, &all.vy, &all.vz}) values->resize(size);
  if (source.has_radius()) all.radius.resize(size);
  for (const ParticleRange& range : source.share()) {
    const auto at = [&](std::vector<float>& values) {
      return values.empty() ? nullptr : values.data() + done;
    };
    const std::size_t count = static_cast<std::size_t>(range.count);
    ParticleArrays to{at(all.x),  at(all.y),  at(all.z),     at(all.vx),
                      at(all.vy), at(all.vz), at(all.radius)};
    for (Attribute& attribute : all.attributes) to.attributes.push_back(at(attribute.values));
    source.read(range.first, count, to);
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

std::int64_t place_in_frame(const ParticleChunk& chunk, std::size_t i) {
  return chunk.first + static_cast<std::int64_t>(i);
}

Vec3 checked_velocity(const ParticleChunk& chunk, std::size_t i, VelocityCheck& velocities) {
  return velocities.checked({chunk.vx[i], chunk.vy[i], chunk.vz[i]}, place_in_frame(chunk, i));
}

// Reports what all processes saw of the velocities of what passes.
void report(Team& team, const VelocityCheck& seen, const Parameters& params,
            std::vector<std::string>& warnings) {
  VelocityCheck all;
  for (const VelocityCheck& one : team.joined<VelocityCheck>({seen})) all.add(one);
  all.report("particles near what is seen", params, warnings);
}

void report(Team& team, const std::vector<std::string>& names, const std::vector<ValueCheck>& seen,
            const Parameters& params, std::vector<std::string>& warnings) {
  for (std::size_t a = 0; a < seen.size(); ++a) {
    ValueCheck all;
    for (const ValueCheck& one : team.joined<ValueCheck>({seen[a]})) all.add(one);
    all.report(names[a], params, warnings);
  }
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
  for (const std::string& name : source.attributes()) kept.attributes.push_back({name, {}});
  VelocityCheck velocities;
  std::vector<ValueCheck> values(kept.attributes.size());
  select_near(device, view, source, chunk, map,
              {.radius = true, .velocity = params.motion, .attributes = true},
              [&](const ParticleChunk& now, const std::vector<cl_uint>& places) {
                for (const cl_uint place : places) {
                  const std::size_t i = place & ~kIsSeen;
                  kept.x.push_back(now.x[i]);
                  kept.y.push_back(now.y[i]);
                  kept.z.push_back(now.z[i]);
                  if (!now.radius.empty()) kept.radius.push_back(now.radius[i]);
                  for (std::size_t a = 0; a < now.attributes.size(); ++a)
                    kept.attributes[a].values.push_back(
                        values[a].checked(now.attributes[a][i], place_in_frame(now, i)));
                  if (now.vx.empty()) continue;
                  const Vec3 velocity = checked_velocity(now, i, velocities);
                  kept.vx.push_back(velocity.x);
                  kept.vy.push_back(velocity.y);
                  kept.vz.push_back(velocity.z);
                }
              });
  report(source.team(), velocities, params, warnings);
  report(source.team(), source.attributes(), values, params, warnings);
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

// What of the particles may matter where they are thinned.
struct NearFront {
  FrontMap map;
  std::size_t chunk = 0;  // particles
};

// All lengths on the screen are in pixels.
NearFront find_near_front(Device& device, const View& view, const ParticleSource& source,
                          double particle_radius, const Parameters& params, std::size_t memory,
                          const OnScreen& screen) {
  // In radii of the representatives: how far beyond the screen, around a gap and behind the front
  // particles may matter to a fit near the edge.
  constexpr double kMargin = 10, kAround = 6, kReach = 10;
  // Thickness of the front layer, in the particles' own radii; the next layer lies 1.6 behind.
  constexpr double kLayer = 0.8;
  // Cells that hold two particles of a layer, so that hardly one is empty.
  const double cell = std::max(1.0, 1.5 * screen.spacing), radius = params.thin / 2;
  const double border = kMargin * radius;
  const std::size_t chunk = chunk_size(memory, map_size(view, cell, border));
  return {find_fronts(device, view, source, chunk, cell, border, kMargin, params.thin,
                      kAround * radius, kReach, kLayer * particle_radius / view.radius),
          chunk};
}

VoxelGrid empty_voxels(const View& view, bool moving) {
  const double side = 2 * view.radius, step = 1024 * side;
  const auto snapped = [&](double x) { return std::floor(x / step + 0.5) * step; };
  return VoxelGrid(side, {snapped(view.origin.x), snapped(view.origin.y), snapped(view.origin.z)},
                   moving);
}

// In the first process those of all.
void join_voxels(Team& team, VoxelGrid& grid) {
  if (team.size() == 1) return;
  team.gather(team.leads() ? std::vector<VoxelGrid::Voxel>() : grid.voxels(),
              [&](int, std::vector<VoxelGrid::Voxel>&& voxels) {
                for (const VoxelGrid::Voxel& voxel : voxels) grid.add(voxel);
              });
}

// The voxels near what the camera sees, in the first process.
VoxelGrid fill_voxels(Device& device, const View& view, const ParticleSource& source,
                      const NearFront& near, const Parameters& params,
                      std::vector<std::string>& warnings) {
  const bool moving = params.motion && source.has_velocity();
  VoxelGrid grid = empty_voxels(view, moving);
  VelocityCheck velocities;
  select_near(device, view, source, near.chunk, near.map, {.velocity = moving},
              [&](const ParticleChunk& now, const std::vector<cl_uint>& places) {
                for (const cl_uint place : places) {
                  const std::size_t i = place & ~kIsSeen;
                  grid.add(now.x[i], now.y[i], now.z[i], (place & kIsSeen) != 0,
                           moving ? checked_velocity(now, i, velocities) : kNoVelocity);
                }
              });
  report(source.team(), velocities, params, warnings);
  join_voxels(source.team(), grid);
  return grid;
}

// The same voxels, each with the sum of one attribute instead of that of velocities. Sums are of
// whole numbers, so that the order of the particles does not matter: values are scaled to the
// largest, by a power of two, which is returned.
VoxelGrid fill_voxels_with(std::size_t attribute, Device& device, const View& view,
                           const ParticleSource& source, const NearFront& near,
                           const Parameters& params, float& scale,
                           std::vector<std::string>& warnings) {
  std::vector<ValueCheck> values(source.attributes().size());
  float largest = 0;
  for_each_chunk(source, near.chunk, {.attributes = true}, [&](ParticleChunk& now) {
    ValueCheck ignored;
    for (std::size_t i = 0; i < now.count; ++i) {
      const float value = std::abs(ignored.checked(now.attributes[attribute][i], 0));
      if (value > largest) largest = value;
    }
  });
  for (const float one : source.team().joined<float>({largest})) largest = std::max(largest, one);
  VoxelGrid grid = empty_voxels(view, true);
  constexpr int kBits = 16;  // a voxel's sum holds 2^18 sides for each particle
  scale = largest > 0
              ? std::ldexp(1.0f, std::clamp(kBits + std::ilogb(grid.side()) - std::ilogb(largest),
                                            -120, 120))
              : 1.0f;
  select_near(device, view, source, near.chunk, near.map, {.attributes = true},
              [&](const ParticleChunk& now, const std::vector<cl_uint>& places) {
                for (const cl_uint place : places) {
                  const std::size_t i = place & ~kIsSeen;
                  const float value = values[attribute].checked(now.attributes[attribute][i],
                                                                place_in_frame(now, i));
                  grid.add(now.x[i], now.y[i], now.z[i], (place & kIsSeen) != 0,
                           std::isnan(value) ? kNoVelocity : Vec3{value * scale, 0, 0});
                }
              });
  report(source.team(), source.attributes(), values, params, warnings);
  join_voxels(source.team(), grid);
  return grid;
}

void set_count(Extraction& extraction, const std::string& name, std::int64_t value) {
  for (auto& [known, count] : extraction.counts)
    if (known == name) count = value;
}

}  // namespace

double choose_radius(const ParticleSource& source, const Parameters& params,
                     std::vector<std::string>& warnings) {
  if (const BorrowedParticles* all = source.in_memory())
    return choose_radius(*all, canonical_order(*all, {}, warnings), params, warnings);
  return radius_of(source, survey_of(source), params, warnings);
}

Surface extract(Device& device, const ParticleSource& source, const Camera& camera,
                const Parameters& params, std::vector<StageTime>* timings, std::size_t memory) {
  const BorrowedParticles* const in_memory = source.in_memory();
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
    clock.start("fronts");
    const NearFront near = find_near_front(device, coarse, source, radius, params, memory, screen);
    clock.start("select");
    const VoxelGrid grid = fill_voxels(device, coarse, source, near, params, surface.warnings);
    const Vec3d eye = world_from_eye(coarse, {0, 0, coarse.orthographic ? 1e5 : 0});
    // Representatives follow from where the particles are: those of an attribute are the same.
    std::vector<Attribute> carried;                // of the representatives
    std::vector<std::vector<float>> of_the_spray;  // of each attribute
    for (std::size_t a = 0; a < source.attributes().size(); ++a) {
      float scale = 1;
      const VoxelGrid values =
          fill_voxels_with(a, device, coarse, source, near, params, scale, surface.warnings);
      if (!team.leads()) continue;
      const Thinned thinned = thin_particles(device, values, radius, eye, params.fit.offset);
      Attribute& attribute = carried.emplace_back(Attribute{source.attributes()[a], {}});
      for (const Vec3& value : thinned.particles.velocity)
        attribute.values.push_back(value.x / scale);
      std::vector<float>& drops = of_the_spray.emplace_back();
      for (const SprayDrop& drop : thinned.spray) drops.push_back(drop.velocity.x / scale);
    }
    clock.stop();
    if (!team.leads()) return surface;
    clock.start("thin");
    Thinned thinned = thin_particles(device, grid, radius, eye, params.fit.offset);
    thinned.particles.attributes = std::move(carried);
    clock.stop();
    Extraction extraction = run_pipeline(device, coarse, thinned.particles, params, timings);
    clock.start("spray");
    if (params.image) {
      SurfaceMap image = download(device, extraction.image);
      image.velocity = std::move(extraction.velocity);
      const std::vector<std::int32_t> shown = draw_spray(coarse, thinned.spray, image);
      for (std::size_t a = 0; a < of_the_spray.size(); ++a)
        for (std::size_t s = 0; s < shown.size(); ++s) {
          if (shown[s] < 0) continue;
          const float value = of_the_spray[a][static_cast<std::size_t>(shown[s])];
          extraction.attributes[a].values[s] = std::isnan(value) ? 0 : value;
        }
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
  for (const Attribute& attribute : kept.attributes) {
    Attribute& ordered = world.attributes.emplace_back(Attribute{attribute.name, {}});
    for (const std::size_t i : order) ordered.values.push_back(attribute.values[i]);
  }
  clock.stop();
  Extraction extraction = run_pipeline(device, view, world, params, timings);
  set_count(extraction, "particles", survey.size);
  return to_world(device, view, std::move(extraction), std::move(surface), params, timings);
}

}  // namespace meniscus
