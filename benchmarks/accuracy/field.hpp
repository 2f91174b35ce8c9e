// Solids without a formula: functions on a grid, and the distances that they have. Lengths in s.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "accuracy/shapes.hpp"
#include "stages/vec.hpp"

namespace meniscus::accuracy {

inline constexpr double kGridStep = 0.4;  // s from node to node
inline constexpr double kBand = 3;        // s; no distance of a grid is larger

/// A function by its values at the nodes of a grid of step kGridStep, x fastest. Between the nodes
/// it is the Catmull-Rom cubic, whose slopes are continuous: a surface where it is zero has no
/// creases of the grid's.
struct Field {
  Vec3d low;  // the first node
  std::array<int, 3> count{};
  std::vector<float> value;

  std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * count[1] + j) * count[0] + i;
  }
  Vec3d node(int i, int j, int k) const { return low + kGridStep * Vec3d(i, j, k); }

  /// Outside the grid the value at its nearest point, plus the distance from there.
  double operator()(const Vec3d& p) const;
  Level level(const Vec3d& p) const;
};

/// The function at the nodes of a grid over the box.
Field sampled(const std::function<double(const Vec3d&)>& f, const Vec3d& low, const Vec3d& high);

/// Signed distances to where `f` is zero, at most kBand: from each node to its foot, which is found
/// from the feet of its neighbours.
Field distances(const Field& f);

/// The Gaussian mean of this standard deviation, s.
Field blurred(const Field& f, double sigma);

/// Distances of the part of the solid that a ball of this radius (s) reaches without leaving it:
/// nothing is thinner than the ball.
Field opened(const Field& distances, double radius);

}  // namespace meniscus::accuracy
