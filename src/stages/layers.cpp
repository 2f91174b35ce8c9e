#include "stages/layers.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "base/parallel.hpp"

namespace meniscus {
namespace {

constexpr int kRowsDrawn = 16;       // rows of pixels that one thread draws at a time
constexpr double kSubpixels = 4096;  // of a pixel
constexpr double kFarthestPixel = 1
                                  << 17;  // pixels; products of differences of steps fit in 64 bits

// A mesh's entry so near behind the front, along the ray, is the front's. Particle radii.
constexpr double kMeetsFront = 2;
// Thickness of a film: a front that the mesh does not know. Particle radii along the ray.
constexpr double kFilm = 0.02;

// Air between two bodies that is thinner along the ray is none: it is the surface's roughness,
// where a ray skims it or nicks an edge. Particles of two sheets leave at least .7 between the
// sheets.
constexpr double kThinAir = 0.5;

// Vertices of a triangle whose normal is off the triangle's by more lie on a crease: there the
// triangle's own counts. 25 degrees.
constexpr double kCreaseNormals = 0.9063077870366499;

// A vertex on the screen.
struct ScreenCorner {
  std::int64_t u = 0, v = 0;  // steps
  double depth = 0, inverse_w = 0;
  Vec3d normal;  // world axes
  bool usable = false;
};

// The mesh on the screen.
struct ScreenMesh {
  std::vector<ScreenCorner> corner;                    // [vertices]
  std::vector<std::array<std::uint32_t, 3>> triangle;  // corners of those that may be met
  std::vector<std::int8_t> enters;                     // [triangles] 1: faces the eye; -1
  std::vector<Vec3d> flat;                             // [triangles] unit, outward, world axes
  std::vector<std::vector<std::uint32_t>> of_band;     // [bands] their triangles, ascending
};

// Twice the area to the right of a to b, where p lies.
std::int64_t side_of(const ScreenCorner& a, const ScreenCorner& b, std::int64_t u, std::int64_t v) {
  return (b.u - a.u) * (v - a.v) - (b.v - a.v) * (u - a.u);
}

// Of the two triangles beside an edge, which run along it either way, the one that has its points.
bool owns_edge(const ScreenCorner& a, const ScreenCorner& b) {
  return a.v == b.v ? b.u > a.u : b.v < a.v;
}

std::int64_t centre_of(int pixel) {
  return static_cast<std::int64_t>(pixel) * static_cast<std::int64_t>(kSubpixels) +
         static_cast<std::int64_t>(kSubpixels) / 2;
}

// The pixels whose centres lie between two steps along an axis: the first, and the one behind the
// last.
std::array<int, 2> pixels_between(std::int64_t low, std::int64_t high, int size) {
  const double first = std::ceil(static_cast<double>(low) / kSubpixels - 0.5),
               last = std::floor(static_cast<double>(high) / kSubpixels - 0.5);
  return {static_cast<int>(std::clamp<double>(first, 0, size)),
          static_cast<int>(std::clamp<double>(last + 1, 0, size))};
}

// How far a point lies to the right of each edge of a triangle, the k-th opposite corner k.
std::array<std::int64_t, 3> sides_of(const std::array<const ScreenCorner*, 3>& corner,
                                     std::int64_t u, std::int64_t v) {
  return {side_of(*corner[1], *corner[2], u, v), side_of(*corner[2], *corner[0], u, v),
          side_of(*corner[0], *corner[1], u, v)};
}

// The three edges of a triangle, its inside to the right of them; the k-th lies opposite corner k.
struct Edges {
  std::array<const ScreenCorner*, 3> corner;
  std::array<int, 2> columns, rows;  // whose centres it may cover, first and behind the last

  Edges(const ScreenMesh& mesh, const std::array<std::uint32_t, 3>& t, const View& view)
      : corner{&mesh.corner[t[0]], &mesh.corner[t[1]], &mesh.corner[t[2]]} {
    const auto range = [&](std::int64_t ScreenCorner::*axis, int size) {
      const std::int64_t a = corner[0]->*axis, b = corner[1]->*axis, c = corner[2]->*axis;
      return pixels_between(std::min({a, b, c}), std::max({a, b, c}), size);
    };
    columns = range(&ScreenCorner::u, view.width);
    rows = range(&ScreenCorner::v, view.height);
  }
};

// Projects the mesh, and lists the triangles of each band of rows. Corners of triangles are put so
// that their inside is to the right of their edges.
ScreenMesh project_mesh(const View& view, const DualMesh& mesh) {
  ScreenMesh screen;
  screen.corner.resize(mesh.position.size());
  parallel_for(screen.corner.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const Vec3d& at = mesh.position[k];
      const PixelPosition p = project(view, at);
      if (!(-at.z > 0 && p.w > 0 && std::abs(p.u) < kFarthestPixel &&
            std::abs(p.v) < kFarthestPixel))
        continue;
      screen.corner[k] = {std::llround(p.u * kSubpixels),
                          std::llround(p.v * kSubpixels),
                          -at.z,
                          1 / p.w,
                          world_direction(view, mesh.normal[k]),
                          true};
    }
  });
  screen.of_band.resize(static_cast<std::size_t>((view.height + kRowsDrawn - 1) / kRowsDrawn));
  screen.triangle.reserve(mesh.triangle.size());
  for (std::array<std::uint32_t, 3> t : mesh.triangle) {
    const ScreenCorner &a = screen.corner[t[0]], &b = screen.corner[t[1]], &c = screen.corner[t[2]];
    if (!a.usable || !b.usable || !c.usable) continue;
    const std::int64_t area = side_of(a, b, c.u, c.v);
    if (area == 0) continue;
    if (area < 0) std::swap(t[1], t[2]);  // rows run down
    const Edges edges(screen, t, view);
    if (edges.columns[0] >= edges.columns[1] || edges.rows[0] >= edges.rows[1]) continue;
    for (int band = edges.rows[0] / kRowsDrawn; band <= (edges.rows[1] - 1) / kRowsDrawn; ++band)
      screen.of_band[static_cast<std::size_t>(band)].push_back(
          static_cast<std::uint32_t>(screen.triangle.size()));
    screen.triangle.push_back(t);
    screen.enters.push_back(area < 0 ? 1 : -1);
  }
  screen.flat.resize(screen.triangle.size());
  parallel_for(screen.flat.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const auto& [a, b, c] = screen.triangle[k];
      const Vec3d &from = mesh.position[a],
                  across = cross(mesh.position[b] - from, mesh.position[c] - from);
      // The corners run the other way where the triangle faces the eye.
      screen.flat[k] =
          normalized(world_direction(view, across * static_cast<double>(-screen.enters[k])));
    }
  });
  return screen;
}

// Where a ray meets a triangle.
struct Crossing {
  double depth;  // particle radii
  std::uint32_t triangle;
  std::int32_t enters;

  bool operator<(const Crossing& other) const {
    if (depth != other.depth) return depth < other.depth;
    if (enters != other.enters) return enters > other.enters;  // bodies that touch are one
    return triangle < other.triangle;
  }
};

// What lies behind the fronts of a band of rows: the crossings of each of its pixels, one after the
// other.
struct BandCrossings {
  struct Link {
    Crossing crossing;
    std::uint32_t next;
  };
  static constexpr std::uint32_t kEnd = ~0u;
  int width, first;                 // columns; the first row
  std::vector<double> start;        // [pixels] of the fronts, particle radii
  std::vector<std::uint32_t> head;  // [pixels]
  std::vector<Link> links;

  explicit BandCrossings(int columns) : width(columns), first(0) {}

  void clear(const View& view, const std::vector<float>& front, int first_row, int rows) {
    first = first_row;
    const std::size_t n = static_cast<std::size_t>(rows) * static_cast<std::size_t>(width);
    const float* const from =
        &front[static_cast<std::size_t>(first) * static_cast<std::size_t>(width)];
    head.assign(n, kEnd);
    start.resize(n);
    for (std::size_t p = 0; p < n; ++p) start[p] = from[p] / view.radius;
    links.clear();
  }

  // Draws the rows of a triangle that lie in the band. Its depth is a quotient of two functions
  // that are linear on the screen.
  void draw(const Edges& edges, std::uint32_t triangle, std::int32_t enters, int rows) {
    const auto& [a, b, c] = edges.corner;
    std::array<std::int64_t, 3> to_right{b->v - c->v, c->v - a->v, a->v - b->v};
    const std::array<std::int64_t, 3> beside{owns_edge(*b, *c) ? 0 : 1, owns_edge(*c, *a) ? 0 : 1,
                                             owns_edge(*a, *b) ? 0 : 1};
    for (std::int64_t& step : to_right) step *= static_cast<std::int64_t>(kSubpixels);
    const std::array<double, 3> below{a->inverse_w, b->inverse_w, c->inverse_w},
        above{a->inverse_w * a->depth, b->inverse_w * b->depth, c->inverse_w * c->depth};
    const int top = std::max(first, edges.rows[0]), behind = std::min(first + rows, edges.rows[1]);
    for (int row = top; row < behind; ++row) {
      const std::size_t row_at =
          static_cast<std::size_t>(row - first) * static_cast<std::size_t>(width);
      auto [e0, e1, e2] = sides_of(edges.corner, centre_of(edges.columns[0]), centre_of(row));
      bool met = false;
      for (int column = edges.columns[0]; column < edges.columns[1];
           ++column, e0 += to_right[0], e1 += to_right[1], e2 += to_right[2]) {
        if (((e0 - beside[0]) | (e1 - beside[1]) | (e2 - beside[2])) < 0) {
          if (met) break;
          continue;
        }
        met = true;
        const double x = static_cast<double>(e0), y = static_cast<double>(e1),
                     z = static_cast<double>(e2);
        const double depth = (x * above[0] + y * above[1] + z * above[2]) /
                             (x * below[0] + y * below[1] + z * below[2]);
        const std::size_t p = row_at + static_cast<std::size_t>(column);
        if (!(depth > start[p])) continue;
        links.push_back({{depth, triangle, enters}, head[p]});
        head[p] = static_cast<std::uint32_t>(links.size() - 1);
      }
    }
  }

  // Those of a pixel, in order.
  void list(std::size_t pixel, std::vector<Crossing>& sorted) const {
    sorted.clear();
    for (std::uint32_t at = head[pixel]; at != kEnd; at = links[at].next) {
      sorted.push_back(links[at].crossing);
      for (std::size_t k = sorted.size() - 1; k > 0 && sorted[k] < sorted[k - 1]; --k)
        std::swap(sorted[k], sorted[k - 1]);
    }
  }
};

// The mesh's normal where a ray meets a triangle, world axes.
Vec3d normal_at(const ScreenMesh& screen, const Crossing& met, int column, int row) {
  const std::array<std::uint32_t, 3>& t = screen.triangle[met.triangle];
  const std::array<const ScreenCorner*, 3> corner{&screen.corner[t[0]], &screen.corner[t[1]],
                                                  &screen.corner[t[2]]};
  const std::array<std::int64_t, 3> sides = sides_of(corner, centre_of(column), centre_of(row));
  const Vec3d& flat = screen.flat[met.triangle];
  Vec3d sum;
  for (int k = 0; k < 3; ++k) {
    const Vec3d& normal = corner[k]->normal;
    sum += (dot(normal, flat) < kCreaseNormals ? flat : normal) *
           (static_cast<double>(sides[k]) * corner[k]->inverse_w);
  }
  return normalized(sum, flat);
}

struct Interval {
  double from, to;  // depths, particle radii
  const Crossing* leaving = nullptr;
};

// The bodies along one ray behind its front, from its crossings there in order; air of less depth
// than `least_air` is none. The mesh is closed: what a ray leaves more often than it enters it
// behind the front, it is in there, and its body begins before it.
void list_intervals(const std::vector<Crossing>& crossings, double least_air,
                    std::vector<Interval>& bodies) {
  bodies.clear();
  int all = 0;
  for (const Crossing& c : crossings) all += c.enters;
  int within = std::max(-all, 0);
  double from = 0;
  for (const Crossing& c : crossings) {
    const int before = within;
    within += c.enters;
    if (before <= 0 && within > 0) from = c.depth;
    if (before <= 0 || within > 0) continue;
    if (!bodies.empty() && from - bodies.back().to < least_air)
      bodies.back() = {bodies.back().from, c.depth, &c};
    else
      bodies.push_back({from, c.depth, &c});
  }
}

// The next number above a depth that is not negative.
float next_above(float depth) {
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(depth) + 1);
}

struct Tracer {
  const View& view;
  const ScreenMesh& screen;
  const std::vector<float>& front;
  Layers& layers;

  // Writes what is kept of one ray. `bodies` is room to work in.
  void write(int column, int row, const std::vector<Crossing>& crossings,
             std::vector<Interval>& bodies) const {
    const std::size_t pixels = front.size(),
                      pixel = static_cast<std::size_t>(row) * static_cast<std::size_t>(view.width) +
                              static_cast<std::size_t>(column);
    const float first = front[pixel];
    const Vec3d along = ray_direction(view, column + 0.5, row + 0.5);
    const double stretch = length(along), start = first / view.radius;
    list_intervals(crossings, kThinAir / stretch, bodies);
    if (bodies.empty() || bodies[0].from > start + kMeetsFront / stretch)
      bodies.insert(bodies.begin(), {start, start + kFilm / stretch, nullptr});

    const auto most = static_cast<std::size_t>(layers.most);
    double thickness = 0;
    std::size_t count = 0;
    float last = 0;  // where the layer before ends
    for (const Interval& body : bodies) {
      const float from =
          count == 0 ? first : std::max(world_depth(view, body.from), next_above(last));
      float to = world_depth(view, body.to);
      if (count == 0) to = std::max(to, next_above(from));
      if (!(to > from)) continue;
      if (count < most) {
        layers.entry[count * pixels + pixel] = from;
        layers.exit[count * pixels + pixel] = to;
      }
      if (count == 0)
        layers.back_normal[pixel] = static_cast<Vec3>(
            body.leaving != nullptr ? normal_at(screen, *body.leaving, column, row)
                                    : world_direction(view, normalized(along)));
      thickness += (double{to} - double{from}) * stretch;
      ++count;
      last = to;
    }
    layers.count[pixel] = static_cast<std::uint32_t>(count);
    layers.thickness[pixel] = static_cast<float>(thickness);
  }
};

}  // namespace

Layers trace_layers(const View& view, const DualMesh& mesh, const std::vector<float>& front,
                    int most) {
  Layers layers;
  const std::size_t pixels = front.size();
  layers.most = most;
  layers.count.resize(pixels, 0);
  layers.thickness.resize(pixels, 0);
  layers.back_normal.resize(pixels);
  layers.entry.resize(pixels * static_cast<std::size_t>(most), kNoSurface);
  layers.exit.resize(pixels * static_cast<std::size_t>(most), kNoSurface);

  const ScreenMesh screen = project_mesh(view, mesh);
  const Tracer tracer{view, screen, front, layers};
  parallel_for(screen.of_band.size(), 1, [&](std::size_t begin, std::size_t end) {
    BandCrossings band(view.width);
    std::vector<Crossing> crossings;
    std::vector<Interval> bodies;
    for (std::size_t k = begin; k < end; ++k) {
      const int first = static_cast<int>(k) * kRowsDrawn,
                rows = std::min(kRowsDrawn, view.height - first);
      band.clear(view, front, first, rows);
      for (const std::uint32_t t : screen.of_band[k])
        band.draw(Edges(screen, screen.triangle[t], view), t, screen.enters[t], rows);
      for (int row = first; row < first + rows; ++row)
        for (int column = 0; column < view.width; ++column) {
          const std::size_t p =
              static_cast<std::size_t>(row - first) * static_cast<std::size_t>(view.width) +
              static_cast<std::size_t>(column);
          if (!(band.start[p] < kNoSurface)) continue;
          band.list(p, crossings);
          tracer.write(column, row, crossings, bodies);
        }
    }
  });
  return layers;
}

}  // namespace meniscus
