// What the cases of stages are made of, here and in the tests: views, maps and random numbers.
#pragma once

#include <cmath>
#include <set>
#include <vector>

#include "meniscus/camera.hpp"
#include "stages/frame/cells.hpp"
#include "stages/frame/project.hpp"
#include "stages/sample/samples.hpp"
#include "stages/stage_data.hpp"
#include "verify/random.hpp"
#include "verify/reference/epsilon.hpp"

namespace meniscus {

/// A perspective camera 10 world units in front of the origin, seen at an angle.
inline Camera perspective_camera(int width, int height) {
  return look_at({3, 2, 9}, {0.1, -0.2, 0}, {0, 1, 0}, 45, width, height);
}

/// The same with the image shifted by a quarter of its width and a tenth of its height (a lens
/// shift) and sheared by a little.
inline Camera off_centre_camera(int width, int height) {
  Camera camera = perspective_camera(width, height);
  camera.projection[1] = 0.05;
  camera.projection[2] = 0.5;
  camera.projection[6] = -0.2;
  return camera;
}

/// An orthographic camera with the same view; the image's height shows 8 world units.
inline Camera orthographic_camera(int width, int height) {
  Camera camera = perspective_camera(width, height);
  camera.projection = {
      0.25 * height / width, 0, 0, 0.1, 0, 0.25, 0, -0.05, 0, 0, -0.02, -1.02, 0, 0, 0, 1};
  return camera;
}

/// The samples of lists. Waits.
inline std::set<int> samples_of(Device& device, const SampleLists& lists) {
  const std::vector<cl_int> sample = download(device, lists.sample);
  const std::vector<cl_int> count = download(device, lists.count);
  std::set<int> samples;
  for (std::size_t t = 0; t < lists.tiles(); ++t)
    for (cl_int k = 0; k < count[t]; ++k)
      samples.insert(sample[t * 256 + static_cast<std::size_t>(k)]);
  return samples;
}

/// The pixel of sample s.
inline double u_of(const SampleGrid& grid, std::size_t s) {
  return grid.first + grid.step * static_cast<double>(s % static_cast<std::size_t>(grid.nx));
}
inline double v_of(const SampleGrid& grid, std::size_t s) {
  return grid.first + grid.step * static_cast<double>(s / static_cast<std::size_t>(grid.nx));
}

/// Values in the order of cells, in that of the particles.
inline std::vector<double> by_particle(const Cells& cells, const std::vector<float>& values) {
  std::vector<double> all(values.size());
  for (std::size_t k = 0; k < values.size(); ++k)
    all[static_cast<std::size_t>(cells.item[k])] = values[k];
  return all;
}

/// A map of `grid`'s size, `at(i, j)` everywhere.
template <class At>
std::vector<float> map_of(const SampleGrid& grid, const At& at) {
  std::vector<float> depth;
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) depth.push_back(static_cast<float>(at(i, j)));
  return depth;
}

/// Noise below 0.8 on two layers, 20 and 38 radii away, in irregular patches, and none beside them.
inline std::vector<float> patches(const SampleGrid& grid, unsigned seed) {
  Random random(seed);
  return map_of(grid, [&](int i, int j) -> double {
    const double patch = std::sin(0.35 * i + 0.2 * j) + std::cos(0.31 * j - 0.12 * i);
    const double noise = random(0, 0.8);
    return patch < -0.8 ? kNoSurface : (patch < 0.5 ? 20.0 : 38.0) + noise;
  });
}

/// Layers whose depths and their sums with 1/128 are floats, rising by up to 1/4 a sample.
inline std::vector<float> stairs(const SampleGrid& grid, unsigned seed) {
  Random random(seed);
  return map_of(grid, [&](int i, int j) -> double {
    const double patch = std::sin(0.21 * i + 0.13 * j);
    const double noise = std::floor(random(0, 16)) / 64;
    return patch < -0.9 ? kNoSurface : (patch < 0.4 ? 20 : 38) + 0.25 * i + 0.125 * j + noise;
  });
}

/// Adds a particle of the common radius, which spans (ku, kv) pixels around pixel (u, v).
inline void add_particle(Projected& p, const Vec3d& eye, double u, double v, double ku, double kv) {
  add_position(p, eye);
  p.u.push_back(static_cast<float>(u));
  p.v.push_back(static_cast<float>(v));
  p.ku.push_back(static_cast<float>(ku));
  p.kv.push_back(static_cast<float>(kv));
  p.scale.push_back(1);
}

/// n particles in a cube 20 radii away, side 2 `side`.
inline Projected scattered(std::size_t n, double side, unsigned seed) {
  Random random(seed);
  Projected p;
  for (std::size_t i = 0; i < n; ++i)
    add_position(p, {random(-side, side), random(-side, side), random(-side, side) - 20});
  return p;
}

/// n particles of many sizes around the origin, as a view sees them.
inline Projected spheres_around(const View& view, int n, unsigned seed) {
  Random random(seed);
  WorldParticles world;
  for (int k = 0; k < n; ++k) {
    add_position(world, {random(-4, 4), random(-3, 3), random(-4, 4)});
    world.scale.push_back(static_cast<float>(random(0.6, 1.5)));
  }
  return project_particles(view, world, 2);
}

/// n spheres over and around a screen; every tenth twice.
inline Projected discs(std::size_t n, unsigned seed, int width, int height) {
  Random random(seed);
  Projected p;
  for (std::size_t i = 0; i < n; ++i) {
    const auto next = [&](std::vector<float>& values, double low, double high) {
      const bool again = i % 10 == 9;
      values.push_back(again ? values.back() : static_cast<float>(random(low, high)));
    };
    next(p.x, -1, 1);
    next(p.y, -1, 1);
    next(p.z, -40, -12);
    next(p.u, -8, width + 8);
    next(p.v, -8, height + 8);
    next(p.ku, 1.5, 6);
    next(p.kv, 1.5, 6);
    next(p.scale, 0.5, 1.5);
  }
  return p;
}

}  // namespace meniscus
