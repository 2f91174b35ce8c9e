// The kept triangles' depth in double precision: a loop over all triangles (paper 2.4.1).
#pragma once

#include <algorithm>
#include <cmath>

#include "stages/sheet/triangulate.hpp"
#include "verify/reference/epsilon.hpp"

namespace meniscus::reference {

/// Bounds of the nearest kept triangle's depth at the pixel coordinates (x, y); both infinite where
/// none can cover it. A triangle covers what its three barycentric coordinates put inside, give or
/// take 1e-5, and nothing beyond its corners' box. Only one bound is finite where rounding decides
/// whether it is covered.
struct TriangleDepth {
  double low = INFINITY, high = INFINITY;
};

inline TriangleDepth triangle_depth(const View& view, const Triangulation& mesh, double x,
                                    double y) {
  TriangleDepth bounds;
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    if (mesh.kind[t] != TriangleKind::kept) continue;
    const auto corner = [&](int k) { return static_cast<std::size_t>(mesh.triangle[t][k]); };
    const ScreenPoint &a = mesh.screen[corner(0)], &b = mesh.screen[corner(1)],
                      &c = mesh.screen[corner(2)];
    // Corners are rounded to floats, their differences from the first sample and the quotient too.
    const auto outside = [](double at, double p, double q, double r) {
      const double doubt = 4 * kEpsilon * (std::abs(at) + std::abs(p) + std::abs(q) + std::abs(r));
      return at < std::min({p, q, r}) - doubt || at > std::max({p, q, r}) + doubt;
    };
    if (outside(x, a.u, b.u, c.u) || outside(y, a.v, b.v, c.v)) continue;
    const double doubled = (b.u - a.u) * (c.v - a.v) - (c.u - a.u) * (b.v - a.v);
    const double p1 = (x - a.u) * (c.v - a.v), p2 = (c.u - a.u) * (y - a.v);
    const double q1 = (b.u - a.u) * (y - a.v), q2 = (x - a.u) * (b.v - a.v);
    const double l[3] = {1 - (p1 - p2 + q1 - q2) / doubled, (p1 - p2) / doubled,
                         (q1 - q2) / doubled};
    // Differences, products, their difference, the area's four products and its reciprocal round:
    // ten epsilon of the products over the area, and as much of the area's own terms.
    const double size = std::abs(p1) + std::abs(p2) + std::abs(q1) + std::abs(q2);
    const double spread =
        (std::abs((b.u - a.u) * (c.v - a.v)) + std::abs((c.u - a.u) * (b.v - a.v))) /
        std::abs(doubled);
    const double error = 10 * kEpsilon * (size / std::abs(doubled)) * (1 + spread) + 3 * kEpsilon;
    const double least = std::min({l[0], l[1], l[2]});
    if (least < -1e-5 - error) continue;
    double depth = 0, nearest = INFINITY, farthest = 0;
    for (int k = 0; k < 3; ++k) {
      const double at = -mesh.position[corner(k)].z;
      depth += l[k] * (view.orthographic ? at : 1 / at);
      nearest = std::min(nearest, at);
      farthest = std::max(farthest, at);
    }
    if (!view.orthographic) depth = 1 / depth;
    // Three coordinates off by `error`, each times a corner; in perspective the corners'
    // reciprocals, whose error the last reciprocal multiplies by depth squared.
    const double wrong = 3 * error * farthest * farthest / nearest + 12 * kEpsilon * farthest;
    bounds.low = std::min(bounds.low, depth - wrong);
    // The box is rounded, too: samples within a hair of an edge may be missed.
    if (least > error) bounds.high = std::min(bounds.high, depth + wrong);
  }
  return bounds;
}

}  // namespace meniscus::reference
