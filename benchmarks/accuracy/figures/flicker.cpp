#include "accuracy/figures/flicker.hpp"

#include <cmath>
#include <string>

#include "accuracy/figures.hpp"
#include "meniscus/error.hpp"

namespace meniscus::accuracy {
namespace {

Flicker flicker_of(const std::vector<double>& changes) {
  Moments moments;
  for (const double change : changes) moments.add(change);
  std::vector<double> sizes;
  for (const double change : changes) sizes.push_back(std::abs(change));
  return {moments.rms(), percentile(sizes, 0.999)};
}

// Second differences in time, each times weigh(middle frame, pixel) unless that is no number.
template <class Weigh>
Flicker weighed_difference(std::span<const Map> maps, const Weigh& weigh) {
  std::vector<double> changes;
  for (std::size_t k = 0; k + 2 < maps.size(); ++k) {
    const auto &first = maps[k].depth, &middle = maps[k + 1].depth, &last = maps[k + 2].depth;
    require(first.size() == middle.size() && middle.size() == last.size(),
            "second_difference: frames " + std::to_string(k) + " to " + std::to_string(k + 2) +
                " differ in size");
    for (std::size_t p = 0; p < first.size(); ++p)
      if (const auto change = second_difference(first[p], middle[p], last[p]))
        if (const double weight = weigh(maps[k + 1], p); !std::isnan(weight))
          changes.push_back(weight * *change);
  }
  return flicker_of(changes);
}

}  // namespace

Flicker flicker(std::span<const Truth> truths, std::span<const Map> maps) {
  require(truths.size() == maps.size() || truths.size() == 1,
          "flicker: " + std::to_string(maps.size()) + " maps for " + std::to_string(truths.size()) +
              " truths, wanted as many, or one truth");
  const auto truth_of = [&](std::size_t k) -> const Truth& {
    return truths[truths.size() == 1 ? 0 : k];
  };
  std::vector<double> changes;
  for (std::size_t k = 0; k + 1 < maps.size(); ++k) {
    const Truth &first = truth_of(k), &second = truth_of(k + 1);
    require_same_size(first, maps[k]);
    require_same_size(second, maps[k + 1]);
    for (std::size_t p = 0; p < first.depth.size(); ++p) {
      if (first.class_of[p] != PixelClass::interior || second.class_of[p] != PixelClass::interior ||
          !finite(maps[k].depth[p]) || !finite(maps[k + 1].depth[p]))
        continue;
      const double before = maps[k].depth[p] - first.depth[p];
      const double after = maps[k + 1].depth[p] - second.depth[p];
      changes.push_back(clamped(after - before));
    }
  }
  return flicker_of(changes);
}

Flicker flicker(std::span<const Truth> truths, std::span<const Map> maps, const Motion& motion) {
  require(truths.size() == maps.size(), "flicker: " + std::to_string(maps.size()) + " maps for " +
                                            std::to_string(truths.size()) +
                                            " truths, wanted as many");
  // The error of a frame at a pixel; nothing where it is not measured, or of another layer.
  const auto error_at = [&](std::size_t frame, std::size_t p, double depth) {
    const Truth& truth = truths[frame];
    const bool measured = truth.class_of[p] == PixelClass::interior &&
                          finite(maps[frame].depth[p]) && std::abs(truth.depth[p] - depth) <= kJump;
    return measured ? clamped(maps[frame].depth[p] - truth.depth[p]) : kNone;
  };
  std::vector<double> changes;
  for (std::size_t k = 0; k + 1 < maps.size(); ++k) {
    const Lens& lens = truths[k].lens;
    require_same_size(truths[k], maps[k]);
    require_same_size(truths[k + 1], maps[k + 1]);
    const int frame = static_cast<int>(k);
    for (std::size_t p = 0; p < truths[k].depth.size(); ++p) {
      const double before = error_at(k, p, truths[k].depth[p]);
      if (std::isnan(before)) continue;
      const Vec3d still = motion.back(lens.point(p, truths[k].depth[p]), frame);
      const Vec3d place = truths[k + 1].lens.project(motion.forth(still, frame + 1));
      const int x = static_cast<int>(std::floor(place.x)),
                y = static_cast<int>(std::floor(place.y));
      if (x < 0 || y < 0 || x + 1 >= lens.width || y + 1 >= lens.height) continue;
      const std::size_t q = static_cast<std::size_t>(y) * lens.width + x;
      const auto across = [&](std::size_t left) {
        return std::lerp(error_at(k + 1, left, place.z), error_at(k + 1, left + 1, place.z),
                         place.x - x);
      };
      const double after = std::lerp(across(q), across(q + lens.width), place.y - y);
      if (!std::isnan(after)) changes.push_back(after - before);
    }
  }
  return flicker_of(changes);
}

std::optional<double> second_difference(double first, double middle, double last) {
  if (!finite(first) || !finite(middle) || !finite(last)) return std::nullopt;
  const double before = middle - first, after = last - middle;
  if (std::abs(before) > kJump || std::abs(after) > kJump) return std::nullopt;
  return after - before;
}

Flicker second_difference(std::span<const Map> maps) {
  return weighed_difference(maps, [](const Map&, std::size_t) { return 1.0; });
}

Flicker second_difference_along_normal(const Lens& lens, std::span<const Map> maps) {
  const std::size_t pixels = static_cast<std::size_t>(lens.width) * lens.height;
  for (const Map& map : maps)
    require(map.normal.size() == pixels, "second_difference_along_normal: a map has " +
                                             std::to_string(map.normal.size()) +
                                             " normals, wanted " + std::to_string(pixels));
  return weighed_difference(maps, [&](const Map& middle, std::size_t p) {
    const Vec3 normal = middle.normal[p];
    if (normal == Vec3{}) return kNone;
    return std::abs(dot(Vec3d(normal), lens.direction(p)));
  });
}

}  // namespace meniscus::accuracy
