// A surface that needs no device: waves on a pond, cast by rays, and a drop above them. Every map
// and a small mesh are filled.
#pragma once

#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>

#include "meniscus/camera.hpp"
#include "stages/view.hpp"

namespace meniscus {

/// The pond is the disc of radius 1 around the origin, z = 0.05 sin(6 x); the drop is a sphere of
/// radius 0.2 at (0, 0, 0.6). Particle radius 0.05.
inline Surface sample_surface(const Camera& camera) {
  Surface surface;
  surface.camera = camera;
  surface.particle_radius = 0.05;
  const auto pixels = static_cast<std::size_t>(camera.width) * camera.height;
  surface.depth.assign(pixels, std::numeric_limits<float>::infinity());
  surface.normal.resize(pixels);
  surface.position.resize(pixels);
  surface.group.resize(pixels);
  surface.kind.resize(pixels, Kind::none);
  surface.residual.resize(pixels);
  const View view = make_view(camera, surface.particle_radius, {0, 0, 0});
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column) {
      const double u = column + .5, v = row + .5;
      const Vec3d from = world_from_eye(view, point_at(view, u, v, 0));
      const Vec3d along = world_direction(view, ray_direction(view, u, v)) * view.radius;
      const std::size_t k = static_cast<std::size_t>(row) * camera.width + column;
      const auto set = [&](double t, const Vec3d& normal, Kind kind, std::uint32_t group) {
        surface.depth[k] = static_cast<float>(t * view.radius);
        surface.normal[k] = static_cast<Vec3>(normalized(normal));
        surface.position[k] = static_cast<Vec3>(from + along * t);
        surface.kind[k] = kind;
        surface.group[k] = group;
        surface.residual[k] = kind == Kind::surface ? 0.03f : 0.0f;
      };
      const Vec3d to_drop = from - Vec3d{0, 0, 0.6};
      const double a = dot(along, along), b = dot(to_drop, along), c = dot(to_drop, to_drop) - 0.04,
                   d = b * b - a * c;
      if (d > 0 && -b - std::sqrt(d) > 0) {
        const double t = (-b - std::sqrt(d)) / a;
        set(t, to_drop + along * t, Kind::splash, 0);
        continue;
      }
      double t = -from.z / along.z;  // z = 0, then a few steps towards the waves
      const auto height = [](const Vec3d& p) { return 0.05 * std::sin(6 * p.x); };
      for (int step = 0; step < 40; ++step) {
        const Vec3d p = from + along * t;
        t += (height(p) - p.z) / along.z * 0.7;
      }
      const Vec3d p = from + along * t;
      if (!(t > 0) || p.x * p.x + p.y * p.y > 1) continue;
      set(t, {-0.3 * std::cos(6 * p.x), 0, 1}, Kind::surface,
          1 + static_cast<std::uint32_t>(std::floor(p.x * 5) + 5) * 11 +
              static_cast<std::uint32_t>(std::floor(p.y * 5) + 5));
    }
  surface.mesh.position = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0.25f}, {0, 1, 1e-7f}};
  surface.mesh.normal = {{0, 0, 1}, {0, 0, 1}, {-0.6f, 0, 0.8f}, {0, 0.1f, 0.995f}};
  surface.mesh.triangle = {{0, 1, 2}, {0, 2, 3}};
  return surface;
}

/// The same with layers: the drop is a body before the pond, which is .1 deep along rays; `most`
/// are kept of a ray's up to two.
inline Surface layered_surface(const Camera& camera, int most) {
  Surface surface = sample_surface(camera);
  const std::size_t pixels = surface.depth.size();
  Layers& layers = surface.layers;
  layers.most = most;
  layers.count.resize(pixels);
  layers.thickness.resize(pixels);
  layers.back_normal.resize(pixels);
  layers.entry.resize(pixels * static_cast<std::size_t>(most),
                      std::numeric_limits<float>::infinity());
  layers.exit = layers.entry;
  for (std::size_t p = 0; p < pixels; ++p) {
    if (!std::isfinite(surface.depth[p])) continue;
    layers.count[p] = surface.kind[p] == Kind::splash ? 2 : 1;
    layers.thickness[p] = 0.1f * static_cast<float>(layers.count[p]);
    layers.back_normal[p] = {0, 0, -1};
    float from = surface.depth[p];
    for (std::size_t k = 0; k < std::min<std::size_t>(layers.count[p], layers.most); ++k) {
      layers.entry[k * pixels + p] = from;
      layers.exit[k * pixels + p] = from + 0.1f;
      from += 0.5f;
    }
  }
  return surface;
}

inline Camera sample_camera(int width = 61, int height = 47) {
  return look_at({1.3, -2.2, 1.6}, {0, 0, 0.1}, {0, 0, 1}, 42, width, height);
}

inline std::string file_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace meniscus
