#include "io/picture.hpp"

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <new>
#include <utility>

namespace meniscus {
namespace {

// Whether the surface breaks off between two neighbouring pixels: one has surface and the other
// has not, or neither lies near the other's tangent plane.
bool breaks(const Scene& scene, int column_a, int row_a, int column_b, int row_b) {
  const std::size_t a = scene.at(column_a, row_a), b = scene.at(column_b, row_b);
  if (scene.covered(a) != scene.covered(b)) return true;
  if (!scene.covered(a)) return false;
  constexpr float kStep = 0.75f;  // particle radii
  if (std::abs(scene.depth(a) - scene.depth(b)) < kStep) return false;
  const Vec3 way = scene.point[b] - scene.point[a];
  return std::abs(dot(way, scene.normal[a])) > kStep && std::abs(dot(way, scene.normal[b])) > kStep;
}

}  // namespace

Scene::Scene(const Surface& surface_)
    : surface(surface_),
      view(make_view(surface_.camera, surface_.particle_radius > 0 ? surface_.particle_radius : 1,
                     {0, 0, 0})),
      width(surface_.camera.width),
      height(surface_.camera.height) {
  normal.resize(surface.normal.size());
  point.resize(surface.normal.size());
  const auto& m = surface.camera.view;
  parallel_rows(height, [&](int row) {
    for (int column = 0; column < width; ++column) {
      const std::size_t k = at(column, row);
      const Vec3& n = surface.normal[k];
      const auto axis = [&](int r) {
        return static_cast<float>(m[4 * r] * n.x + m[4 * r + 1] * n.y + m[4 * r + 2] * n.z);
      };
      normal[k] = {axis(0), axis(1), axis(2)};
      if (covered(k))
        point[k] = static_cast<Vec3>(
            point_at(view, column + .5, row + .5, surface.depth[k] / view.radius));
    }
  });
}

Vec3 Scene::to_eye(int column, int row) const {
  return static_cast<Vec3>(normalized(-ray_direction(view, column + .5, row + .5)));
}

Picture smooth_borders(const Scene& scene, Picture picture) {
  const int width = scene.width, height = scene.height;
  // Which pixels the surface breaks off from: the one to the right, the one below.
  std::vector<char> right(picture.size()), below(picture.size());
  parallel_rows(height, [&](int row) {
    for (int column = 0; column < width; ++column) {
      const std::size_t k = scene.at(column, row);
      right[k] = column + 1 < width && breaks(scene, column, row, column + 1, row);
      below[k] = row + 1 < height && breaks(scene, column, row, column, row + 1);
    }
  });
  // What each pixel takes from the colours of the pixels above, below, left and right of it. Most
  // take nothing, and their memory is not touched.
  struct Shares {
    float above, below, left, right;
  };
  const std::unique_ptr<Shares[], void (*)(void*)> shares(
      static_cast<Shares*>(std::calloc(picture.size(), sizeof(Shares))), std::free);
  if (!shares) throw std::bad_alloc();
  std::vector<char> touched(picture.size());

  // Follows the borders between lines of pixels: rows, or else columns. The next line is below
  // (right of) this one. Each share is written by one line.
  const auto follow = [&](bool rows, float Shares::*from_this, float Shares::*from_next) {
    const int length = rows ? width : height, lines = rows ? height : width;
    const std::vector<char>& across = rows ? below : right;  // between a line and the next
    const std::vector<char>& along = rows ? right : below;   // between two pixels of a line
    const auto pixel = [&](int place, int line) {
      return rows ? scene.at(place, line) : scene.at(line, place);
    };
    const auto follow_line = [&](int line) {
      for (int first = 0; first < length; ++first) {
        if (!across[pixel(first, line)]) continue;
        int last = first;  // of the run: while neither side of it breaks
        while (last + 1 < length && across[pixel(last + 1, line)] && !along[pixel(last, line)] &&
               !along[pixel(last, line + 1)])
          ++last;
        // Where the border goes at an end of the run: +1 into the next line, -1 into this line, 0
        // straight on, both ways, or out of the picture.
        const auto turn = [&](int inside, int outside) {
          if (outside < 0 || outside >= length) return 0;
          const int before = std::min(inside, outside);
          return along[pixel(before, line + 1)] - along[pixel(before, line)];
        };
        const float half = 0.5f * static_cast<float>(last - first + 1);
        // The straight border lies half a pixel off where the run turns, and on the run from its
        // middle on: the area between it and the run over one pixel.
        const auto area = [&](int direction, int distance) {
          const auto from = static_cast<float>(distance), to = std::min(from + 1, half);
          if (direction == 0 || from >= half) return 0.0f;
          return 0.5f * static_cast<float>(direction) * (to - from) *
                 (1 - (to + from) / (2 * half));
        };
        const int start = turn(first, first - 1), end = turn(last, last + 1);
        for (int k = first; k <= last; ++k)
          for (const float off : {area(start, k - first), area(end, last - k)}) {
            const std::size_t taker = pixel(k, off > 0 ? line + 1 : line);
            if (off > 0) shares[taker].*from_this += off;
            if (off < 0) shares[taker].*from_next -= off;
            if (off != 0) std::atomic_ref(touched[taker]).store(1, std::memory_order_relaxed);
          }
        first = last;
      }
    };
    parallel_rows(lines - 1, follow_line);
  };
  follow(true, &Shares::above, &Shares::below);
  follow(false, &Shares::left, &Shares::right);

  // A steep border is found once as long runs and once as the short ones between them, which would
  // count its area twice: the long runs know better. Colours are replaced when all are known.
  std::vector<std::vector<std::pair<std::size_t, Color>>> changed(static_cast<std::size_t>(height));
  parallel_rows(height, [&](int row) {
    for (int column = 0; column < width; ++column) {
      const std::size_t k = scene.at(column, row);
      if (!touched[k]) continue;
      const Shares& s = shares[k];
      const auto blend = [&](float before, float after, std::size_t step) {
        Color color = picture[k] * (1 - before - after);
        if (before > 0) color = color + picture[k - step] * before;
        if (after > 0) color = color + picture[k + step] * after;
        changed[static_cast<std::size_t>(row)].emplace_back(k, color);
      };
      const auto line = static_cast<std::size_t>(width);
      if (std::max(s.above, s.below) >= std::max(s.left, s.right))
        blend(s.above, s.below, line);
      else
        blend(s.left, s.right, 1);
    }
  });
  for (const auto& row : changed)
    for (const auto& [k, color] : row) picture[k] = color;
  return picture;
}

}  // namespace meniscus
