// Samples of layers around clouds of particles, for the reference of stage settle.
#pragma once

#include "stages/sample/settle.hpp"
#include "verify/reference/settle.hpp"
#include "verify/stage_cases/inputs.hpp"
#include "verify/stage_cases/into_new.hpp"

namespace meniscus {

/// Eighty-four particles two radii apart, moved by up to 0.3, as many behind them, and a lone one
/// beside them.
inline Projected blob_and_lone(const View& view, double u, double v) {
  Random random(11);
  Projected p;
  const auto add = [&](const Vec3d& at) { add_position(p, at); };
  for (const double depth : {21, 33}) {
    const Vec3d corner = point_at(view, u, v, depth) - Vec3d{6, 5, 0};
    for (int k = 0; k < 2; ++k)
      for (int j = 0; j < 6; ++j)
        for (int i = 0; i < 7; ++i)
          add(corner + Vec3d{2 * i + random(-0.3, 0.3), 2 * j + random(-0.3, 0.3),
                             -2 * k + random(-0.3, 0.3)});
  }
  add(point_at(view, 2.5 * u, 1.2 * v, 18));
  return p;
}

/// So many around one ray that searches list no more than a part of them.
inline Projected ball(const View& view, double u, double v) {
  Random random(12);
  Projected p;
  const Vec3d middle = point_at(view, u, v, 21);
  while (p.x.size() < 900) {
    const Vec3d from{random(-4, 4), random(-4, 4), random(-4, 4)};
    if (length(from) > 4) continue;
    add_position(p, {middle.x + from.x, middle.y + from.y, middle.z + from.z});
  }
  return p;
}

/// A levelled field on a device and in double precision, seen by a camera.
struct FieldScene {
  static constexpr double kStart = 5, kEnd = 45;  // all particles lie between these depths
  static constexpr double kDisorder = 0.25;       // for which blend and field are compared

  FieldScene(Device& device, int width, int height, bool crowded)
      : view(make_view(perspective_camera(width, height), 0.5, {0, 0, 0})),
        grid(pixel_grid(view)),
        field{crowded ? ball(view, 0.5 * width, 0.5 * height)
                      : blob_and_lone(view, 0.35 * width, 0.4 * height),
              {}},
        host_cells(
            make_cells(field.particles.x, field.particles.y, field.particles.z, kDensitySupport)),
        cells(upload_cells(device, host_cells)),
        levelled(level_cells(device, cells, params)) {
    // The weights have a reference of their own; the field starts from the device's.
    field.weight = by_particle(host_cells, download(device, levelled.weight));
  }

  SettlingField settling() const { return {cells, levelled, params, kDisorder}; }

  reference::FieldOnRay ray(std::size_t s) const {
    return {field, view, u_of(grid, s), v_of(grid, s)};
  }
  // The stage's constants, from docs/method.md: 4 radii behind, 12 in gaps, 2 at points.
  reference::SettleLimits limits(bool only_gaps) const { return limits_behind(only_gaps ? 12 : 4); }
  reference::SettleLimits limits_at_points() const { return limits_behind(2); }

  View view;
  SampleGrid grid;
  RegionParams params;
  reference::Field field;
  Cells host_cells;
  DeviceCells cells, levelled;

 private:
  reference::SettleLimits limits_behind(double beyond) const {
    return {params.contour_density, params.blob_density, kDisorder, beyond};
  }
};

/// The samples of a layer before they are settled, or after it.
struct Layer {
  std::vector<float> triangle, reference, trust, depth, normal, behind;  // normal: [3][n]
  std::vector<cl_int> group;
  std::vector<cl_uchar> kind;

  explicit Layer(std::size_t n)
      : triangle(n, kNoSurface),
        reference(n, kNoSurface),
        trust(n),
        depth(n, kNoSurface),
        normal(3 * n),
        behind(n, kNoSurface),
        group(n, 7),
        kind(n, static_cast<cl_uchar>(Kind::surface)) {}

  std::size_t size() const { return depth.size(); }
  Vec3d normal_at(std::size_t s) const {
    const std::size_t n = depth.size();
    return {normal[s], normal[n + s], normal[2 * n + s]};
  }
  bool same_sample(const Layer& other, std::size_t s) const {
    return depth[s] == other.depth[s] && normal_at(s) == other.normal_at(s) &&
           group[s] == other.group[s] && kind[s] == other.kind[s];
  }

  /// With what the blend adds to the trust (blend.cl) taken from it.
  reference::LayerSample sample(std::size_t s) const {
    reference::LayerSample sample;
    sample.triangle = triangle[s];
    sample.reference = reference[s];
    sample.last = behind[s];
    sample.depth = depth[s];
    sample.passed = trust[s] >= records::kPassed;
    sample.ended = trust[s] >= records::kEnded;
    sample.on_edge = !sample.ended && trust[s] >= records::kOnEdge;
    sample.trust = trust[s] - (sample.passed    ? records::kPassed
                               : sample.ended   ? records::kEnded
                               : sample.on_edge ? records::kOnEdge
                                                : 0);
    sample.normal = normal_at(s);
    return sample;
  }
};

/// Where a ray comes nearest to the level of a field that it does not reach: a blend there decides
/// by how near that is. To an eighth of a radius.
inline double densest(const reference::FieldOnRay& ray, double from, double to) {
  double best = 21;
  for (double t = from; t < to; t += 0.125)
    if (ray.levelled(t) > ray.levelled(best)) best = t;
  return best;
}

/// Blends, references and triangles at random around where rays meet the field, and elsewhere;
/// every kind of trust. A quarter of the samples looks again.
inline Layer random_layer(const FieldScene& scene, unsigned seed) {
  Random random(seed), marks(seed + 1);  // marks of trust, compared with the field for a part
  const std::size_t n = scene.grid.size();
  const double level = scene.params.blob_density;
  Layer layer(n);
  // No input depends on what a device found.
  reference::Field field{scene.field.particles, {}};
  for (std::size_t i = 0; i < field.particles.size(); ++i)
    field.weight.push_back(
        reference::level_weight(reference::density(field.particles, field.particles.eye(i)),
                                reference::share(0), level, 1));
  for (std::size_t s = 0; s < n; ++s) {
    const reference::FieldOnRay ray(field, scene.view, u_of(scene.grid, s), v_of(scene.grid, s));
    const auto met = reference::chords(ray, scene.kStart, scene.kEnd, level);
    const auto which = static_cast<std::size_t>(random(0, 1) * static_cast<double>(met.size()));
    const double at = met.empty() ? densest(ray, scene.kStart, scene.kEnd)
                                  : std::floor(64 * met[which].enter) / 64;
    const bool near = random(0, 1) < 0.8;
    const double reach = near ? 1 : 8;
    const auto chance = [&](double share) { return random(0, 1) < share; };
    layer.reference[s] = static_cast<float>(at + random(-1, 0.5) * reach);
    layer.depth[s] = static_cast<float>(at + random(-1, 1) * reach);
    layer.triangle[s] = static_cast<float>(layer.depth[s] + random(-4.5, 4.5));
    const double where = chance(0.3) ? 2 : chance(0.2) ? (s % 3 == 0 ? 8 : 4) : 0;
    double trust = chance(0.25) ? 1 : chance(0.1) ? 0 : std::sqrt(random(0, 1));
    if (marks(0, 1) < 0.15) trust = marks(0.99, 1);
    layer.trust[s] = static_cast<float>(where + trust);
    const double size = chance(0.6) ? 0.4 : 3;
    const Vec3d off{random(-1, 1), random(-1, 1), random(-0.3, 0.3)};
    const Vec3d normal = normalized(normalized(-ray.direction) + off * size);
    layer.normal[s] = static_cast<float>(normal.x);
    layer.normal[n + s] = static_cast<float>(normal.y);
    layer.normal[2 * n + s] = static_cast<float>(normal.z);
    if (chance(0.15)) layer.depth[s] = kNoSurface;
    if (chance(0.1)) layer.reference[s] = kNoSurface;
    if (chance(0.4)) layer.triangle[s] = kNoSurface;
  }
  for (std::size_t s = 0; s < n; ++s)
    if (random(0, 1) < 0.25 && layer.reference[s] < kNoSurface)
      layer.behind[s] = static_cast<float>(layer.reference[s] - random(3, 12));
  return layer;
}

inline SurfaceBuffers upload(Device& device, const SampleGrid& grid, const Layer& layer) {
  return {grid,
          upload(device, layer.depth),
          upload(device, layer.normal),
          upload(device, layer.group),
          upload(device, layer.trust),
          upload(device, layer.kind)};
}

inline Layer download(Device& device, const Layer& before, const SurfaceBuffers& surface) {
  Layer after = before;
  after.depth = download(device, surface.depth);
  after.normal = download(device, surface.normal);
  after.group = download(device, surface.group);
  after.kind = download(device, surface.kind);
  return after;
}

inline Layer settled(Device& device, const FieldScene& scene, const Layer& before, bool only_gaps) {
  const SurfaceBuffers surface = upload(device, scene.grid, before);
  const auto reference = upload(device, before.reference);
  const auto behind = upload(device, before.behind);
  settle_samples(device, scene.view, list_gaps(device, scene.grid, reference, 0).lists,
                 scene.settling(), upload(device, before.triangle), reference, surface, behind,
                 only_gaps);
  Layer after = download(device, before, surface);
  after.reference = download(device, reference);
  after.behind = download(device, behind);
  return after;
}

/// The same at single points, those of the samples: settle_points().
inline Layer settled_at_points(Device& device, const FieldScene& scene, const Layer& before) {
  const std::size_t n = before.size();
  std::vector<float> points(2 * n);
  for (std::size_t s = 0; s < n; ++s) {
    points[s] = static_cast<float>(u_of(scene.grid, s));
    points[n + s] = static_cast<float>(v_of(scene.grid, s));
  }
  const SurfaceBuffers list = upload(device, SampleGrid{static_cast<int>(n), 1, 0, 1}, before);
  const auto reference = upload(device, before.reference);
  settle_points(device, scene.view, scene.settling(), upload(device, points), reference, list);
  Layer after = download(device, before, list);
  after.reference = download(device, reference);
  return after;
}

}  // namespace meniscus
