// One function a method: the stages in order, and nothing else.
#pragma once

#include <functional>

#include "device/device.hpp"
#include "methods/extraction.hpp"
#include "stages/spheres.hpp"

namespace meniscus {

Extraction run_fit(Device& device, const View& view, const WorldParticles& particles,
                   const Parameters& params, std::vector<StageTime>* timings);
Extraction run_groups(Device& device, const View& view, const WorldParticles& particles,
                      const Parameters& params, std::vector<StageTime>* timings);
Extraction run_paper(Device& device, const View& view, const WorldParticles& particles,
                     const Parameters& params, std::vector<StageTime>* timings);
Extraction run_stable(Device& device, const View& view, const WorldParticles& particles,
                      const Parameters& params, std::vector<StageTime>* timings);
Extraction run_ssm(Device& device, const View& view, const WorldParticles& particles,
                   const Parameters& params, std::vector<StageTime>* timings);
Extraction run_spheres(Device& device, const View& view, const WorldParticles& particles,
                       const Parameters& params, std::vector<StageTime>* timings);
Extraction run_bilateral(Device& device, const View& view, const WorldParticles& particles,
                         const Parameters& params, std::vector<StageTime>* timings);
Extraction run_narrow_range(Device& device, const View& view, const WorldParticles& particles,
                            const Parameters& params, std::vector<StageTime>* timings);
Extraction run_curvature_flow(Device& device, const View& view, const WorldParticles& particles,
                              const Parameters& params, std::vector<StageTime>* timings);
Extraction run_anisotropic(Device& device, const View& view, const WorldParticles& particles,
                           const Parameters& params, std::vector<StageTime>* timings);

/// What the methods that smooth the depth map of the particles' spheres share: the spheres of
/// `footprint`, the depth and the normals that `surface` makes of them on a grid, the image, and a
/// mesh whose silhouettes end where the spheres' circles do; depths more than z_max apart are two
/// layers.
struct DepthAndNormals {
  Buffer<float> depth;   // [ny*nx] particle radii; kNoSurface
  Buffer<float> normal;  // [3][ny*nx] unit, eye axes
};
using SphereFilter =
    std::function<DepthAndNormals(const DeviceSpheres& spheres, const SampleGrid& grid)>;
Extraction run_on_spheres(Device& device, const View& view, const WorldParticles& particles,
                          const Parameters& params, std::vector<StageTime>* timings,
                          double footprint, double z_max, const SphereFilter& filter);

}  // namespace meniscus
