// planes_in_box: the point in a box that is nearest to some planes, which is where dual contouring
// puts a vertex (the quadratic error function of Ju and others 2002).
#pragma once

#include <Eigen/Core>

namespace meniscus {

/// Planes n x = n p, all together: the x of the least squared distance from them solves
/// normals x = off.
struct Planes {
  Eigen::Matrix3d normals = Eigen::Matrix3d::Zero();  // sum of n n^T
  Eigen::Vector3d off = Eigen::Vector3d::Zero();      // sum of n (n p)
};

/// The x of the least squared distance from planes in a box, `low` to `low + side` along each axis.
/// Where it lies outside, the coordinate that is farthest beyond is fixed at the box's side, and
/// the others are found once more. Directions with at most `flat` of the largest eigenvalue are
/// left out; `rank`: how many are not.
Eigen::Vector3d nearest_in_box(const Planes& planes, const Eigen::Vector3d& low, double side,
                               double flat, int* rank);

/// About the same without a box and without eigenvalues (Tikhonov's damping): x is short in
/// directions that the planes fix by less than `damping` of all.
Eigen::Vector3d nearest_damped(const Planes& planes, double damping);

}  // namespace meniscus
