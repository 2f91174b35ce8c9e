#include "accuracy/figures.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "meniscus/error.hpp"

namespace meniscus::accuracy {
namespace {

constexpr double kClamp = 2;     // s; larger errors count as this
constexpr double kJump = 1;      // s; neighbours whose depths differ by more are two layers
constexpr int kSpeckPixels = 8;  // a piece of at most this many pixels is a speck

bool finite(double depth) { return depth < std::numeric_limits<double>::infinity(); }

double clamped(double error) { return std::clamp(error, -kClamp, kClamp); }

/// The value below which `share` of the values lie; NaN: there are none.
double percentile(std::vector<double>& values, double share) {
  if (values.empty()) return Figures::kNone;
  const auto k = std::min(values.size() - 1, static_cast<std::size_t>(share * values.size()));
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return values[k];
}

/// Root of the mean square and mean of what was added.
struct Moments {
  double square = 0, sum = 0, count = 0;
  void add(double value) {
    square += value * value;
    sum += value;
    ++count;
  }
  double rms() const { return count > 0 ? std::sqrt(square / count) : Figures::kNone; }
  double mean() const { return count > 0 ? sum / count : Figures::kNone; }
};

/// Degrees; exact for small angles, where an arc cosine is not.
double angle_between(const Vec3d& a, const Vec3d& b) {
  return std::atan2(length(cross(a, b)), dot(a, b)) * 180 / std::numbers::pi;
}

/// Pieces of pixels that hang together.
struct Pieces {
  std::vector<int> label;  // [pixel] index into `size`
  std::vector<int> size;   // [piece] pixels
  std::vector<bool> at_border;
};

/// `joined(p, q)`: whether the neighbours p and q belong to one piece.
template <class Joined>
Pieces find_pieces(int width, int height, const Joined& joined) {
  const int pixels = width * height;
  Pieces pieces;
  pieces.label.assign(pixels, -1);
  std::vector<int> open;
  for (int seed = 0; seed < pixels; ++seed) {
    if (pieces.label[seed] >= 0) continue;
    const int piece = static_cast<int>(pieces.size.size());
    pieces.size.push_back(0);
    pieces.at_border.push_back(false);
    pieces.label[seed] = piece;
    open.assign(1, seed);
    while (!open.empty()) {
      const int p = open.back(), x = p % width, y = p / width;
      open.pop_back();
      ++pieces.size[piece];
      if (x == 0 || y == 0 || x == width - 1 || y == height - 1) pieces.at_border[piece] = true;
      const auto visit = [&](int q) {
        if (pieces.label[q] >= 0 || !joined(p, q)) return;
        pieces.label[q] = piece;
        open.push_back(q);
      };
      if (x > 0) visit(p - 1);
      if (x < width - 1) visit(p + 1);
      if (y > 0) visit(p - width);
      if (y < height - 1) visit(p + width);
    }
  }
  return pieces;
}

template <class Depth>
Pieces find_layers(const Lens& lens, const Depth& depth) {
  return find_pieces(lens.width, lens.height, [&](int p, int q) {
    const bool a = finite(depth[p]), b = finite(depth[q]);
    return a == b && (!a || std::abs(static_cast<double>(depth[p]) - depth[q]) <= kJump);
  });
}

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

void require_same_size(const Truth& truth, const Map& map) {
  require(map.depth.size() == truth.depth.size() &&
              (map.normal.empty() || map.normal.size() == truth.depth.size()),
          "compare: the map has " + std::to_string(map.depth.size()) + " depths and " +
              std::to_string(map.normal.size()) + " normals, the truth has " +
              std::to_string(truth.depth.size()) + " pixels");
}

}  // namespace

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
  const Lens& lens = truth.lens;
  const auto slopes = normals_of_depth(lens, map.depth);
  Moments along_normal, depth, crease_depth, outline_depth;
  std::vector<double> along_normal_sizes, angles, slope_angles, crease_angles, crease_slopes;
  double outliers = 0, both = 0, either = 0;
  std::vector<bool> covered(map.depth.size());
  for (std::size_t p = 0; p < map.depth.size(); ++p) {
    covered[p] = finite(map.depth[p]);
    both += covered[p] && truth.covered(p);
    either += covered[p] || truth.covered(p);
    if (!covered[p] || !truth.covered(p)) continue;
    const int i = static_cast<int>(p) % lens.width, j = static_cast<int>(p) / lens.width;
    const Vec3d& normal = truth.normal[p];
    const double error = map.depth[p] - truth.depth[p];
    const auto add_angles = [&](std::vector<double>& own, std::vector<double>& by_slope) {
      if (!map.normal.empty() && map.normal[p] != Vec3{})
        own.push_back(angle_between(Vec3d(map.normal[p]), normal));
      if (slopes[p] != Vec3d{}) by_slope.push_back(angle_between(slopes[p], normal));
    };
    switch (truth.class_of[p]) {
      case PixelClass::interior: {
        const double error_along_normal = error * std::abs(dot(normal, lens.direction(i, j)));
        along_normal.add(clamped(error_along_normal));
        along_normal_sizes.push_back(std::abs(error_along_normal));
        depth.add(clamped(error));
        outliers += std::abs(error) > 1;
        add_angles(angles, slope_angles);
        break;
      }
      case PixelClass::crease:
        crease_depth.add(clamped(error));
        add_angles(crease_angles, crease_slopes);
        break;
      case PixelClass::silhouette:
        outline_depth.add(clamped(error));
        break;
      case PixelClass::splash:
      case PixelClass::none:
        break;
    }
  }

  Figures f;
  f.normal_rms = along_normal.rms();
  f.normal_p95 = percentile(along_normal_sizes, 0.95);
  f.normal_bias = along_normal.mean();
  f.depth_rms = depth.rms();
  f.outliers = depth.count > 0 ? 100 * outliers / depth.count : Figures::kNone;
  f.angle_median = percentile(angles, 0.5);
  f.angle_p95 = percentile(angles, 0.95);
  f.slope_median = percentile(slope_angles, 0.5);
  f.slope_p95 = percentile(slope_angles, 0.95);
  f.crease_rms = crease_depth.rms();
  f.crease_angle = percentile(crease_angles, 0.5);
  f.crease_slope = percentile(crease_slopes, 0.5);
  f.outline_rms = outline_depth.rms();
  f.outline_miss = outline_distance(truth, covered);
  f.iou = either > 0 ? both / either : Figures::kNone;
  f.holes = count_holes(truth, covered);
  f.specks = 1e6 * count_specks(truth, map) / static_cast<double>(map.depth.size());
  return f;
}

double flicker(std::span<const Truth> truths, std::span<const Map> maps) {
  require(truths.size() == maps.size(), "flicker: " + std::to_string(maps.size()) + " maps for " +
                                            std::to_string(truths.size()) + " truths");
  Moments change;
  for (std::size_t k = 0; k + 1 < maps.size(); ++k) {
    require_same_size(truths[k], maps[k]);
    require_same_size(truths[k + 1], maps[k + 1]);
    for (std::size_t p = 0; p < truths[k].depth.size(); ++p) {
      if (truths[k].class_of[p] != PixelClass::interior ||
          truths[k + 1].class_of[p] != PixelClass::interior || !finite(maps[k].depth[p]) ||
          !finite(maps[k + 1].depth[p]))
        continue;
      const double before = maps[k].depth[p] - truths[k].depth[p];
      const double after = maps[k + 1].depth[p] - truths[k + 1].depth[p];
      change.add(clamped(after - before));
    }
  }
  return change.rms();
}

const std::vector<FigureField>& figure_fields() {
  static const std::vector<FigureField> fields{
      {"normal_rms", "s", &Figures::normal_rms, 4},
      {"normal_p95", "s", &Figures::normal_p95, 4},
      {"normal_bias", "s", &Figures::normal_bias, 4},
      {"depth_rms", "s", &Figures::depth_rms, 4},
      {"outliers", "%", &Figures::outliers, 2},
      {"angle_median", "deg", &Figures::angle_median, 2},
      {"angle_p95", "deg", &Figures::angle_p95, 2},
      {"slope_median", "deg", &Figures::slope_median, 2},
      {"slope_p95", "deg", &Figures::slope_p95, 2},
      {"crease_rms", "s", &Figures::crease_rms, 3},
      {"crease_angle", "deg", &Figures::crease_angle, 2},
      {"crease_slope", "deg", &Figures::crease_slope, 2},
      {"outline_rms", "s", &Figures::outline_rms, 3},
      {"outline_miss", "s", &Figures::outline_miss, 3},
      {"iou", "", &Figures::iou, 4},
      {"holes", "", &Figures::holes, 1},
      {"specks", "per Mpixel", &Figures::specks, 1},
      {"flicker", "s", &Figures::flicker, 4},
  };
  return fields;
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
