// fit: one implicit quadric per group by weighted least squares (paper 2.3, Eq. 2).
#pragma once

#include <array>
#include <vector>

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/group.hpp"

namespace meniscus {

/// f(X) = c0 + c1 x + c2 y + c3 z + c4 xx + c5 yy + c6 zz + c7 xy + c8 yz + c9 zx with X in
/// particle radii from the group's centre along the eye axes. f is near a signed distance (particle
/// radii, positive outside) and zero on the surface: the offset is part of it.
struct Quadrics {
  std::vector<std::array<float, 10>> coefficient;  // [groups]
  std::vector<float> residual;  // [groups] weighted RMS of f at the points, particle radii;
                                // negative where there is no fit
};

/// The points of one fit: what the kernel takes.
struct FitPoint {
  Vec3d position;  // eye space, particle radii
  Vec3d normal;    // unit
  double weight;   // >= 0
};

/// The problem of one group.
struct FitProblem {
  Vec3d centre;      // eye space
  double scale = 1;  // R, particle radii: positions are divided by it
  std::vector<FitPoint> points;
};

/// Fits all problems on the device (kernel fit_groups). Problems with fewer than eight points get
/// Hermite rows, those with fewer than three no fit. Waits. Throws DeviceError.
Quadrics fit_quadrics(Device& device, const std::vector<FitProblem>& problems,
                      const FitParams& params);

/// The problems of merged groups: members and rings, weighted by the quadratic B-spline of the
/// distance from the centre over 1.05 times the farthest point's (paper 2.3 and [7]).
std::vector<FitProblem> group_problems(const Triangulation& mesh, const Groups& groups,
                                       const std::vector<Vec3d>& vertex_normal);

}  // namespace meniscus
