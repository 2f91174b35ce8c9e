#include "accuracy/layers.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "accuracy/figures/statistics.hpp"
#include "accuracy/parallel.hpp"
#include "accuracy/truth.hpp"
#include "meniscus/error.hpp"

namespace meniscus::accuracy {
namespace {

constexpr double kLongestStep = 0.25, kShortestStep = 0.002;  // s
constexpr double kReach = 1.5;                                // s, of outlines and creases
constexpr double kSameSurface = 0.95;                         // between neighbours' normals
constexpr double kRight = 0.5;                                // s
constexpr double kFilm = 0.02;                                // s

/// The solid along a ray of unit direction, from `at` to `end`.
std::vector<TrueInterval> follow(const Scene& scene, const Vec3d& origin, const Vec3d& ray,
                                 double at, double end) {
  std::vector<TrueInterval> found;
  double before = at, value = scene.distance(origin + at * ray);
  double entry = value < 0 ? at : -1;
  while (at < end) {
    before = at;
    at += std::clamp(scene.safe_step * std::abs(value), kShortestStep, kLongestStep);
    const double next = scene.distance(origin + at * ray);
    if ((next < 0) != (value < 0)) {
      double low = before, high = at;
      for (int k = 0; k < 20; ++k) {
        const double middle = (low + high) / 2;
        ((scene.distance(origin + middle * ray) < 0) == (value < 0) ? low : high) = middle;
      }
      if (next < 0)
        entry = high;
      else
        found.push_back({entry, high});
    }
    value = next;
  }
  return found;
}

bool alike(const std::vector<TrueInterval>& a, const std::vector<TrueInterval>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t k = 0; k < a.size(); ++k)
    if (!(std::abs(a[k].entry - b[k].entry) <= kJump && std::abs(a[k].exit - b[k].exit) <= kJump))
      return false;
  return true;
}

}  // namespace

TrueLayers trace_layers_of(const Scene& scene, const Lens& lens) {
  require(scene.splash.empty(), "layers: scene " + scene.name + " has splash");
  const int width = lens.width, height = lens.height;
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  TrueLayers truth{
      lens, std::vector<std::vector<TrueInterval>>(pixels), std::vector<Vec3d>(pixels), {}, {}};
  const Vec3d centre = (scene.low + scene.high) / 2;
  const double radius = length(scene.high - scene.low) / 2;
  for_each_index(height, [&](int j) {
    for (int i = 0; i < width; ++i) {
      const std::size_t p = static_cast<std::size_t>(j) * static_cast<std::size_t>(width) +
                            static_cast<std::size_t>(i);
      const Vec3d origin = lens.origin(i, j), direction = lens.direction(i, j);
      const double per_depth = length(direction);
      const Vec3d ray = direction / per_depth, to_centre = centre - origin;
      const double nearest = dot(to_centre, ray);
      const double room = radius * radius - dot(to_centre, to_centre) + nearest * nearest;
      if (room < 0) continue;
      truth.intervals[p] = follow(scene, origin, ray, std::max(0.0, nearest - std::sqrt(room)),
                                  nearest + std::sqrt(room));
      for (TrueInterval& interval : truth.intervals[p]) {
        interval.entry /= per_depth;
        interval.exit /= per_depth;
      }
      if (!truth.intervals[p].empty())
        truth.back_normal[p] =
            outward(scene.distance, lens.point(i, j, truth.intervals[p].front().exit));
    }
  });

  std::vector<bool> outline(pixels), crease(pixels);
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) {
      const std::size_t p = static_cast<std::size_t>(j) * static_cast<std::size_t>(width) +
                            static_cast<std::size_t>(i);
      if (truth.intervals[p].empty()) continue;
      constexpr std::array<std::array<int, 2>, 4> kNeighbours{{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
      for (const auto& [di, dj] : kNeighbours) {
        const int x = i + di, y = j + dj;
        const bool is_in = x >= 0 && y >= 0 && x < width && y < height;
        const std::size_t q = is_in
                                  ? static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                        static_cast<std::size_t>(x)
                                  : p;
        if (!is_in || !alike(truth.intervals[p], truth.intervals[q]))
          outline[p] = true;
        else if (dot(truth.back_normal[p], truth.back_normal[q]) < kSameSurface)
          crease[p] = true;
      }
    }
  const auto to_outline = distance_to(outline, width, height),
             to_crease = distance_to(crease, width, height);
  truth.outline.resize(pixels);
  truth.crease.resize(pixels);
  for (std::size_t p = 0; p < pixels; ++p) {
    if (truth.intervals[p].empty()) continue;
    const double margin = kReach * lens.scale(truth.intervals[p].front().entry);
    truth.outline[p] = to_outline[p] < margin;
    truth.crease[p] = to_crease[p] < margin;
  }
  return truth;
}

LayerFigures measure_layers(const TrueLayers& truth, const Surface& surface) {
  const Layers& layers = surface.layers;
  require(layers.most >= 2, "measure_layers: wants two layers a pixel");
  const Lens& lens = truth.lens;
  const std::size_t pixels = truth.intervals.size();
  require(layers.count.size() == pixels, "measure_layers: the surface is of another camera");
  LayerFigures figures;
  Moments thickness, front, back;
  std::vector<double> thickness_errors, angles;
  std::int64_t second = 0, second_inner = 0, number = 0, films = 0;
  for (std::size_t p = 0; p < pixels; ++p) {
    const std::vector<TrueInterval>& truly = truth.intervals[p];
    if (truly.empty() || layers.count[p] == 0) continue;
    const Vec3d direction = lens.direction(p);
    const double stretch = length(direction);
    const bool inner = !truth.outline[p];
    ++figures.pixels;
    figures.inner += inner;
    number += layers.count[p] == truly.size();
    films += (layers.exit[p] - layers.entry[p]) * stretch < kFilm;
    const bool has_second = layers.count[p] > 1, truly_second = truly.size() > 1;
    bool right = has_second == truly_second;
    if (right && truly_second)
      right = std::abs(layers.entry[pixels + p] - truly[1].entry) * stretch <= kRight &&
              std::abs(layers.exit[pixels + p] - truly[1].exit) * stretch <= kRight;
    second += right;
    second_inner += right && inner;
    if (!inner) continue;
    double all = 0;
    for (const TrueInterval& interval : truly) all += interval.exit - interval.entry;
    const double too_thick = layers.thickness[p] - all * stretch;
    thickness.add(too_thick);
    thickness_errors.push_back(std::abs(too_thick));
    front.add((layers.entry[p] - truly[0].entry) * stretch);
    back.add((layers.exit[p] - truly[0].exit) * dot(direction, truth.back_normal[p]));
    if (!truth.crease[p])
      angles.push_back(angle_between(Vec3d(layers.back_normal[p]), truth.back_normal[p]));
  }
  const auto share_of = [](std::int64_t some, std::int64_t all) {
    return static_cast<double>(some) / static_cast<double>(all);
  };
  figures.thickness_rms = thickness.rms();
  figures.thickness_999 = percentile(thickness_errors, 0.999);
  figures.front_rms = front.rms();
  figures.back_rms = back.rms();
  figures.normal_median = percentile(angles, 0.5);
  figures.normal_95 = percentile(angles, 0.95);
  figures.second_right = share_of(second, figures.pixels);
  figures.second_right_inner = share_of(second_inner, figures.inner);
  figures.number_right = share_of(number, figures.pixels);
  figures.films = share_of(films, figures.pixels);
  return figures;
}

}  // namespace meniscus::accuracy
