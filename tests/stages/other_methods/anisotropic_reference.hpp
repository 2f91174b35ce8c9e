// Anisotropic kernels and their field in double precision, from the equations of Yu and Turk.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "meniscus/parameters.hpp"
#include "stages/frame/project.hpp"
#include "verify/reference/density.hpp"

namespace meniscus::reference {

struct Kernel {
  Eigen::Vector3d centre;
  Eigen::Matrix3d shape;  // G
  double volume = 0;      // mass over density
  int neighbours = 0;     // within 2 h
  double least = 0;       // smallest stretch
  double margin = 1e9;    // how near a neighbour's distance came to 2 h, relative
};

inline Kernel shape_kernel(const Projected& particles, std::size_t i,
                           const AnisotropicParams& params) {
  const auto at = [&](std::size_t p) {
    return Eigen::Vector3d(particles.x[p], particles.y[p], particles.z[p]);
  };
  const double radius = 2 * params.h;
  Kernel kernel;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double total = 0, density = 0;
  for (std::size_t p = 0; p < particles.size(); ++p) {
    const double d = (at(p) - at(i)).norm();
    kernel.margin = std::min(kernel.margin, std::abs(d / radius - 1));
    if (d >= radius) continue;
    if (p != i) ++kernel.neighbours;
    const double w = 1 - std::pow(d / radius, 3);
    mean += w * at(p);
    total += w;
    density += cubic_spline(d / params.h) / std::pow(params.h, 3);
  }
  mean /= total;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t p = 0; p < particles.size(); ++p) {
    const double d = (at(p) - at(i)).norm();
    if (d < radius)
      covariance +=
          (1 - std::pow(d / radius, 3)) / total * (at(p) - mean) * (at(p) - mean).transpose();
  }
  kernel.centre = (1 - params.lambda) * at(i) + params.lambda * mean;
  kernel.volume = 1 / density;
  Eigen::Vector3d stretch = Eigen::Vector3d::Constant(params.k_n);
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  if (kernel.neighbours > params.n_eps) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
    axes = solver.eigenvectors();
    const Eigen::Vector3d variances = solver.eigenvalues();
    // A full ball of radius R with the weights 1 - (d/R)^3 has the variance 0.15 R^2.
    stretch = params.k_s / (0.15 * radius * radius) *
              variances.cwiseMax(variances.maxCoeff() / params.k_r);
    stretch = stretch.cwiseMin(1.25 * params.k_s);
  }
  kernel.least = stretch.minCoeff();
  kernel.shape = axes * stretch.cwiseInverse().asDiagonal() * axes.transpose() / params.h;
  return kernel;
}

/// The field and its gradient at a point, and the sum of the gradient's terms' lengths.
struct AnisotropicField {
  double value = 0;
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  double terms = 0;
  int count = 0;
};

inline AnisotropicField field_at(const std::vector<Kernel>& kernels, const Eigen::Vector3d& x) {
  AnisotropicField field;
  for (const Kernel& kernel : kernels) {
    const Eigen::Vector3d v = kernel.shape * (x - kernel.centre);
    const double q = v.norm(), scale = kernel.volume * kernel.shape.determinant();
    if (q >= 2) continue;
    ++field.count;
    field.value += scale * cubic_spline(q);
    const double a = 2 - q, b = std::max(1 - q, 0.0);
    const double slope = (-0.75 * a * a + 3 * b * b) / std::numbers::pi;
    if (q > 0) {
      const Eigen::Vector3d term = scale * slope / q * (kernel.shape * v);
      field.gradient += term;
      field.terms += term.norm();
    }
  }
  return field;
}

}  // namespace meniscus::reference
