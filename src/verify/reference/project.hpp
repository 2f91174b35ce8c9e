// Projection in double precision, from the camera's matrices (paper 2.1).
#pragma once

#include <array>
#include <cmath>

#include "meniscus/types.hpp"
#include "verify/reference/epsilon.hpp"

namespace meniscus::reference {

struct ProjectedParticle {
  std::array<double, 3> eye;         // particle radii
  double u, v;                       // pixels
  double ku, kv;                     // pixels that the particle's own radius spans
  std::array<double, 3> eye_error;   // bounds of what single precision adds
  double u_error, v_error, k_error;  // the last one relative
};

/// clip = P V x; r_x = r W |P0.xyz| / (2 c_w), r_y alike (rows of P; r the particle's own radius).
///
///   origin   subtracted first: exact in float, as are the particle's coordinates
///   epsilon  relative error of one rounding
inline ProjectedParticle project(const Camera& camera, double radius,
                                 const std::array<double, 3>& origin,
                                 const std::array<double, 3>& world, double scale, double epsilon) {
  const auto& V = camera.view;
  const auto& P = camera.projection;
  ProjectedParticle result;
  std::array<double, 4> eye{0, 0, 0, 1};  // world units
  std::array<double, 4> eye_error{};
  for (int r = 0; r < 3; ++r) {
    // In single precision: rotation (x - origin) / radius + shift. A term suffers the rounding of
    // its coefficient, its difference, its product and at most three sums.
    double shift = V[r * 4 + 3], terms = 0;
    eye[r] = V[r * 4 + 3];
    for (int c = 0; c < 3; ++c) {
      eye[r] += V[r * 4 + c] * world[c];
      shift += V[r * 4 + c] * origin[c];
      terms += std::abs(V[r * 4 + c] * (world[c] - origin[c]));
    }
    eye_error[r] = 6 * epsilon * (terms + std::abs(shift));
    result.eye[r] = eye[r] / radius;
    result.eye_error[r] = eye_error[r] / radius;
  }
  struct Value {
    double value = 0, error = 0;
  };
  // A row of coefficients times (eye, 1): coefficient, product and three sums round.
  const auto apply = [&](const std::array<double, 4>& row) {
    Value sum;
    for (int c = 0; c < 4; ++c) {
      sum.value += row[c] * eye[c];
      sum.error += std::abs(row[c]) * (eye_error[c] + 5 * epsilon * std::abs(eye[c]));
    }
    return sum;
  };
  std::array<double, 4> u_row, v_row, w_row;
  for (int c = 0; c < 4; ++c) {
    w_row[c] = P[12 + c];
    u_row[c] = 0.5 * camera.width * (P[12 + c] + P[c]);
    v_row[c] = 0.5 * camera.height * (P[12 + c] - P[4 + c]);
  }
  const Value u = apply(u_row), v = apply(v_row), w = apply(w_row);
  result.u = u.value / w.value;
  result.v = v.value / w.value;
  result.u_error =
      (u.error + std::abs(result.u) * w.error) / w.value + epsilon * std::abs(result.u);
  result.v_error =
      (v.error + std::abs(result.v) * w.error) / w.value + epsilon * std::abs(result.v);
  const double r = radius * scale;
  result.ku = r * camera.width * std::hypot(P[0], P[1], P[2]) / (2 * w.value);
  result.kv = r * camera.height * std::hypot(P[4], P[5], P[6]) / (2 * w.value);
  result.k_error = w.error / w.value + 4 * epsilon;  // extent, scale, product, quotient
  return result;
}

}  // namespace meniscus::reference
