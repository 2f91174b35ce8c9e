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

// Air between two bodies that is thinner along the ray is none: it is the surface's roughness,
// where a ray skims it or nicks an edge. Particles of two sheets leave at least .7 between the
// sheets.
constexpr double kThinAir = 0.5;

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

// What the corners of a triangle count in space where a ray meets it, whether or not it does; their
// sum is not 1.
struct Weights {
  std::array<double, 3> of;
  bool inside = true;

  Weights(const ScreenTriangle& drawn, std::int64_t u, std::int64_t v) {
    for (int k = 0; k < 3; ++k) {
      const ScreenCorner &a = drawn.corner[(k + 1) % 3], &b = drawn.corner[(k + 2) % 3];
      const std::int64_t side = side_of(a, b, u, v);
      inside &= side > 0 || (side == 0 && owns_edge(a, b));
      of[k] = static_cast<double>(side) * drawn.corner[k].inverse_w;
    }
  }
};

// All crossings of the rays of a row, by columns.
struct RowCrossings {
  std::vector<std::pair<int, Crossing>> found;  // column
  std::vector<std::size_t> end;                 // [columns] in `sorted`
  std::vector<Crossing> sorted;

  void add(const ScreenTriangle& drawn, std::uint32_t triangle, int row) {
    const std::int64_t v = centre_of(row);
    for (int column = drawn.columns[0]; column < drawn.columns[1]; ++column) {
      const Weights weights(drawn, centre_of(column), v);
      if (!weights.inside) continue;
      const auto& [a, b, c] = weights.of;
      const double depth =
          (a * drawn.corner[0].depth + b * drawn.corner[1].depth + c * drawn.corner[2].depth) /
          (a + b + c);
      found.push_back({column, {depth, triangle, drawn.enters}});
    }
  }

  void sort(int columns) {
    end.assign(static_cast<std::size_t>(columns) + 1, 0);
    for (const auto& crossing : found) ++end[static_cast<std::size_t>(crossing.first) + 1];
    for (std::size_t k = 1; k < end.size(); ++k) end[k] += end[k - 1];
    sorted.resize(found.size());
    for (const auto& crossing : found)
      sorted[end[static_cast<std::size_t>(crossing.first)]++] = crossing.second;
    for (std::size_t k = 0, first = 0; k < end.size(); first = end[k++])
      if (end[k] - first > 1) std::sort(&sorted[first], &sorted[first] + (end[k] - first));
    found.clear();
  }
};

// The mesh's normal at a place of a triangle.
Vec3d normal_at(const DualMesh& mesh, const ScreenTriangle& drawn, const Weights& weights) {
  const Vec3d &a = mesh.position[drawn.vertex[0]], &b = mesh.position[drawn.vertex[1]],
              &c = mesh.position[drawn.vertex[2]];
  // The corners run the other way where the triangle faces the eye.
  const Vec3d flat = normalized(cross(b - a, c - a) * static_cast<double>(-drawn.enters));
  Vec3d sum;
  for (int k = 0; k < 3; ++k) {
    const Vec3d& n = mesh.normal[drawn.vertex[k]];
    sum += (dot(n, flat) < kCreaseNormals ? flat : n) * weights.of[k];
  }
  return normalized(sum, flat);
}

struct Interval {
  double from, to;  // depths, particle radii
  const Crossing* leaving = nullptr;
};

// The bodies along one ray, from its crossings in order; air of less depth than `least_air` is
// none.
void list_intervals(const Crossing* begin, const Crossing* end, double least_air,
                    std::vector<Interval>& bodies) {
  bodies.clear();
  int all = 0;
  for (const Crossing* c = begin; c != end; ++c) all += c->enters;
  int within = std::max(-all, 0);  // where the mesh's beginning lies behind the eye
  double from = 0;
  for (const Crossing* c = begin; c != end; ++c) {
    const int before = within;
    within += c->enters;
    if (before <= 0 && within > 0) from = c->depth;
    if (before <= 0 || within > 0) continue;
    if (!bodies.empty() && from - bodies.back().to < least_air)
      bodies.back() = {bodies.back().from, c->depth, c};
    else
      bodies.push_back({from, c->depth, c});
  }
}

struct Tracer {
  const View& view;
  const DualMesh& mesh;
  const Projector& projector;
  const std::vector<float>& front;
  Layers& layers;

  // Writes what is kept of one ray. `bodies` is room to work in.
  void write(int column, int row, const RowCrossings& crossings,
             std::vector<Interval>& bodies) const {
    const std::size_t pixels = front.size(),
                      pixel = static_cast<std::size_t>(row) * static_cast<std::size_t>(view.width) +
                              static_cast<std::size_t>(column);
    const float first = front[pixel];
    if (!(first < kNoSurface)) return;
    const Vec3d along = ray_direction(view, column + 0.5, row + 0.5);
    const double stretch = length(along), start = first / view.radius;
    const auto c = static_cast<std::size_t>(column);
    list_intervals(crossings.sorted.data() + (c > 0 ? crossings.end[c - 1] : 0),
                   crossings.sorted.data() + crossings.end[c], kThinAir / stretch, bodies);
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
      float to = world_depth(view, body.to);
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
          normal = normal_at(mesh, drawn, Weights(drawn, centre_of(column), centre_of(row)));
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

  // The triangles of each band of rows, in their order.
  const Projector projector(view, mesh);
  const auto bands = static_cast<std::size_t>((view.height + kRowsDrawn - 1) / kRowsDrawn);
  std::vector<std::array<int, 2>> rows_of(mesh.triangle.size());
  parallel_for(rows_of.size(), 4096, [&](std::size_t begin, std::size_t end) {
    ScreenTriangle drawn{};
    for (std::size_t t = begin; t < end; ++t)
      if (projector.draw(mesh.triangle[t], drawn)) rows_of[t] = drawn.rows;
  });
  std::vector<std::vector<std::uint32_t>> of_band(bands);
  for (std::size_t t = 0; t < rows_of.size(); ++t)
    if (rows_of[t][0] < rows_of[t][1])
      for (int band = rows_of[t][0] / kRowsDrawn; band <= (rows_of[t][1] - 1) / kRowsDrawn; ++band)
        of_band[static_cast<std::size_t>(band)].push_back(static_cast<std::uint32_t>(t));

  const Tracer tracer{view, mesh, projector, front, layers};
  parallel_for(bands, 1, [&](std::size_t begin, std::size_t end) {
    std::array<RowCrossings, kRowsDrawn> rows;
    std::vector<Interval> bodies;
    ScreenTriangle drawn{};
    for (std::size_t band = begin; band < end; ++band) {
      const int first = static_cast<int>(band) * kRowsDrawn,
                behind = std::min(first + kRowsDrawn, view.height);
      for (const std::uint32_t t : of_band[band]) {
        projector.draw(mesh.triangle[t], drawn);
        for (int row = std::max(first, drawn.rows[0]); row < std::min(behind, drawn.rows[1]); ++row)
          rows[static_cast<std::size_t>(row - first)].add(drawn, t, row);
      }
      for (int row = first; row < behind; ++row) {
        RowCrossings& crossings = rows[static_cast<std::size_t>(row - first)];
        crossings.sort(view.width);
        for (int column = 0; column < view.width; ++column)
          tracer.write(column, row, crossings, bodies);
      }
    }
  });
  return layers;
}

}  // namespace meniscus
