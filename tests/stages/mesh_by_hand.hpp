// Particles placed by hand on an orthographic screen, one pixel to a particle radius.
#pragma once

#include <numeric>
#include <vector>

#include "stages/stage_test_support.hpp"
#include "stages/triangulate.hpp"

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
  for (const Vec3d& at : uvt) {
    const Vec3d eye = point_at(view, at.x, at.y, at.z);
    p.x.push_back(static_cast<float>(eye.x));
    p.y.push_back(static_cast<float>(eye.y));
    p.z.push_back(static_cast<float>(eye.z));
    p.u.push_back(static_cast<float>(at.x));
    p.v.push_back(static_cast<float>(at.y));
    p.ku.push_back(1);
    p.kv.push_back(1);
    p.scale.push_back(1);
  }
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

inline Triangulation triangulated(const Projected& p, const TriangleParams& params = {}) {
  return triangulate(plain_view(), p, all_visible(p), params);
}

}  // namespace meniscus
