#include "accuracy/splash.hpp"

#include <algorithm>
#include <numbers>

#include "accuracy/random.hpp"

namespace meniscus::accuracy {
namespace {

/// Cubic spline of smoothing length s times s^3, at the distance q (s).
double spline(double q) {
  if (q >= 2) return 0;
  const double far = 2 - q;
  return (q < 1 ? 1 - 1.5 * q * q + 0.75 * q * q * q : 0.25 * far * far * far) / std::numbers::pi;
}

Vec3d random_direction(Random& random) {
  for (;;) {
    const Vec3d v = random.in_box({-1, -1, -1}, {1, 1, 1});
    if (dot(v, v) > 0.01 && dot(v, v) <= 1) return normalized(v);
  }
}

double nearest(const std::vector<Vec3d>& points, const Vec3d& p) {
  double least = 1e9;
  for (const Vec3d& q : points) least = std::min(least, length(p - q));
  return least;
}

/// A piece grown from `start`, particle by particle.
Piece grow(const Vec3d& start, int count, Random& random) {
  constexpr double kNearest = 0.8, kFarthest = 1.2;  // s
  Piece piece{start};
  while (static_cast<int>(piece.size()) < count) {
    const auto member = static_cast<std::size_t>(random.uniform(0, 1. * piece.size()));
    const Vec3d p = piece[member] + random.uniform(kNearest, kFarthest) * random_direction(random);
    if (nearest(piece, p) >= kNearest) piece.push_back(p);
  }
  return piece;
}

}  // namespace

std::vector<Piece> make_splash(const std::function<double(const Vec3d&)>& distance) {
  constexpr double kFromSolid = 3, kFarthest = 9, kFromOthers = 4;  // s
  Random random(20);
  std::vector<Piece> pieces;
  std::vector<Vec3d> particles;
  for (const int count : {1, 1, 1, 1, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6}) {
    for (;;) {
      // In front of the solid (y < 6) for the cameras, which look along +y.
      const Piece piece = grow(random.in_box({-16, -10, -8}, {16, 6, 10}), count, random);
      const bool fits = std::all_of(piece.begin(), piece.end(), [&](const Vec3d& p) {
        return distance(p) >= kFromSolid && distance(p) <= kFarthest &&
               nearest(particles, p) >= kFromOthers;
      });
      if (!fits) continue;
      particles.insert(particles.end(), piece.begin(), piece.end());
      pieces.push_back(piece);
      break;
    }
  }
  return pieces;
}

double density(const Piece& piece, const Vec3d& x) {
  double sum = 0;
  for (const Vec3d& p : piece) sum += spline(length(x - p));
  return sum;
}

double piece_distance(const Piece& piece, const Vec3d& x) {
  constexpr double kSteepest = 1 / std::numbers::pi;  // |W'| at 2/3 s, its largest
  return (spline(0.5) - density(piece, x)) / (kSteepest * static_cast<double>(piece.size()));
}

}  // namespace meniscus::accuracy
