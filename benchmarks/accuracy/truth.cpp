#include "accuracy/truth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "accuracy/parallel.hpp"

namespace meniscus::accuracy {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMargin = 1.5;        // s; how far a crease or an outline reaches
constexpr double kJump = 1.0;          // s; neighbours whose depths differ by more are two layers
constexpr double kSameSurface = 0.95;  // dot product of neighbouring normals without a crease

/// A solid in a ball; `distance` never reaches beyond its surface.
struct Solid {
  std::function<double(const Vec3d&)> distance;  // s
  Vec3d centre;
  double radius;  // s
};

Solid bulk_of(const Scene& scene) {
  return {[&](const Vec3d& p) { return scene.safe_step * scene.distance(p); },
          (scene.low + scene.high) / 2, length(scene.high - scene.low) / 2};
}

Solid solid_of(const Piece& piece) {
  double reach = 0;
  for (const Vec3d& p : piece) reach = std::max(reach, length(p - piece[0]));
  // The field of a particle ends 2 s from it.
  return {[&](const Vec3d& p) { return piece_distance(piece, p); }, piece[0], reach + 2};
}

/// Depth at which the ray of pixel (i, j) enters the solid (sphere tracing, Hart 1996).
double hit_depth(const Solid& solid, const Lens& lens, int i, int j) {
  constexpr double kTouch = 1e-7;  // s
  constexpr int kLongest = 2000;
  const Vec3d origin = lens.origin(i, j), direction = lens.direction(i, j);
  const double per_depth = length(direction);
  const Vec3d ray = direction / per_depth;
  const Vec3d to_centre = solid.centre - origin;
  const double nearest = dot(to_centre, ray);
  const double room = solid.radius * solid.radius - dot(to_centre, to_centre) + nearest * nearest;
  if (room < 0) return kInfinity;
  double along = std::max(0.0, nearest - std::sqrt(room));
  const double last = nearest + std::sqrt(room);
  for (int step = 0; step < kLongest && along <= last; ++step) {
    const double distance = solid.distance(origin + along * ray);
    if (distance < kTouch) return along / per_depth;
    along += distance;
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

Map map_of(const Truth& truth) {
  Map map;
  for (std::size_t p = 0; p < truth.depth.size(); ++p) {
    map.depth.push_back(static_cast<float>(truth.depth[p]));
    map.normal.push_back(static_cast<Vec3>(truth.normal[p]));
  }
  return map;
}

Truth trace(const Scene& scene, const Lens& lens) {
  const int width = lens.width, height = lens.height;
  const std::size_t pixels = static_cast<std::size_t>(width) * height;
  Truth truth{lens, std::vector<double>(pixels, kInfinity), std::vector<Vec3d>(pixels),
              std::vector<PixelClass>(pixels, PixelClass::none), std::vector<int>(pixels, -1)};
  truth.splash_pieces = static_cast<int>(scene.splash.size());
  std::vector<Solid> solids;  // the pieces, then the bulk
  for (const Piece& piece : scene.splash) solids.push_back(solid_of(piece));
  solids.push_back(bulk_of(scene));
  for_each_index(height, [&](int j) {
    for (int i = 0; i < width; ++i) {
      const std::size_t p = static_cast<std::size_t>(j) * width + i;
      int nearest = -1;
      for (int k = 0; k <= truth.splash_pieces; ++k) {
        const double depth = hit_depth(solids[k], lens, i, j);
        if (depth >= truth.depth[p]) continue;
        truth.depth[p] = depth;
        nearest = k;
      }
      if (nearest < 0) continue;
      truth.normal[p] = outward(solids[nearest].distance, lens.point(i, j, truth.depth[p]));
      if (nearest < truth.splash_pieces) truth.piece[p] = nearest;
    }
  });

  const bool has_creases = scene.use == Use::calm;  // violent solids are round
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
        else if (has_creases && dot(truth.normal[p], truth.normal[q]) < kSameSurface)
          crease[p] = true;
      }
    }
  const auto to_outline = distance_to(outline, width, height);
  const auto to_crease = distance_to(crease, width, height);
  for (std::size_t p = 0; p < pixels; ++p) {
    if (truth.depth[p] == kInfinity) continue;
    const double margin = kMargin * lens.scale(truth.depth[p]);
    truth.class_of[p] = truth.piece[p] >= 0      ? PixelClass::splash
                        : to_outline[p] < margin ? PixelClass::silhouette
                        : to_crease[p] < margin  ? PixelClass::crease
                                                 : PixelClass::interior;
  }
  return truth;
}

}  // namespace meniscus::accuracy
