#include "accuracy/truth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "accuracy/parallel.hpp"

namespace meniscus::accuracy {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMargin = 1.5;        // s; how far a crease or an outline reaches
constexpr double kJump = 1.0;          // s; neighbours whose depths differ by more are two layers
constexpr double kSameSurface = 0.95;  // dot product of neighbouring normals without a crease

/// Depth at which the ray of pixel (i, j) enters the solid (sphere tracing, Hart 1996).
double hit_depth(const Scene& scene, const Lens& lens, int i, int j) {
  constexpr double kTouch = 1e-7;  // s
  constexpr int kLongest = 2000;
  const Vec3d origin = lens.origin(i, j), direction = lens.direction(i, j);
  const double per_depth = length(direction);
  const Vec3d ray = direction / per_depth;
  const Vec3d to_centre = (scene.low + scene.high) / 2 - origin;
  const double radius = length(scene.high - scene.low) / 2;
  const double nearest = dot(to_centre, ray);
  const double room = radius * radius - dot(to_centre, to_centre) + nearest * nearest;
  if (room < 0) return kInfinity;
  double along = std::max(0.0, nearest - std::sqrt(room));
  const double last = nearest + std::sqrt(room);
  for (int step = 0; step < kLongest && along <= last; ++step) {
    const double distance = scene.distance(origin + along * ray);
    if (distance < kTouch) return along / per_depth;
    along += scene.safe_step * distance;
  }
  return kInfinity;
}

}  // namespace

std::vector<double> distance_to(const std::vector<bool>& set, int width, int height) {
  const auto at = [&](int x, int y) { return static_cast<std::size_t>(y) * width + x; };
  // Distance within the column first, then the best of the row's columns.
  std::vector<double> column(set.size(), kInfinity), nearest(set.size(), kInfinity);
  for (int x = 0; x < width; ++x) {
    for (int y = 0; y < height; ++y)
      column[at(x, y)] = set[at(x, y)] ? 0 : y > 0 ? column[at(x, y - 1)] + 1 : kInfinity;
    for (int y = height - 2; y >= 0; --y)
      column[at(x, y)] = std::min(column[at(x, y)], column[at(x, y + 1)] + 1);
  }
  for_each_index(height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      double best = kInfinity;  // squared
      for (int k = 0; k < width && k * k < best; ++k)
        for (const int other : {x - k, x + k})
          if (other >= 0 && other < width) {
            const double g = column[at(other, y)];
            best = std::min(best, k * k + g * g);
          }
      nearest[at(x, y)] = std::sqrt(best);
    }
  });
  return nearest;
}

double Truth::mean_scale() const {
  double sum = 0, count = 0;
  for (std::size_t p = 0; p < depth.size(); ++p)
    if (covered(p)) {
      sum += lens.scale(depth[p]);
      ++count;
    }
  return count > 0 ? sum / count : 0;
}

Truth trace(const Scene& scene, const Lens& lens) {
  const int width = lens.width, height = lens.height;
  const std::size_t pixels = static_cast<std::size_t>(width) * height;
  Truth truth{lens, std::vector<double>(pixels, kInfinity), std::vector<Vec3d>(pixels),
              std::vector<PixelClass>(pixels, PixelClass::none), std::vector<int>(pixels, -1)};
  for_each_index(height, [&](int j) {
    for (int i = 0; i < width; ++i) {
      const std::size_t p = static_cast<std::size_t>(j) * width + i;
      truth.depth[p] = hit_depth(scene, lens, i, j);
      if (truth.depth[p] < kInfinity)
        truth.normal[p] = outward(scene, lens.point(i, j, truth.depth[p]));
    }
  });

  std::vector<bool> outline(pixels), crease(pixels);
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) {
      const std::size_t p = static_cast<std::size_t>(j) * width + i;
      if (truth.depth[p] == kInfinity) continue;
      constexpr std::array<std::array<int, 2>, 4> kNeighbours{{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
      for (const auto& [di, dj] : kNeighbours) {
        const int x = i + di, y = j + dj;
        if (x < 0 || y < 0 || x >= width || y >= height) {
          outline[p] = true;
          continue;
        }
        const std::size_t q = static_cast<std::size_t>(y) * width + x;
        if (!(std::abs(truth.depth[p] - truth.depth[q]) <= kJump))
          outline[p] = true;
        else if (dot(truth.normal[p], truth.normal[q]) < kSameSurface)
          crease[p] = true;
      }
    }
  const auto to_outline = distance_to(outline, width, height);
  const auto to_crease = distance_to(crease, width, height);
  for (std::size_t p = 0; p < pixels; ++p) {
    if (truth.depth[p] == kInfinity) continue;
    const double margin = kMargin * lens.scale(truth.depth[p]);
    truth.class_of[p] = to_outline[p] < margin  ? PixelClass::silhouette
                        : to_crease[p] < margin ? PixelClass::crease
                                                : PixelClass::interior;
  }
  return truth;
}

}  // namespace meniscus::accuracy
