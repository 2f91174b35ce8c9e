// implicit: the fluid's implicit function F at points in space (paper 2.4.2, without a camera): the
// fits near a point, blended in sheets, and the density field where they are not trusted.
#pragma once

#include <cstddef>
#include <vector>

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/frame/density.hpp"
#include "stages/sample/fit_records.hpp"

namespace meniscus {

/// All that F is computed from; nothing changes it.
struct ImplicitFunction {
  Buffer<float> records;         // [fits][kFitRecord] in the order of the feet's cells, see hits.cl
  DeviceCells feet;              // of the fits, side `reach`; weights are not used
  float reach = 0;               // of the fits' weights, at most, particle radii
  DeviceCells levelled;          // all particles, see level_cells()
  cl_float2 limits{}, sheets{};  // see implicit.cl
  float mass = 1, disorder = 0;  // of the particles, see implicit.cl
  /// Only where F changes its sign is wanted, and the levelled field alone: F is what that lacks of
  /// 1, which is no distance, and has no gradient.
  bool alone = false;
};

/// Whether fit k counts: untrusted ones do not.
bool counts(const BlendRecords& records, std::size_t k);

/// Fits that do not count are left out. Their cells are as wide as the farthest reach, or `reach`
/// where that is more: the order of sums depends on it.
ImplicitFunction make_implicit(Device& device, const BlendRecords& records,
                               const DeviceCells& levelled, const Parameters& params,
                               double reach = 1);

/// Points in space, particle radii.
struct Points {
  std::vector<float> x, y, z;
  std::size_t size() const { return x.size(); }
  void reserve(std::size_t n);
  void clear();
  void add(const Vec3d& at) {
    x.push_back(static_cast<float>(at.x));
    y.push_back(static_cast<float>(at.y));
    z.push_back(static_cast<float>(at.z));
  }
  /// Repeats the last point until there is a multiple of `together`.
  void pad(std::size_t together);
};

/// F and the unit vector along its gradient at points.
struct Levels {
  std::vector<float> value;    // [n] particle radii, < 0 inside the fluid; a distance near F = 0
  std::vector<Vec3> gradient;  // [n] unit, outward; zero where F is flat; none of a field alone
};

/// How many points in a row measure_implicit() takes at a time on a device. Those that lie in
/// places far from each other are searched around one place after the other, so each place had best
/// begin at a multiple.
std::size_t points_together(Device& device);

/// F at points, those that lie near each other best one after another. Waits. Throws DeviceError.
Levels measure_implicit(Device& device, const ImplicitFunction& function, const Points& points);

}  // namespace meniscus
