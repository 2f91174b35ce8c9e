#include "accuracy/figures.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "accuracy/figures/lines.hpp"
#include "accuracy/figures/pieces.hpp"
#include "accuracy/figures/splash.hpp"
#include "meniscus/error.hpp"

namespace meniscus::accuracy {
namespace {

int count_holes(const Truth& truth, const std::vector<bool>& covered) {
  const Pieces pieces = find_pieces(truth.lens.width, truth.lens.height,
                                    [&](int p, int q) { return covered[p] == covered[q]; });
  std::vector<int> on_surface(pieces.size.size(), 0);
  for (std::size_t p = 0; p < covered.size(); ++p)
    if (!covered[p] && truth.covered(p)) ++on_surface[pieces.label[p]];
  int holes = 0;
  for (std::size_t k = 0; k < on_surface.size(); ++k)
    if (!pieces.at_border[k] && 2 * on_surface[k] > pieces.size[k]) ++holes;
  return holes;
}

/// Covered pixels with a neighbour that is not.
std::vector<bool> outline_of(const std::vector<bool>& covered, int width, int height) {
  std::vector<bool> outline(covered.size());
  for (int y = 1; y < height - 1; ++y)
    for (int x = 1; x < width - 1; ++x) {
      const std::size_t p = static_cast<std::size_t>(y) * width + x;
      outline[p] = covered[p] &&
                   !(covered[p - 1] && covered[p + 1] && covered[p - width] && covered[p + width]);
    }
  return outline;
}

double outline_distance(const Truth& truth, const std::vector<bool>& covered) {
  const int width = truth.lens.width, height = truth.lens.height;
  std::vector<bool> wanted(covered.size());
  for (std::size_t p = 0; p < covered.size(); ++p) wanted[p] = truth.covered(p);
  const auto ours = outline_of(covered, width, height), theirs = outline_of(wanted, width, height);
  const auto to_ours = distance_to(ours, width, height);
  const auto to_theirs = distance_to(theirs, width, height);
  Moments distance;
  for (std::size_t p = 0; p < covered.size(); ++p) {
    if (theirs[p] && std::isfinite(to_ours[p])) distance.add(to_ours[p]);
    if (ours[p] && std::isfinite(to_theirs[p])) distance.add(to_theirs[p]);
  }
  return distance.mean() / truth.mean_scale();
}

/// Pixels with their neighbours on the right and below.
template <class Visit>
void for_each_pair(int width, std::size_t pixels, const Visit& visit) {
  for (std::size_t p = 0; p < pixels; ++p)
    for (const std::size_t q : {p + 1, p + width})
      if (q < pixels && (q != p + 1 || q % width != 0)) visit(p, q);
}

/// The angles between the normals of neighbouring interior pixels, less the angle that the truth
/// has there.
std::vector<double> normal_jumps(const Truth& truth, const Map& map) {
  std::vector<double> jumps;
  if (map.normal.empty()) return jumps;
  for_each_pair(truth.lens.width, map.depth.size(), [&](std::size_t p, std::size_t q) {
    if (truth.class_of[p] != PixelClass::interior || truth.class_of[q] != PixelClass::interior ||
        map.normal[p] == Vec3{} || map.normal[q] == Vec3{})
      return;
    jumps.push_back(std::max(0.0, angle_between(Vec3d(map.normal[p]), Vec3d(map.normal[q])) -
                                      angle_between(truth.normal[p], truth.normal[q])));
  });
  return jumps;
}

/// Covered pixels whose normal does not face the eye.
double count_averted(const Lens& lens, const Map& map) {
  if (map.normal.empty()) return kNone;
  double averted = 0;
  for (std::size_t p = 0; p < map.depth.size(); ++p) {
    if (finite(map.depth[p]) && !(dot(Vec3d(map.normal[p]), lens.direction(p)) < 0)) ++averted;
  }
  return averted;
}

/// What is wrong at single pixels.
struct PixelErrors {
  Moments along_normal, depth, crease_depth, outline_depth;                            // s
  std::vector<double> along_normal_sizes;                                              // s
  std::vector<double> angles, slope_angles, crease_angles, crease_slopes, rim_angles;  // degrees
  double outliers = 0;          // interior pixels whose depth is off by more than s
  double both = 0, either = 0;  // pixels that map and truth cover
  std::vector<bool> covered;    // by the map
};

PixelErrors errors_of(const Truth& truth, const Map& map) {
  const Lens& lens = truth.lens;
  const auto slopes = normals_of_depth(lens, map.depth);
  PixelErrors e;
  e.covered.resize(map.depth.size());
  for (std::size_t p = 0; p < map.depth.size(); ++p) {
    e.covered[p] = finite(map.depth[p]);
    e.both += e.covered[p] && truth.covered(p);
    e.either += e.covered[p] || truth.covered(p);
    if (!e.covered[p] || !truth.covered(p)) continue;
    const Vec3d& normal = truth.normal[p];
    const double error = map.depth[p] - truth.depth[p];
    const auto add_angle = [&](std::vector<double>& angles_of) {
      if (!map.normal.empty() && map.normal[p] != Vec3{})
        angles_of.push_back(angle_between(Vec3d(map.normal[p]), normal));
    };
    const auto add_slope = [&](std::vector<double>& slopes_of) {
      if (slopes[p] != Vec3d{}) slopes_of.push_back(angle_between(slopes[p], normal));
    };
    switch (truth.class_of[p]) {
      case PixelClass::interior: {
        const double error_along_normal = error * std::abs(dot(normal, lens.direction(p)));
        e.along_normal.add(clamped(error_along_normal));
        e.along_normal_sizes.push_back(std::abs(error_along_normal));
        e.depth.add(clamped(error));
        e.outliers += std::abs(error) > 1;
        add_angle(e.angles);
        add_slope(e.slope_angles);
        break;
      }
      case PixelClass::crease:
        e.crease_depth.add(clamped(error));
        add_angle(e.crease_angles);
        add_slope(e.crease_slopes);
        break;
      case PixelClass::silhouette:
        e.outline_depth.add(clamped(error));
        add_angle(e.rim_angles);
        break;
      case PixelClass::splash:
      case PixelClass::none:
        break;
    }
  }
  return e;
}

}  // namespace

void require_same_size(const Truth& truth, const Map& map) {
  require(map.depth.size() == truth.depth.size() &&
              (map.normal.empty() || map.normal.size() == truth.depth.size()),
          "compare: the map has " + std::to_string(map.depth.size()) + " depths and " +
              std::to_string(map.normal.size()) + " normals, the truth has " +
              std::to_string(truth.depth.size()) + " pixels");
}

std::vector<Vec3d> normals_of_depth(const Lens& lens, const std::vector<float>& depth) {
  std::vector<Vec3d> normals(depth.size());
  for (int y = 0; y < lens.height; ++y)
    for (int x = 0; x < lens.width; ++x) {
      const auto at = [&](int i, int j) { return static_cast<std::size_t>(j) * lens.width + i; };
      const double here = depth[at(x, y)];
      if (!finite(here)) continue;
      const auto usable = [&](int i, int j) {
        return i >= 0 && j >= 0 && i < lens.width && j < lens.height &&
               std::abs(depth[at(i, j)] - here) < kJump;
      };
      const auto point = [&](int i, int j) { return lens.point(i, j, depth[at(i, j)]); };
      const int left = usable(x - 1, y) ? x - 1 : x, right = usable(x + 1, y) ? x + 1 : x;
      const int up = usable(x, y - 1) ? y - 1 : y, down = usable(x, y + 1) ? y + 1 : y;
      if (left == right || up == down) continue;
      const Vec3d normal =
          normalized(cross(point(x, down) - point(x, up), point(right, y) - point(left, y)));
      normals[at(x, y)] = dot(normal, lens.direction(x, y)) > 0 ? -normal : normal;
    }
  return normals;
}

double torn_share(const Truth& truth, const Map& map) {
  std::vector<bool> torn(map.depth.size());
  for_each_pair(truth.lens.width, map.depth.size(), [&](std::size_t p, std::size_t q) {
    const float a = map.depth[p], b = map.depth[q];
    if (finite(a) == finite(b) && (!finite(a) || std::abs(a - b) <= kJump)) return;
    torn[p] = torn[q] = true;
  });
  double count = 0, all = 0;
  for (std::size_t p = 0; p < torn.size(); ++p) {
    if (truth.class_of[p] != PixelClass::interior && truth.class_of[p] != PixelClass::crease)
      continue;
    ++all;
    // Nothing is infinitely far away.
    count += torn[p] || !(std::abs(map.depth[p] - truth.depth[p]) <= kJump);
  }
  return all > 0 ? 100 * count / all : kNone;
}

int count_specks(const Truth& truth, const Map& map) {
  const Pieces ours = find_layers(truth.lens, map.depth);
  const Pieces theirs = find_layers(truth.lens, truth.depth);
  std::vector<bool> in_truth(ours.size.size());
  for (std::size_t p = 0; p < ours.label.size(); ++p)
    if (theirs.size[theirs.label[p]] <= kSpeckPixels) in_truth[ours.label[p]] = true;
  int specks = 0;
  for (std::size_t k = 0; k < ours.size.size(); ++k)
    if (ours.size[k] <= kSpeckPixels && !in_truth[k]) ++specks;
  return specks;
}

Figures compare(const Truth& truth, const Map& map) {
  require_same_size(truth, map);
  PixelErrors e = errors_of(truth, map);
  Figures f;
  f.normal_rms = e.along_normal.rms();
  f.normal_p95 = percentile(e.along_normal_sizes, 0.95);
  f.normal_bias = e.along_normal.mean();
  f.depth_rms = e.depth.rms();
  f.outliers = e.depth.count > 0 ? 100 * e.outliers / e.depth.count : kNone;
  f.angle_median = percentile(e.angles, 0.5);
  f.angle_p95 = percentile(e.angles, 0.95);
  f.slope_median = percentile(e.slope_angles, 0.5);
  f.slope_p95 = percentile(e.slope_angles, 0.95);
  f.crease_rms = e.crease_depth.rms();
  f.crease_angle = percentile(e.crease_angles, 0.5);
  f.crease_slope = percentile(e.crease_slopes, 0.5);
  f.outline_rms = e.outline_depth.rms();
  f.rim_angle = percentile(e.rim_angles, 0.5);
  f.outline_miss = outline_distance(truth, e.covered);
  f.iou = e.either > 0 ? e.both / e.either : kNone;
  f.holes = count_holes(truth, e.covered);
  f.specks = 1e6 * count_specks(truth, map) / static_cast<double>(map.depth.size());
  f.averted = count_averted(truth.lens, map);
  std::vector<double> jumps = normal_jumps(truth, map);
  Moments turn;
  for (const double jump : jumps) turn.add(jump);
  f.rough = turn.mean();
  f.jump_p999 = percentile(jumps, 0.999);
  f.torn = torn_share(truth, map);
  const Straightness outline = outline_straightness(truth, map);
  f.outline_jag = outline.jag;
  f.outline_lost = outline.lost;
  const Straightness crease = crease_straightness(truth, map);
  f.crease_jag = crease.jag;
  f.crease_lost = crease.lost;
  const Splash splash = splash_figures(truth, map);
  f.splash_covered = splash.covered;
  f.splash_missing = splash.missing;
  f.splash_doubled = splash.doubled;
  f.splash_closed = splash.closed;
  return f;
}

Figures mean(std::span<const Figures> figures) {
  Figures result;
  for (const FigureField& field : figure_fields()) {
    Moments values;
    for (const Figures& f : figures)
      if (!std::isnan(f.*field.value)) values.add(f.*field.value);
    result.*field.value = values.mean();
  }
  return result;
}

}  // namespace meniscus::accuracy
