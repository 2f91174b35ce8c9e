// A box in space, whose sides may lie at infinity.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include "stages/vec.hpp"

namespace meniscus {

/// Points from `low` on and before `high`; all of space.
struct SpaceBox {
  static constexpr double kFar = std::numeric_limits<double>::infinity();
  std::array<double, 3> low{-kFar, -kFar, -kFar}, high{kFar, kFar, kFar};

  bool holds(const Vec3d& at) const {
    return at.x >= low[0] && at.x < high[0] && at.y >= low[1] && at.y < high[1] && at.z >= low[2] &&
           at.z < high[2];
  }
  bool operator==(const SpaceBox&) const = default;
  SpaceBox wider(double by) const {
    SpaceBox box = *this;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.low[axis] -= by;
      box.high[axis] += by;
    }
    return box;
  }
  SpaceBox scaled(double by) const {
    SpaceBox box = *this;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.low[axis] *= by;
      box.high[axis] *= by;
    }
    return box;
  }
  /// How far outside a point lies, along the axis along which that is most; below 0: inside.
  double outside(const Vec3d& at) const {
    return std::max({low[0] - at.x, at.x - high[0], low[1] - at.y, at.y - high[1], low[2] - at.z,
                     at.z - high[2]});
  }
  /// The part of it that lies in another one, too.
  SpaceBox within(const SpaceBox& other) const {
    SpaceBox box = *this;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.low[axis] = std::max(low[axis], other.low[axis]);
      box.high[axis] = std::min(high[axis], other.high[axis]);
    }
    return box;
  }
  /// Points that lie less than `away` from the origin along each axis.
  static SpaceBox around_origin(double away) { return {{-away, -away, -away}, {away, away, away}}; }
  /// One that holds nothing.
  static SpaceBox nowhere() { return {{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}}; }
};

}  // namespace meniscus
