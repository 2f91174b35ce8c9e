#include "io/picture.hpp"

#include <cmath>

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
  normal.reserve(surface.normal.size());
  const auto& m = surface.camera.view;
  for (const Vec3& n : surface.normal) {
    const auto row = [&](int r) {
      return static_cast<float>(m[4 * r] * n.x + m[4 * r + 1] * n.y + m[4 * r + 2] * n.z);
    };
    normal.push_back({row(0), row(1), row(2)});
  }
  point.resize(normal.size());
  parallel_rows(height, [&](int row) {
    for (int column = 0; column < width; ++column) {
      const std::size_t k = at(column, row);
      if (covered(k))
        point[k] = static_cast<Vec3>(
            point_at(view, column + .5, row + .5, surface.depth[k] / view.radius));
    }
  });
}

Vec3 Scene::to_eye(int column, int row) const {
  return static_cast<Vec3>(normalized(-ray_direction(view, column + .5, row + .5)));
}

Picture smooth_borders(const Scene& scene, const Picture& picture) {
  const int width = scene.width, height = scene.height;
  // What each pixel takes from the colours of the pixels above, below, left and right of it.
  struct Shares {
    float above = 0, below = 0, left = 0, right = 0;
  };
  std::vector<Shares> shares(picture.size());

  // Follows the borders between lines of pixels: rows, or else columns. The next line is below
  // (right of) this one.
  const auto follow = [&](bool rows, float Shares::*from_this, float Shares::*from_next) {
    const int length = rows ? width : height, lines = rows ? height : width;
    const auto pixel = [&](int along, int line) {
      return rows ? scene.at(along, line) : scene.at(line, along);
    };
    const auto border = [&](int along_a, int line_a, int along_b, int line_b) {
      return rows ? breaks(scene, along_a, line_a, along_b, line_b)
                  : breaks(scene, line_a, along_a, line_b, along_b);
    };
    std::vector<char> open(static_cast<std::size_t>(length) + 1);
    for (int line = 0; line + 1 < lines; ++line) {
      for (int k = 0; k < length; ++k)
        open[static_cast<std::size_t>(k)] = border(k, line, k, line + 1);
      for (int first = 0; first < length; ++first) {
        if (!open[static_cast<std::size_t>(first)]) continue;
        int last = first;  // of the run: while neither side of it breaks
        while (open[static_cast<std::size_t>(last + 1)] && !border(last, line, last + 1, line) &&
               !border(last, line + 1, last + 1, line + 1))
          ++last;
        // Where the border goes at an end of the run: +1 into the next line, -1 into this line, 0
        // straight on, both ways, or out of the picture.
        const auto turn = [&](int inside, int outside) {
          if (outside < 0 || outside >= length) return 0;
          const int in_this = border(inside, line, outside, line);
          const int in_next = border(inside, line + 1, outside, line + 1);
          return in_next - in_this;
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
            if (off > 0) shares[pixel(k, line + 1)].*from_this += off;
            if (off < 0) shares[pixel(k, line)].*from_next -= off;
          }
        first = last;
      }
    }
  };
  follow(true, &Shares::above, &Shares::below);
  follow(false, &Shares::left, &Shares::right);

  // A steep border is found once as long runs and once as the short ones between them, which would
  // count its area twice: the long runs know better.
  Picture result = picture;
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) {
      const std::size_t k = scene.at(column, row);
      const Shares& s = shares[k];
      const auto blend = [&](float before, float after, std::size_t step) {
        result[k] = picture[k] * (1 - before - after);
        if (before > 0) result[k] = result[k] + picture[k - step] * before;
        if (after > 0) result[k] = result[k] + picture[k + step] * after;
      };
      const auto line = static_cast<std::size_t>(width);
      if (std::max(s.above, s.below) >= std::max(s.left, s.right))
        blend(s.above, s.below, line);
      else
        blend(s.left, s.right, 1);
    }
  return result;
}

}  // namespace meniscus
