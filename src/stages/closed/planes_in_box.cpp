#include "stages/closed/planes_in_box.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>

namespace meniscus {
namespace {

// Planes in the other coordinates, where these ones of x are fixed.
Planes with_fixed(const Planes& planes, const std::array<bool, 3>& fixed,
                  const Eigen::Vector3d& x) {
  Planes rest = planes;
  for (int k = 0; k < 3; ++k) {
    if (!fixed[k]) continue;
    rest.off -= planes.normals.col(k) * x[k];
    rest.normals.row(k).setZero();
    rest.normals.col(k).setZero();
  }
  for (int k = 0; k < 3; ++k)
    if (fixed[k]) rest.off[k] = 0;
  return rest;
}

}  // namespace

Eigen::Vector3d nearest_in_box(const Planes& planes, const Eigen::Vector3d& low, double side,
                               double flat, int* rank) {
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  std::array<bool, 3> fixed{};
  double most = 0;  // eigenvalue of all
  for (int round = 0; round < 4; ++round) {
    const Planes rest = with_fixed(planes, fixed, x);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(rest.normals);
    const Eigen::Vector3d values = solver.eigenvalues();
    if (round == 0) most = values[2];
    Eigen::Vector3d move = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      if (!(values[k] > flat * most)) continue;
      const Eigen::Vector3d v = solver.eigenvectors().col(k);
      move += v * (v.dot(rest.off) / values[k]);
      if (round == 0) ++*rank;
    }
    int farthest = -1;
    double beyond = 0;
    for (int k = 0; k < 3; ++k) {
      if (fixed[k]) continue;
      x[k] = move[k];
      const double over = std::max(low[k] - x[k], x[k] - low[k] - side);
      if (over > beyond) {
        beyond = over;
        farthest = k;
      }
    }
    if (farthest < 0) break;
    fixed[farthest] = true;
    x[farthest] = std::clamp(x[farthest], low[farthest], low[farthest] + side);
  }
  return x;
}

// The second round takes back most of what the first one falls short by: with a damping of .02 it
// leaves .3 % where a third of the planes fixes a direction.
Eigen::Vector3d nearest_damped(const Planes& planes, double damping) {
  const Eigen::Matrix3d inverse =
      (planes.normals + damping * planes.normals.trace() * Eigen::Matrix3d::Identity()).inverse();
  const Eigen::Vector3d x = inverse * planes.off;
  return x + inverse * (planes.off - planes.normals * x);
}

}  // namespace meniscus
