#include "accuracy/figures/lines.hpp"

#include <array>
#include <optional>

#include "accuracy/figures.hpp"
#include "accuracy/parallel.hpp"

namespace meniscus::accuracy {
namespace {

constexpr double kBlur = 0.7;           // pixels; of the fields
constexpr double kNormalBlur = 2;       // pixels; of the true line's normal
constexpr double kReach = 1.5;          // s; a map's line farther away is another one
constexpr double kHalfWindow = 2;       // s; of the smooth part, along the line
constexpr double kBeside = 0.5;         // s; points of one line lie this near to its tangent
constexpr double kSameDirection = 0.9;  // cosine; ... and have normals this near
constexpr double kShortest = 2;         // s; shorter pieces of line have no smooth part
constexpr double kOneFace = 0.99;       // cosine of normals of one face two pixels apart
constexpr double kTwoFaces = 0.95;      // ... of two faces
constexpr int kMargin = 4;              // pixels; lines nearer to the image's border do not count

/// A point of a true line, and where the map has it.
struct LinePoint {
  double x = 0, y = 0;       // pixel centres are whole numbers
  double nx = 0, ny = 0;     // the line's unit normal on the screen
  double scale = 0;          // pixels per s
  double deviation = kNone;  // s, along the normal; NaN: the map has no such line here
};

/// A pixel beside a true line, and the field that tells its two sides.
struct Seed {
  int x, y;
  double threshold;  // of a silhouette
  Vec3d difference;  // n1 - n2 of a crease, over its square
};

/// `field(i, j)` blurred around (x, y); pixels where it is NaN do not count.
template <class Field>
double blurred(const Lens& lens, const Field& field, double x, double y, double sigma) {
  constexpr int kLargest = 16;
  const int reach = static_cast<int>(std::ceil(3 * sigma));
  const int left = static_cast<int>(std::floor(x)) - reach,
            top = static_cast<int>(std::floor(y)) - reach;
  std::array<double, kLargest> across, down;
  for (int k = 0; k < 2 * reach + 2; ++k) {
    across[k] = std::exp(-(left + k - x) * (left + k - x) / (2 * sigma * sigma));
    down[k] = std::exp(-(top + k - y) * (top + k - y) / (2 * sigma * sigma));
  }
  double sum = 0, weight = 0;
  for (int j = std::max(top, 0); j < std::min(top + 2 * reach + 2, lens.height); ++j)
    for (int i = std::max(left, 0); i < std::min(left + 2 * reach + 2, lens.width); ++i) {
      const double value = field(i, j), w = across[i - left] * down[j - top];
      if (std::isnan(value)) continue;
      sum += w * value;
      weight += w;
    }
  return weight > 1e-3 ? sum / weight : kNone;
}

/// Signed distance (pixels) along (nx, ny) to the nearest place where the field falls through 0.
template <class Field>
std::optional<double> crossing(const Lens& lens, const Field& field, const LinePoint& from) {
  constexpr double kStep = 0.5;  // pixels
  const auto at = [&](double t) {
    return blurred(lens, field, from.x + t * from.nx, from.y + t * from.ny, kBlur);
  };
  const auto zero = [&](double t, double low, double high) -> std::optional<double> {
    if (!(low > 0 && high <= 0)) return std::nullopt;
    return t + kStep * low / (low - high);
  };
  double inner = at(0), outer = inner;
  for (double t = 0; t < kReach * from.scale; t += kStep) {
    const double further = at(t + kStep), nearer = at(-t - kStep);
    const auto beyond = zero(t, outer, further), before = zero(-t - kStep, nearer, inner);
    if (beyond && before) return *beyond <= -*before ? beyond : before;
    if (beyond || before) return beyond ? beyond : before;
    outer = further;
    inner = nearer;
  }
  return std::nullopt;
}

/// Finds the true line and the map's at each seed.
template <class TruthField, class MapField>
std::vector<LinePoint> follow(const Truth& truth, const std::vector<Seed>& seeds,
                              const TruthField& truth_field, const MapField& map_field) {
  std::vector<LinePoint> points(seeds.size());
  for_each_index(static_cast<int>(seeds.size()), [&](int k) {
    const Lens& lens = truth.lens;
    const Seed& seed = seeds[k];
    const auto ours = [&](int i, int j) { return map_field(seed, i, j); };
    const auto wanted = [&](int i, int j) { return truth_field(seed, i, j); };
    const auto smooth = [&](double dx, double dy) {
      return blurred(lens, wanted, seed.x + dx, seed.y + dy, kNormalBlur);
    };
    LinePoint& point = points[k];
    point.nx = smooth(-1, 0) - smooth(1, 0);
    point.ny = smooth(0, -1) - smooth(0, 1);
    const double slope = std::hypot(point.nx, point.ny);
    if (!(slope > 1e-6)) return;
    point.nx /= slope;
    point.ny /= slope;
    point.x = seed.x;
    point.y = seed.y;
    const double scale =
        lens.scale(truth.depth[static_cast<std::size_t>(seed.y) * lens.width + seed.x]);
    point.scale = scale;
    const auto own = crossing(lens, wanted, point);
    if (!own || std::abs(*own) > 2) {  // pixels: the seed is beside its line
      point.scale = 0;
      return;
    }
    // Both from the same place, so that a perfect map deviates by nothing.
    if (const auto found = crossing(lens, ours, point)) point.deviation = (*found - *own) / scale;
    point.x += *own * point.nx;
    point.y += *own * point.ny;
  });
  std::erase_if(points, [](const LinePoint& point) { return point.scale == 0; });
  return points;
}

/// What is left of the deviation at `here` without its smooth part; NaN: too little line around.
double rough_part(const std::vector<LinePoint>& points, const LinePoint& here) {
  double n = 0, sum_a = 0, sum_v = 0, sum_aa = 0, sum_av = 0, first = 0, last = 0;
  for (const LinePoint& other : points) {
    const double dx = (other.x - here.x) / here.scale, dy = (other.y - here.y) / here.scale;
    if (std::abs(dx) > 2 * kHalfWindow || std::abs(dy) > 2 * kHalfWindow) continue;
    const double along = dx * -here.ny + dy * here.nx, beside = dx * here.nx + dy * here.ny;
    if (std::abs(along) > kHalfWindow || std::abs(beside) > kBeside ||
        other.nx * here.nx + other.ny * here.ny < kSameDirection || std::isnan(other.deviation))
      continue;
    ++n;
    sum_a += along;
    sum_v += other.deviation;
    sum_aa += along * along;
    sum_av += along * other.deviation;
    first = std::min(first, along);
    last = std::max(last, along);
  }
  if (n < 8 || last - first < kShortest) return kNone;
  const double spread = sum_aa - sum_a * sum_a / n;
  const double slope = spread > 0 ? (sum_av - sum_a * sum_v / n) / spread : 0;
  return here.deviation - (sum_v - slope * sum_a) / n;
}

Straightness straightness(const std::vector<LinePoint>& points) {
  Straightness result;
  if (points.empty()) return result;
  std::vector<double> rough(points.size(), kNone);
  for_each_index(static_cast<int>(points.size()), [&](int k) {
    if (!std::isnan(points[k].deviation)) rough[k] = rough_part(points, points[k]);
  });
  Moments jag;
  double lost = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (!std::isnan(rough[k])) jag.add(rough[k]);
    lost += std::isnan(points[k].deviation);
  }
  result.jag = jag.rms();
  result.lost = 100 * lost / static_cast<double>(points.size());
  return result;
}

template <class Visit>
void for_pixels_inside(const Lens& lens, const Visit& visit) {
  for (int y = kMargin; y < lens.height - kMargin; ++y)
    for (int x = kMargin; x < lens.width - kMargin; ++x) visit(x, y);
}

}  // namespace

Straightness outline_straightness(const Truth& truth, const Map& map) {
  const Lens& lens = truth.lens;
  const auto at = [&](int x, int y) { return static_cast<std::size_t>(y) * lens.width + x; };
  std::vector<Seed> seeds;
  for_pixels_inside(lens, [&](int x, int y) {
    const double here = truth.depth[at(x, y)];
    if (truth.class_of[at(x, y)] != PixelClass::silhouette) return;
    double behind = 0;
    for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
      const double next = truth.depth[at(x + dx, y + dy)];
      const double beyond = truth.depth[at(x + 2 * dx, y + 2 * dy)];
      // A steep limb, too, falls by more than s in a pixel, but it falls on.
      if (!finite(next) || (next - here > kJump && std::abs(beyond - next) < kJump / 2))
        behind = std::max(behind, next);
    }
    if (behind > 0) seeds.push_back({x, y, finite(behind) ? (here + behind) / 2 : behind, {}});
  });
  const auto field = [&](const auto& depth) {
    return [&](const Seed& seed, int i, int j) {
      return depth[at(i, j)] < seed.threshold ? 0.5 : -0.5;
    };
  };
  return straightness(follow(truth, seeds, field(truth.depth), field(map.depth)));
}

Straightness crease_straightness(const Truth& truth, const Map& map) {
  const Lens& lens = truth.lens;
  const auto at = [&](int x, int y) { return static_cast<std::size_t>(y) * lens.width + x; };
  std::vector<Seed> seeds;
  for_pixels_inside(lens, [&](int x, int y) {
    const std::size_t p = at(x, y);
    if (truth.class_of[p] != PixelClass::crease) return;
    for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}}) {
      const std::size_t q = at(x + dx, y + dy);
      const std::size_t before = at(x - 2 * dx, y - 2 * dy), behind = at(x + 3 * dx, y + 3 * dy);
      const Vec3d &n = truth.normal[p], &m = truth.normal[q];
      if (truth.class_of[q] != PixelClass::crease || dot(n, m) >= kTwoFaces ||
          dot(n, truth.normal[before]) < kOneFace || dot(m, truth.normal[behind]) < kOneFace)
        continue;
      seeds.push_back({x, y, 0, (n - m) / dot(n - m, n - m)});
    }
  });
  if (seeds.empty()) return {};
  const auto field = [&](const auto& normal) {
    return [&](const Seed& seed, int i, int j) {
      const Vec3d n(normal[at(i, j)]);
      return n == Vec3d{} ? kNone : dot(n, seed.difference);
    };
  };
  return straightness(
      map.normal.empty()
          ? follow(truth, seeds, field(truth.normal), field(normals_of_depth(lens, map.depth)))
          : follow(truth, seeds, field(truth.normal), field(map.normal)));
}

}  // namespace meniscus::accuracy
