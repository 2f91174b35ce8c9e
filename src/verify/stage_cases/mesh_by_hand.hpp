// Particles placed by hand on an orthographic screen, one pixel to a particle radius.
#pragma once

#include <numeric>
#include <vector>

#include "stages/fit/particle_fit.hpp"
#include "stages/other_methods/merge_groups.hpp"
#include "stages/sheet/smooth_normals.hpp"
#include "stages/sheet/surface.hpp"
#include "stages/sheet/triangulate.hpp"
#include "verify/reference/particle_fit.hpp"
#include "verify/stage_cases/inputs.hpp"

namespace meniscus {

/// One pixel is one particle radius; pixel (i, j) looks at eye x = i - 50, y = 50 - j.
inline View plain_view() {
  Camera camera;
  camera.width = camera.height = 100;
  camera.view = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  camera.projection = {0.02, 0, 0, 0, 0, 0.02, 0, 0, 0, 0, -0.01, -1, 0, 0, 0, 1};
  return make_view(camera, 1, {0, 0, 0});
}

/// Particles at screen position (u, v) and depth t.
inline Projected place(const std::vector<Vec3d>& uvt) {
  const View view = plain_view();
  Projected p;
  for (const Vec3d& at : uvt) add_particle(p, point_at(view, at.x, at.y, at.z), at.x, at.y, 1, 1);
  return p;
}

inline Visible all_visible(const Projected& p) {
  Visible visible;
  visible.index.resize(p.size());
  std::iota(visible.index.begin(), visible.index.end(), 0);
  visible.owned.assign(p.size(), 0.3f);
  return visible;
}

/// n x n particles, 2 radii apart and moved by up to 0.4, with depth(u, v).
template <class Depth>
Projected field(int n, unsigned seed, Depth&& depth) {
  Random random(seed);
  std::vector<Vec3d> uvt;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double u = 10 + 2 * i + random(-0.4, 0.4), v = 10 + 2 * j + random(-0.4, 0.4);
      uvt.push_back({u, v, depth(u, v)});
    }
  return place(uvt);
}

inline Triangulation triangulated(const Projected& p) {
  return triangulate(plain_view(), p, all_visible(p), {});
}

/// Smoothed normals of all triangles.
inline std::vector<Vec3d> smooth_normals(const Triangulation& mesh, int rounds) {
  std::vector<std::int32_t> all(mesh.position.size());
  std::iota(all.begin(), all.end(), 0);
  return smooth_normals(mesh, rounds, all);
}

/// First normals of all seen particles.
inline std::vector<Vec3d> first_normals(const View& view, const Projected& projected,
                                        const Visible& seen, const Triangulation& mesh,
                                        const std::vector<Vec3d>& normals) {
  std::vector<std::int32_t> all(seen.index.size());
  std::iota(all.begin(), all.end(), 0);
  return first_normals(view, projected, seen, mesh, normals,
                       normal_sources(projected, seen, mesh, std::move(all)));
}

/// Depths of surfaces.
inline double hills(double u, double v) { return 30 + 2 * std::sin(0.3 * u) + std::cos(0.25 * v); }
inline double roof(double u, double) { return 30 + 0.8 * std::abs(u - 21); }

/// Particles of a surface, of which some are fitted.
struct FittedSurface {
  Projected projected;
  Visible seen;
  SurfaceParticles around;
  std::vector<std::int32_t> place;  // of the seen ones in `around`

  reference::Surroundings surroundings(const ParticleFits& fits) const {
    return reference::surroundings(projected, seen, around, fits, place);
  }
};

/// Every `step`-th particle is part of the surface alone.
inline FittedSurface fitted_surface(const Projected& projected, std::int32_t step = 5) {
  FittedSurface scene{projected, {}, {}, {}};
  const Visible all = all_visible(projected);
  const Triangulation mesh = triangulated(projected);
  scene.around = {all.index, {}, first_normals(plain_view(), projected, all, mesh, mesh.normal)};
  Random random(3);
  for (const std::int32_t i : all.index) {
    scene.around.weight.push_back(static_cast<float>(random(0.3, 1)));
    if (i % step == step - 1) continue;
    scene.seen.index.push_back(i);
    scene.seen.owned.push_back(static_cast<float>(random(0.02, 0.12)));
    scene.seen.influence.push_back(static_cast<float>(random(0.1, 1)));
  }
  scene.place = scene.seen.index;
  return scene;
}

/// Hand-made fits at the vertices of a mesh: tangent quadrics of `depth`, curved by up to `bend`.
template <class Depth>
ParticleFits made_by_hand(const Triangulation& mesh, Depth&& depth, double bend, unsigned seed) {
  Random random(seed);
  ParticleFits fits;
  for (std::size_t k = 0; k < mesh.position.size(); ++k) {
    const double u = mesh.screen[k].u, v = mesh.screen[k].v, step = 1e-3;
    // Eye x runs with u, y against v, and z against the depth.
    const double du = (depth(u + step, v) - depth(u - step, v)) / (2 * step);
    const double dv = (depth(u, v + step) - depth(u, v - step)) / (2 * step);
    const Vec3d n = normalized({du, -dv, 1});
    fits.position.push_back(mesh.position[k]);
    fits.normal.push_back(Vec3d(Vec3(n)));
    fits.visible.push_back(random(0.1, 1));
    fits.surface.push_back(1);
    fits.support.push_back(FitParams{}.support);
    fits.roundness.push_back(0);
    fits.edge.push_back(random(0.005, 1));
    fits.firmness.push_back(fits.edge.back());
    fits.foot.push_back(mesh.position[k] + n);
    std::array<float, 10> c{};
    const double linear[4] = {-1, n.x, n.y, n.z};
    for (int q = 0; q < 4; ++q) c[q] = static_cast<float>(linear[q]);
    for (int q = 4; q < 10; ++q) c[q] = static_cast<float>(random(-bend, bend));
    fits.quadric.push_back(c);
    fits.residual.push_back(0);
  }
  return fits;
}

/// A group of n particles whose normal is the eye's z axis.
inline Triangulation bumps(std::size_t n, unsigned seed) {
  Random random(seed);
  Triangulation mesh;
  for (std::size_t k = 0; k < n; ++k) {
    const double x = random(-4, 4), y = random(-4, 4);
    mesh.position.push_back({x, y, -20 + 0.1 * x * x - 0.2 * x * y + 0.3 * y + random(-0.2, 0.2)});
  }
  return mesh;
}

/// All particles of a mesh as one group around (0.2, -0.1, -20).
inline Groups one_group(const Triangulation& mesh) {
  Groups groups;
  groups.centre = {{0.2, -0.1, -20}};
  groups.normal = {{0, 0, 1}};
  groups.radius = {0};
  for (const Vec3d& p : mesh.position)
    groups.radius[0] = std::max(groups.radius[0], length(p - groups.centre[0]));
  groups.triangles = {1};
  groups.start = {0, static_cast<std::int32_t>(mesh.position.size())};
  groups.point.resize(mesh.position.size());
  std::iota(groups.point.begin(), groups.point.end(), 0);
  return groups;
}

}  // namespace meniscus
