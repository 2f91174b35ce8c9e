// The surface of particles placed by hand, found as the methods find it.
#pragma once

#include <vector>

#include "stages/frame/density.hpp"
#include "stages/sheet/surface.hpp"
#include "stages/stage_test_support.hpp"
#include "verify/stage_cases/mesh_by_hand.hpp"

namespace meniscus {

/// nu x nv x layers particles 2 radii apart and moved by up to `rough` along each axis; the front
/// layer at depth 30, the corner at pixel (10, 10). Layer by layer, rows of constant v.
inline Projected block(int nu, int nv, int layers, double rough = 0, unsigned seed = 1) {
  Random random(seed);
  std::vector<Vec3d> uvt;
  for (int k = 0; k < layers; ++k)
    for (int j = 0; j < nv; ++j)
      for (int i = 0; i < nu; ++i) {
        const double u = 10 + 2 * i + random(-rough, rough), v = 10 + 2 * j + random(-rough, rough);
        uvt.push_back({u, v, 30 + 2 * k + random(-rough, rough)});
      }
  return place(uvt);
}

/// What is seen of some particles and what stands for their surface.
struct FoundSurface {
  Visible seen;
  std::vector<Vec3d> normals;  // [seen]
  Cells cells;
  std::vector<float> gradients;
  FieldSurface field;
  SurfaceParticles surface;
};

/// With the first `seen` particles visible.
inline FoundSurface surface_of(Device& device, const Projected& projected, std::size_t seen) {
  FoundSurface found;
  found.seen.index.resize(seen);
  std::iota(found.seen.index.begin(), found.seen.index.end(), 0);
  found.seen.owned.assign(seen, 0.3f);
  const Triangulation mesh = triangulate(plain_view(), projected, found.seen, {});
  found.normals = first_normals(plain_view(), projected, found.seen, mesh, mesh.normal);
  found.cells = make_cells(projected.x, projected.y, projected.z, kDensitySupport);
  found.gradients = download(device, measure_gradients(device, upload_cells(device, found.cells)));
  found.field = find_surface(found.seen, found.cells, found.gradients);
  found.surface = with_normals(found.field, found.seen, found.normals);
  return found;
}

}  // namespace meniscus
