#include "prepare/stream.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "base/parallel.hpp"
#include "base/team.hpp"
#include "device/device.hpp"
#include "prepare/attributes.hpp"
#include "prepare/collect.hpp"
#include "prepare/gather.hpp"
#include "prepare/velocities.hpp"

namespace meniscus {
namespace {

std::int64_t place_in_frame(const ParticleChunk& chunk, std::size_t i) {
  return chunk.first + static_cast<std::int64_t>(i);
}

Vec3 checked_velocity(const ParticleChunk& chunk, std::size_t i, VelocityCheck& velocities) {
  return velocities.checked({chunk.vx[i], chunk.vy[i], chunk.vz[i]}, place_in_frame(chunk, i));
}

// Reports what all processes saw of the velocities of what passes.
void report(Team& team, const VelocityCheck& seen, const Parameters& params, Notices& notices) {
  VelocityCheck all;
  for (const VelocityCheck& one : team.joined<VelocityCheck>({seen})) all.add(one);
  all.report("particles near what is seen", params, notices);
}

void report(Team& team, const std::vector<std::string>& names, const std::vector<ValueCheck>& seen,
            const Parameters& params, Notices& notices) {
  for (std::size_t a = 0; a < seen.size(); ++a) {
    ValueCheck all;
    for (const ValueCheck& one : team.joined<ValueCheck>({seen[a]})) all.add(one);
    all.report(names[a], params, notices);
  }
}

// What of the particles may matter where they are thinned.
struct NearFront {
  FrontMap map;
  std::size_t chunk = 0;  // particles
};

// All lengths on the screen are in pixels.
NearFront find_near_front(const Filling& filling, const View& view, const ParticleSource& source,
                          double particle_radius, const OnScreen& screen) {
  // In radii of the representatives: how far beyond the screen, around a gap and behind the front
  // particles may matter to a fit near the edge.
  constexpr double kMargin = 10, kAround = 6, kReach = 10;
  // Thickness of the front layer, in the particles' own radii; the next layer lies 1.6 behind.
  constexpr double kLayer = 0.8;
  // Cells that hold two particles of a layer, so that hardly one is empty.
  const double cell = std::max(1.0, 1.5 * screen.spacing), radius = filling.params.thin / 2;
  const double border = kMargin * radius;
  const std::size_t chunk = chunk_size(filling.memory, map_size(view, cell, border));
  return {find_fronts(filling.device, view, source, chunk,
                      {.cell = cell,
                       .border = border,
                       .margin = kMargin,
                       .block = filling.params.thin,
                       .around = kAround * radius,
                       .reach = kReach,
                       .thickness = kLayer * particle_radius / view.radius}),
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
              [&](int, std::vector<VoxelGrid::Voxel>&& voxels) { grid.add_voxels(voxels); });
}

// Adds a chunk's selected particles to a grid. `velocity_of(i)` is asked in their order, where they
// move.
template <class Velocity>
void add_selected(VoxelGrid& grid, const ParticleChunk& now, const std::vector<cl_uint>& places,
                  const Velocity& velocity_of) {
  std::vector<VoxelGrid::Particle> selected(places.size());
  constexpr std::size_t kGrain = 16384;  // particles that are worth a thread
  parallel_for(places.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t i = places[k] & ~kIsSeen;
      selected[k] = {now.x[i], now.y[i], now.z[i], (places[k] & kIsSeen) != 0};
    }
  });
  if (grid.moving())
    for (std::size_t k = 0; k < places.size(); ++k)
      selected[k].velocity = velocity_of(places[k] & ~kIsSeen);
  grid.add(selected);
}

// The voxels near what the camera sees, in the first process.
VoxelGrid fill_voxels(const Filling& filling, const View& view, const ParticleSource& source,
                      const NearFront& near) {
  const bool moving = filling.params.motion && source.has_velocity();
  VoxelGrid grid = empty_voxels(view, moving);
  VelocityCheck velocities;
  select_near(filling.device, view, source, near.chunk, near.map, {.velocity = moving},
              [&](const ParticleChunk& now, const std::vector<cl_uint>& places) {
                add_selected(grid, now, places,
                             [&](std::size_t i) { return checked_velocity(now, i, velocities); });
              });
  report(source.team(), velocities, filling.params, filling.notices);
  join_voxels(source.team(), grid);
  return grid;
}

// The same voxels, each with the sum of one attribute instead of that of velocities. Sums are of
// whole numbers, so that the order of the particles does not matter: values are scaled to the
// largest, by a power of two, which is returned.
VoxelGrid fill_voxels_with(std::size_t attribute, const Filling& filling, const View& view,
                           const ParticleSource& source, const NearFront& near, float& scale) {
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
  select_near(filling.device, view, source, near.chunk, near.map, {.attributes = true},
              [&](const ParticleChunk& now, const std::vector<cl_uint>& places) {
                add_selected(grid, now, places, [&](std::size_t i) {
                  const float value = values[attribute].checked(now.attributes[attribute][i],
                                                                place_in_frame(now, i));
                  return std::isnan(value) ? kNoVelocity : Vec3{value * scale, 0, 0};
                });
              });
  report(source.team(), source.attributes(), values, filling.params, filling.notices);
  join_voxels(source.team(), grid);
  return grid;
}

}  // namespace

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

double thinning(const OnScreen& screen, const Parameters& params) {
  constexpr double kLeast = 2, kStep = 1.189207115002721;  // less saves nothing
  const bool made_of_fits = has_layers(params.method);     // which representatives suit
  if (!made_of_fits || screen.particles < kStreamed || !(kLeast * screen.spacing <= params.thin))
    return 1;
  double factor = 1;
  while (factor * kStep * screen.spacing <= params.thin) factor *= kStep;
  return factor;
}

// The fronts of all particles, and how many particles of a chunk there is memory for beside them.
// The map of a small frame is empty: it keeps all that is in view.
std::pair<FrontMap, std::size_t> map_fronts(const Filling& filling, const ParticleSource& source,
                                            const View& view, const OnScreen& screen) {
  // No stage looks farther than this beyond the screen's edge, in radii.
  constexpr double kMargin = 16;
  if (screen.particles < kStreamed)
    return {empty_map(filling.device, view, kMargin), chunk_size(filling.memory, 0)};
  // Behind so many radii of fluid, and so far from a gap, nothing bears on what is seen.
  constexpr double kReach = 16, kAround = 12;
  const double cell = std::max(1.0, 1.5 * screen.spacing), radius = screen.spacing / 2;
  filling.clock.start("fronts");
  const std::size_t chunk = chunk_size(filling.memory, map_size(view, cell, kAround * radius));
  return {find_fronts(filling.device, view, source, chunk,
                      {.cell = cell,
                       .border = kAround * radius,
                       .margin = kMargin,
                       .block = 4 * cell,
                       .around = kAround * radius,
                       .reach = kReach}),
          chunk};
}

// The parts of all processes, one behind the other.
void gather(Team& team, std::vector<float>& values) {
  std::vector<float> all;
  team.gather(std::move(values), [&](int rank, std::vector<float>&& some) {
    if (rank == 0)
      all = std::move(some);
    else
      all.insert(all.end(), some.begin(), some.end());
  });
  values = std::move(all);
}

Particles keep_near(const Filling& filling, const ParticleSource& source, const View& view,
                    const OnScreen& screen) {
  const auto [map, chunk] = map_fronts(filling, source, view, screen);
  filling.clock.start("select");
  Particles kept;
  for (const std::string& name : source.attributes()) kept.attributes.push_back({name, {}});
  VelocityCheck velocities;
  std::vector<ValueCheck> values(kept.attributes.size());
  select_near(filling.device, view, source, chunk, map,
              {.radius = true, .velocity = filling.params.motion, .attributes = true},
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
  report(source.team(), velocities, filling.params, filling.notices);
  report(source.team(), source.attributes(), values, filling.params, filling.notices);
  for (std::vector<float>* array : arrays_of(kept)) gather(source.team(), *array);
  filling.clock.stop();
  return kept;
}

void thin_frame(const Filling& filling, const ParticleSource& source, const OnScreen& screen,
                FilledFrame& frame) {
  Team& team = source.team();
  const View& view = frame.view;
  filling.clock.start("fronts");
  const NearFront near = find_near_front(filling, view, source, frame.radius, screen);
  filling.clock.start("select");
  const VoxelGrid grid = fill_voxels(filling, view, source, near);
  const Vec3d eye = world_from_eye(view, {0, 0, view.orthographic ? 1e5 : 0});
  const double offset = filling.params.fit.offset;
  // Representatives follow from where the particles are: those of an attribute are the same.
  std::vector<Attribute> carried;  // of the representatives
  for (std::size_t a = 0; a < source.attributes().size(); ++a) {
    float scale = 1;
    const VoxelGrid values = fill_voxels_with(a, filling, view, source, near, scale);
    if (!team.leads()) continue;
    const Thinned thinned = thin_particles(filling.device, values, frame.radius, eye, offset);
    Attribute& attribute = carried.emplace_back(Attribute{source.attributes()[a], {}});
    for (const Vec3& value : thinned.particles.velocity)
      attribute.values.push_back(value.x / scale);
    std::vector<float>& drops = frame.of_the_spray.emplace_back();
    for (const SprayDrop& drop : thinned.spray) drops.push_back(drop.velocity.x / scale);
  }
  filling.clock.stop();
  if (!team.leads()) return;
  filling.clock.start("thin");
  Thinned thinned = thin_particles(filling.device, grid, frame.radius, eye, offset);
  frame.particles = std::move(thinned.particles);
  frame.particles.attributes = std::move(carried);
  frame.spray = std::move(thinned.spray);
  filling.clock.stop();
}

}  // namespace meniscus
