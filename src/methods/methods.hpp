// One function a method: the stages in order, and nothing else.
#pragma once

#include <functional>

#include "device/device.hpp"
#include "methods/extraction.hpp"
#include "stages/other_methods/spheres.hpp"

namespace meniscus {

/// A method: the surface of particles in world space; timings: null where nobody wants them.
using RunMethod = Extraction(Device& device, const View& view, const WorldParticles& particles,
                             const Parameters& params, std::vector<StageTime>* timings);

RunMethod run_fit, run_groups, run_paper, run_stable, run_ssm, run_spheres, run_bilateral,
    run_narrow_range, run_curvature_flow, run_anisotropic;

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
