#include "io/picture.hpp"

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <new>
#include <utility>

namespace meniscus {
namespace {

// Whether there is a border between two neighbouring pixels: one has surface and the other has not,
// they lie on either side of a crease, or neither lies near the other's tangent plane.
bool has_border(const Scene& scene, int column_a, int row_a, int column_b, int row_b) {
  const std::size_t a = scene.at(column_a, row_a), b = scene.at(column_b, row_b);
  if (scene.covered(a) != scene.covered(b)) return true;
  if (!scene.covered(a)) return false;
  constexpr float kCrease = 0.8f;  // cosine of 37 degrees; curved surfaces turn less in a pixel
  if (dot(scene.normal[a], scene.normal[b]) < kCrease) return true;
  constexpr float kStep = 0.75f;  // particle radii
  if (std::abs(scene.depth(a) - scene.depth(b)) < kStep) return false;
  const Vec3 way = scene.point[b] - scene.point[a];
  return std::abs(dot(way, scene.normal[a])) > kStep && std::abs(dot(way, scene.normal[b])) > kStep;
}

// Where there are borders: to the pixel on the right, to the one below.
struct Borders {
  std::vector<char> right, below;
};

Borders borders_of(const Scene& scene) {
  const std::size_t pixels = scene.point.size();
  Borders borders{std::vector<char>(pixels), std::vector<char>(pixels)};
  parallel_pixels(scene, [&](int column, int row, std::size_t k) {
    borders.right[k] = column + 1 < scene.width && has_border(scene, column, row, column + 1, row);
    borders.below[k] = row + 1 < scene.height && has_border(scene, column, row, column, row + 1);
  });
  return borders;
}

// What a pixel takes from the colours of the pixels above, below, left and right of it.
struct Shares {
  float above, below, left, right;
};

// The shares of all pixels. Most take nothing, and their memory is not touched.
struct Mixing {
  explicit Mixing(std::size_t pixels)
      : shares(static_cast<Shares*>(std::calloc(pixels, sizeof(Shares))), std::free),
        touched(pixels) {
    if (!shares) throw std::bad_alloc();
  }

  std::unique_ptr<Shares[], void (*)(void*)> shares;
  std::vector<char> touched;  // who takes something
};

// Lines of pixels: rows, or else columns. The next line is below (right of) this one.
struct Lines {
  const Scene& scene;
  bool rows;
  const std::vector<char>& across;  // borders between a line and the next
  const std::vector<char>& along;   // between two pixels of a line

  int length() const { return rows ? scene.width : scene.height; }
  int count() const { return rows ? scene.height : scene.width; }
  std::size_t pixel(int place, int line) const {
    return rows ? scene.at(place, line) : scene.at(line, place);
  }
  // The last pixel of the run of a border between lines: while neither side of it breaks.
  int last_of_run(int first, int line) const {
    int last = first;
    while (last + 1 < length() && across[pixel(last + 1, line)] && !along[pixel(last, line)] &&
           !along[pixel(last, line + 1)])
      ++last;
    return last;
  }
  // Where the border goes at an end of a run: +1 into the next line, -1 into this line, 0 straight
  // on, both ways, or out of the picture.
  int turn(int inside, int outside, int line) const {
    if (outside < 0 || outside >= length()) return 0;
    const int before = std::min(inside, outside);
    return along[pixel(before, line + 1)] - along[pixel(before, line)];
  }
};

// A straight border lies half a pixel off where its run turns, and on the run from its middle on,
// which is `half` away: the area between it and the run over the pixel at this distance from the
// turn.
float area_beside(int direction, int distance, float half) {
  const auto from = static_cast<float>(distance), to = std::min(from + 1, half);
  if (direction == 0 || from >= half) return 0;
  return 0.5f * static_cast<float>(direction) * (to - from) * (1 - (to + from) / (2 * half));
}

// Follows the borders between lines. Each share is written by one line.
void follow_borders(const Lines& lines, float Shares::*from_this, float Shares::*from_next,
                    Mixing& mixing) {
  parallel_rows(lines.count() - 1, [&](int line) {
    for (int first = 0; first < lines.length(); ++first) {
      if (!lines.across[lines.pixel(first, line)]) continue;
      const int last = lines.last_of_run(first, line);
      const int start = lines.turn(first, first - 1, line), end = lines.turn(last, last + 1, line);
      const float half = 0.5f * static_cast<float>(last - first + 1);
      for (int k = first; k <= last; ++k)
        for (const float off :
             {area_beside(start, k - first, half), area_beside(end, last - k, half)}) {
          if (off == 0) continue;
          const std::size_t taker = lines.pixel(k, off > 0 ? line + 1 : line);
          mixing.shares[taker].*(off > 0 ? from_this : from_next) += std::abs(off);
          std::atomic_ref(mixing.touched[taker]).store(1, std::memory_order_relaxed);
        }
      first = last;
    }
  });
}

// A steep border is found once as long runs and once as the short ones between them, which would
// count its area twice: the long runs know better. Colours are replaced when all are known.
Picture mixed(const Scene& scene, const Mixing& mixing, Picture picture) {
  std::vector<std::vector<std::pair<std::size_t, Color>>> changed(
      static_cast<std::size_t>(scene.height));
  parallel_pixels(scene, [&](int, int row, std::size_t k) {
    if (!mixing.touched[k]) return;
    const Shares& s = mixing.shares[k];
    const auto blend = [&](float before, float after, std::size_t step) {
      Color color = picture[k] * (1 - before - after);
      if (before > 0) color = color + picture[k - step] * before;
      if (after > 0) color = color + picture[k + step] * after;
      changed[static_cast<std::size_t>(row)].emplace_back(k, color);
    };
    if (std::max(s.above, s.below) >= std::max(s.left, s.right))
      blend(s.above, s.below, static_cast<std::size_t>(scene.width));
    else
      blend(s.left, s.right, 1);
  });
  for (const auto& row : changed)
    for (const auto& [k, color] : row) picture[k] = color;
  return picture;
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
  parallel_pixels(*this, [&](int column, int row, std::size_t k) {
    const Vec3& n = surface.normal[k];
    const auto axis = [&](int r) {
      return static_cast<float>(m[4 * r] * n.x + m[4 * r + 1] * n.y + m[4 * r + 2] * n.z);
    };
    normal[k] = {axis(0), axis(1), axis(2)};
    if (covered(k))
      point[k] =
          static_cast<Vec3>(point_at(view, column + .5, row + .5, surface.depth[k] / view.radius));
  });
}

Vec3 Scene::to_eye(int column, int row) const {
  return static_cast<Vec3>(normalized(-ray_direction(view, column + .5, row + .5)));
}

Picture smooth_borders(const Scene& scene, Picture picture) {
  const Borders borders = borders_of(scene);
  Mixing mixing(picture.size());
  follow_borders({scene, true, borders.below, borders.right}, &Shares::above, &Shares::below,
                 mixing);
  follow_borders({scene, false, borders.right, borders.below}, &Shares::left, &Shares::right,
                 mixing);
  return mixed(scene, mixing, std::move(picture));
}

}  // namespace meniscus
