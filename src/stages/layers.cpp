#include "stages/layers.hpp"

#include <algorithm>
#include <array>
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

// Vertices of a triangle whose normal is off the triangle's by more lie on a crease: there the
// triangle's own counts. 25 degrees.
constexpr double kCreaseNormals = 0.9063077870366499;

struct ScreenCorner {
  std::int64_t u, v;  // steps
  double depth, inverse_w;
};

// Twice the area to the right of a to b, where p lies.
std::int64_t side_of(const ScreenCorner& a, const ScreenCorner& b, std::int64_t u, std::int64_t v) {
  return (b.u - a.u) * (v - a.v) - (b.v - a.v) * (u - a.u);
}

// Of the two triangles beside an edge, which run along it either way, the one that has its points.
bool owns_edge(const ScreenCorner& a, const ScreenCorner& b) {
  return a.v == b.v ? b.u > a.u : b.v < a.v;
}

// A triangle on the screen, its corners so that its inside is to the right of its edges.
struct ScreenTriangle {
  std::array<ScreenCorner, 3> corner;
  std::array<std::uint32_t, 3> vertex;
  int enters;                        // 1 where it faces the eye, -1
  std::array<int, 2> columns, rows;  // whose centres it may cover, first and behind the last
};

// Where a triangle's plane is on a pixel's ray.
struct Crossing {
  int column;
  int enters;
  std::uint32_t triangle;
  double depth;                  // particle radii
  std::array<double, 3> weight;  // of the corners in space; not normalized

  bool operator<(const Crossing& other) const {
    if (column != other.column) return column < other.column;
    if (depth != other.depth) return depth < other.depth;
    if (enters != other.enters) return enters > other.enters;  // bodies that touch are one
    return triangle < other.triangle;
  }
};

struct Projector {
  const View& view;
  const DualMesh& mesh;
  std::vector<ScreenCorner> corner;
  std::vector<char> usable;

  Projector(const View& view_, const DualMesh& mesh_)
      : view(view_), mesh(mesh_), corner(mesh.position.size()), usable(mesh.position.size()) {
    parallel_for(corner.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        const Vec3d& at = mesh.position[k];
        const PixelPosition p = project(view, at);
        usable[k] = -at.z > 0 && p.w > 0 && std::abs(p.u) < kFarthestPixel &&
                    std::abs(p.v) < kFarthestPixel;
        if (usable[k])
          corner[k] = {std::llround(p.u * kSubpixels), std::llround(p.v * kSubpixels), -at.z,
                       1 / p.w};
      }
    });
  }

  // Whether a triangle covers any pixel's centre, perhaps.
  bool draw(const std::array<std::uint32_t, 3>& t, ScreenTriangle& drawn) const {
    if (!usable[t[0]] || !usable[t[1]] || !usable[t[2]]) return false;
    drawn.corner = {corner[t[0]], corner[t[1]], corner[t[2]]};
    drawn.vertex = t;
    const std::int64_t area =
        side_of(drawn.corner[0], drawn.corner[1], drawn.corner[2].u, drawn.corner[2].v);
    if (area == 0) return false;
    drawn.enters = area < 0 ? 1 : -1;  // rows run down
    if (area < 0) {
      std::swap(drawn.corner[1], drawn.corner[2]);
      std::swap(drawn.vertex[1], drawn.vertex[2]);
    }
    const auto range = [&](std::int64_t ScreenCorner::*axis, int size) {
      std::int64_t low = drawn.corner[0].*axis, high = low;
      for (const ScreenCorner& c : drawn.corner) {
        low = std::min(low, c.*axis);
        high = std::max(high, c.*axis);
      }
      const double first = std::ceil(static_cast<double>(low) / kSubpixels - 0.5),
                   last = std::floor(static_cast<double>(high) / kSubpixels - 0.5);
      return std::array{static_cast<int>(std::clamp<double>(first, 0, size)),
                        static_cast<int>(std::clamp<double>(last + 1, 0, size))};
    };
    drawn.columns = range(&ScreenCorner::u, view.width);
    drawn.rows = range(&ScreenCorner::v, view.height);
    return drawn.columns[0] < drawn.columns[1] && drawn.rows[0] < drawn.rows[1];
  }
};

std::int64_t centre_of(int pixel) {
  return static_cast<std::int64_t>(pixel) * static_cast<std::int64_t>(kSubpixels) +
         static_cast<std::int64_t>(kSubpixels) / 2;
}

// Adds where the triangle meets the rays of a row.
void cross_row(const ScreenTriangle& drawn, std::uint32_t triangle, int row,
               std::vector<Crossing>& found) {
  const auto& c = drawn.corner;
  const std::int64_t v = centre_of(row);
  for (int column = drawn.columns[0]; column < drawn.columns[1]; ++column) {
    const std::int64_t u = centre_of(column);
    std::array<double, 3> weight;
    bool inside = true;
    for (int k = 0; k < 3 && inside; ++k) {
      const ScreenCorner &a = c[(k + 1) % 3], &b = c[(k + 2) % 3];
      const std::int64_t side = side_of(a, b, u, v);
      inside = side > 0 || (side == 0 && owns_edge(a, b));
      weight[k] = static_cast<double>(side) * c[k].inverse_w;
    }
    if (!inside) continue;
    const double sum = weight[0] + weight[1] + weight[2];
    const double depth =
        (weight[0] * c[0].depth + weight[1] * c[1].depth + weight[2] * c[2].depth) / sum;
    found.push_back({column, drawn.enters, triangle, depth, weight});
  }
}

// The mesh's normal where it is crossed.
Vec3d normal_at(const DualMesh& mesh, const ScreenTriangle& drawn, const Crossing& crossing) {
  const Vec3d &a = mesh.position[drawn.vertex[0]], &b = mesh.position[drawn.vertex[1]],
              &c = mesh.position[drawn.vertex[2]];
  // The corners run the other way where the triangle faces the eye.
  const Vec3d flat = normalized(cross(b - a, c - a) * static_cast<double>(-drawn.enters));
  Vec3d sum;
  for (int k = 0; k < 3; ++k) {
    const Vec3d& n = mesh.normal[drawn.vertex[k]];
    sum += (dot(n, flat) < kCreaseNormals ? flat : n) * crossing.weight[k];
  }
  return normalized(sum, flat);
}

struct Interval {
  double from, to;  // depths, particle radii
  const Crossing* leaving = nullptr;
};

// The bodies along one ray, from its crossings in order.
void list_intervals(const Crossing* begin, const Crossing* end, std::vector<Interval>& bodies) {
  bodies.clear();
  int all = 0;
  for (const Crossing* c = begin; c != end; ++c) all += c->enters;
  int within = std::max(-all, 0);  // where the mesh's beginning lies behind the eye
  double from = 0;
  for (const Crossing* c = begin; c != end; ++c) {
    const int before = within;
    within += c->enters;
    if (before <= 0 && within > 0) from = c->depth;
    if (before > 0 && within <= 0) bodies.push_back({from, c->depth, c});
  }
}

struct Tracer {
  const View& view;
  const DualMesh& mesh;
  const Projector& projector;
  const std::vector<float>& front;
  Layers& layers;

  // Writes what is kept of one ray.
  void write(int column, int row, std::vector<Interval>& bodies) const {
    const std::size_t pixels = front.size(),
                      pixel = static_cast<std::size_t>(row) * static_cast<std::size_t>(view.width) +
                              static_cast<std::size_t>(column);
    const float first = front[pixel];
    if (!(first < kNoSurface)) return;
    const Vec3d along = ray_direction(view, column + 0.5, row + 0.5);
    const double stretch = length(along), start = first / view.radius;
    std::erase_if(bodies, [&](const Interval& body) { return !(body.to > start); });
    if (bodies.empty() || bodies[0].from > start + kMeetsFront / stretch)
      bodies.insert(bodies.begin(), {start, start + kFilm / stretch, nullptr});

    const auto most = static_cast<std::size_t>(layers.most);
    double thickness = 0;
    std::size_t count = 0;
    float last = 0;  // where the layer before ends
    for (const Interval& body : bodies) {
      const float next = std::nextafter(last, kNoSurface);
      const float from = count == 0 ? first : std::max(world_depth(view, body.from), next);
      float to = static_cast<float>(body.to * view.radius);
      if (count == 0) to = std::max(to, std::nextafter(from, kNoSurface));
      if (!(to > from)) continue;
      if (count < most) {
        layers.entry[count * pixels + pixel] = from;
        layers.exit[count * pixels + pixel] = to;
      }
      if (count == 0) {
        Vec3d normal = normalized(along);
        if (body.leaving != nullptr) {
          ScreenTriangle drawn{};
          projector.draw(mesh.triangle[body.leaving->triangle], drawn);
          normal = normal_at(mesh, drawn, *body.leaving);
        }
        layers.back_normal[pixel] = static_cast<Vec3>(world_direction(view, normal));
      }
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

  // The triangles of each band, in their order.
  const Projector projector(view, mesh);
  const auto bands = static_cast<std::size_t>((view.height + kRowsDrawn - 1) / kRowsDrawn);
  std::vector<std::vector<std::uint32_t>> of_band(bands);
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    ScreenTriangle drawn{};
    if (!projector.draw(mesh.triangle[t], drawn)) continue;
    for (int band = drawn.rows[0] / kRowsDrawn; band <= (drawn.rows[1] - 1) / kRowsDrawn; ++band)
      of_band[static_cast<std::size_t>(band)].push_back(static_cast<std::uint32_t>(t));
  }

  const Tracer tracer{view, mesh, projector, front, layers};
  parallel_for(bands, 1, [&](std::size_t begin, std::size_t end) {
    std::array<std::vector<Crossing>, kRowsDrawn> rows;
    std::vector<Interval> bodies;
    for (std::size_t band = begin; band < end; ++band) {
      const int first = static_cast<int>(band) * kRowsDrawn,
                behind = std::min(first + kRowsDrawn, view.height);
      for (const std::uint32_t t : of_band[band]) {
        ScreenTriangle drawn{};
        projector.draw(mesh.triangle[t], drawn);
        for (int row = std::max(first, drawn.rows[0]); row < std::min(behind, drawn.rows[1]); ++row)
          cross_row(drawn, t, row, rows[static_cast<std::size_t>(row - first)]);
      }
      for (int row = first; row < behind; ++row) {
        std::vector<Crossing>& crossings = rows[static_cast<std::size_t>(row - first)];
        std::sort(crossings.begin(), crossings.end());
        const Crossing* at = crossings.data();
        const Crossing* const last = at + crossings.size();
        for (int column = 0; column < view.width; ++column) {
          const Crossing* next = at;
          while (next != last && next->column == column) ++next;
          list_intervals(at, next, bodies);
          tracer.write(column, row, bodies);
          at = next;
        }
        crossings.clear();
      }
    }
  });
  return layers;
}

}  // namespace meniscus
