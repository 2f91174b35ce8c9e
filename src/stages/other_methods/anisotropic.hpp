// anisotropic: the surface of Yu and Turk 2013: a kernel for each particle, stretched along its
// neighbours, and the level set of the kernels' sum as rays meet it.
#pragma once

#include <vector>

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/frame/project.hpp"
#include "stages/stage_data.hpp"

namespace meniscus {

/// A kernel is stretched at most this much more than that of a full neighbourhood, k_s.
inline constexpr double kMostStretch = 1.25;

/// How far the widest kernel reaches, particle radii.
double reach_of(const AnisotropicParams& params);

/// The particles' kernels on the device, in the bucket order of their centres.
struct AnisotropicKernels {
  Buffer<float> x, y, z;  // [n] centres, eye space, particle radii
  Buffer<cl_int> start;   // [buckets + 1] of a hash grid as wide as the longest reach
  Buffer<float> shapes;   // [11][n] centre, G, V det G / pi, reach^2 (anisotropic.cl)
  int count = 0;
  records::CellGrid grid{1, 0};
  std::vector<float> host_shapes;  // the same as shapes, for those who look at them
};

/// Weighted principal components of each particle's neighbours within 2 h, smoothed centres and
/// volumes (Yu and Turk, Eqs. 6 and 9 to 16).
///
///   particles  eye space, particle radii; their own scales are not used
///   params     h in particle radii; lambda, k_r, k_s, k_n, N_eps as in the paper, but k_s = 1
///              makes the kernel of a full neighbourhood a sphere of smoothing length h
///
/// Waits. Throws DeviceError.
AnisotropicKernels shape_kernels(Device& device, const Projected& particles,
                                 const AnisotropicParams& params);

/// Points on the screen and between which depths their rays are searched.
struct FieldRays {
  std::vector<float> points;  // [2][n] u, v, pixels
  Buffer<float> from;         // [n] particle radii; kNoSurface: nothing to find
  Buffer<float> to;           // [n]
};

/// The first crossing of `level` on each ray: depth (kNoSurface where there is none) and the
/// field's normal, outward, eye axes. Depths are good to a hundredth of a radius; what is at least
/// a quarter of a radius thick is not missed.
/// Waits. Throws DeviceError.
std::vector<SurfaceSample> cast_field(Device& device, const View& view,
                                      const AnisotropicKernels& kernels, const FieldRays& rays,
                                      double level);

}  // namespace meniscus
