// spheres: the depth map and the normals of the particles' spheres, cast exactly: what method
// `spheres` shows and what the screen-space filters smooth.
#pragma once

#include "device/device.hpp"
#include "stages/frame/project.hpp"

namespace meniscus {

/// Spheres on the device, with the part of the screen that each covers.
struct DeviceSpheres {
  Buffer<float> values;  // [8][stride] eye x, y, depth, radius; pixels u, v and half extents
  int count = 0, stride = 0;
  double pixels = 0;  // the lesser half extent, on average
};

/// Spheres of `footprint` times each particle's own radius. Does not wait.
DeviceSpheres upload_spheres(Device& device, const View& view, const Projected& particles,
                             double footprint);

/// Where the ray of each sample first enters a sphere: [ny*nx] depth, particle radii; kNoSurface
/// where there is none. Waits. Throws DeviceError.
Buffer<float> cast_spheres(Device& device, const View& view, const DeviceSpheres& spheres,
                           const SampleGrid& grid);

/// The spheres' normals where cast_spheres meets them: [3][ny*nx], unit, eye axes; zero where there
/// is no surface. Waits. Throws DeviceError.
Buffer<float> sphere_normals(Device& device, const View& view, const DeviceSpheres& spheres,
                             const SampleGrid& grid);

}  // namespace meniscus
