// Method anisotropic: the level set of anisotropic kernels (Yu and Turk 2013), met by rays.
#include "stages/other_methods/anisotropic.hpp"

#include <algorithm>

#include "device/stage_clock.hpp"
#include "methods/methods.hpp"
#include "stages/mesh/mesh.hpp"
#include "stages/mesh/silhouettes.hpp"
#include "stages/other_methods/spheres.hpp"

namespace meniscus {

Extraction run_anisotropic(Device& device, const View& view, const WorldParticles& particles,
                           const Parameters& params, std::vector<StageTime>* timings) {
  Extraction result;
  StageClock clock(device, timings);
  const AnisotropicParams& own = params.anisotropic;
  clock.start("project");
  const double margin = reach_of(own) + 2 * own.h;  // the kernels' reach, and their neighbours'
  const Projected projected = project_particles(view, particles, margin);
  clock.start("kernels");
  const AnisotropicKernels kernels = shape_kernels(device, projected, own);
  // Rays begin where they come this near a particle: the surface lies about 1 outside them.
  constexpr double kStart = 2;
  const DeviceSpheres spheres = upload_spheres(device, view, projected, kStart);
  float farthest = 0;
  for (const float z : projected.z) farthest = std::max(farthest, -z);
  farthest += static_cast<float>(margin);

  const auto make_surface = [&](const SampleGrid& grid) {
    clock.start("cast");
    FieldRays rays;
    rays.points.resize(2 * grid.size());
    for (std::size_t k = 0; k < grid.size(); ++k) {
      rays.points[k] = grid.first + grid.step * static_cast<float>(k % grid.nx);
      rays.points[grid.size() + k] = grid.first + grid.step * static_cast<float>(k / grid.nx);
    }
    rays.from = cast_spheres(device, view, spheres, grid);
    rays.to = filled<float>(device, grid.size(), farthest);
    SurfaceMap map;
    map.grid = grid;
    map.group.assign(grid.size(), -1);
    for (const SurfaceSample& sample : cast_field(device, view, kernels, rays, own.level)) {
      map.depth.push_back(sample.depth);
      map.normal.push_back(sample.normal);
      map.kind.push_back(sample.depth < kNoSurface ? Kind::surface : Kind::none);
    }
    return map;
  };
  if (params.image) result.image = upload(device, make_surface(pixel_grid(view)));
  if (params.mesh) {
    const SurfaceMap nodes = make_surface(node_grid(view, params.grid.cell));
    clock.start("mesh");
    const double z_max = params.grid.z_max;
    const auto sample = [&](const std::vector<float>& points, const std::vector<float>& near) {
      std::vector<float> from, to;
      for (const float depth : near) {
        from.push_back(std::max(1e-3f, depth - static_cast<float>(z_max)));
        to.push_back(depth + static_cast<float>(z_max));
      }
      return cast_field(device, view, kernels, {points, upload(device, from), upload(device, to)},
                        own.level);
    };
    result.mesh = make_mesh(
        view, nodes, bisect_silhouettes(nodes, find_silhouette_edges(nodes, z_max), z_max, sample),
        params.grid);
  }
  clock.stop();
  result.counts = count_particles(particles, projected);
  return result;
}

}  // namespace meniscus
