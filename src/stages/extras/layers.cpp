#include "stages/extras/layers.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "base/parallel.hpp"
#include "stages/extras/layer_rows.hpp"

namespace meniscus {
namespace {

constexpr int kRowsDrawn = 16;  // rows of pixels that one thread draws at a time
constexpr int kSubpixelBits = 12;
constexpr std::int64_t kSubpixels = 1 << kSubpixelBits;  // of a pixel
constexpr double kFarthestPixel = 1
                                  << 17;  // pixels; products of differences of steps fit in 64 bits

// A mesh's entry so near behind the front, along the ray, is the front's: where the ray meets a
// steep face beside an edge, both may be that far from each other. Particle radii.
constexpr double kMeetsFront = 4;
// Thickness of a film: a front that the mesh does not know. Particle radii along the ray.
constexpr double kFilm = 0.02;

// Air between two bodies that is thinner along the ray is none: it is the surface's roughness,
// where a ray skims it or nicks an edge. Particles of two sheets leave at least .7 between the
// sheets. Water at the front that is thinner is none, either, where the mesh enters kFold behind
// the front at most: the front bulges there before a fold of the mesh. Particle radii.
constexpr double kThinnest = 0.5, kFold = 2;

// Vertices of a triangle whose normal is off the triangle's by more lie on a crease: there the
// triangle's own counts. 25 degrees.
constexpr double kCreaseNormals = 0.9063077870366499;

// A vertex on the screen.
struct ScreenCorner {
  std::int64_t u = 0, v = 0;  // steps
  float depth = 0;            // world units
  float inverse_w = 0;
  Vec3d normal;  // world axes
  bool usable = false;
  bool shown = false;  // not farther behind the front of its pixel than entries that do not count
};

// A triangle that rays may meet. Its inside is to the right of its edges; the k-th lies opposite
// corner k.
struct Face {
  std::array<std::uint32_t, 3> corner;
  std::array<int, 2> columns, rows;  // whose centres it may cover, first and behind the last
  bool enters;                       // it faces the eye
};

struct ScreenMesh {
  std::vector<ScreenCorner> corner;  // [vertices]
  std::vector<Face> face;
  std::vector<std::vector<std::uint32_t>> of_band;  // [bands] their faces, ascending
};

using FaceCorners = std::array<const ScreenCorner*, 3>;

FaceCorners corners_of(const ScreenMesh& screen, const std::array<std::uint32_t, 3>& t) {
  return {&screen.corner[t[0]], &screen.corner[t[1]], &screen.corner[t[2]]};
}

// Twice the area to the right of a to b, where p lies.
std::int64_t side_of(const ScreenCorner& a, const ScreenCorner& b, std::int64_t u, std::int64_t v) {
  return (b.u - a.u) * (v - a.v) - (b.v - a.v) * (u - a.u);
}

// How far a point lies to the right of each edge of a triangle.
using Sides = std::array<std::int64_t, 3>;
Sides sides_of(const FaceCorners& corner, std::int64_t u, std::int64_t v) {
  return {side_of(*corner[1], *corner[2], u, v), side_of(*corner[2], *corner[0], u, v),
          side_of(*corner[0], *corner[1], u, v)};
}

// Of the two triangles beside an edge, which run along it either way, the one that has its points.
bool owns_edge(const ScreenCorner& a, const ScreenCorner& b) {
  return a.v == b.v ? b.u > a.u : b.v < a.v;
}

std::int64_t centre_of(int pixel) { return pixel * kSubpixels + kSubpixels / 2; }

// The pixels whose centres lie between the least and the largest of three steps along an axis: the
// first, and the one behind the last.
std::array<int, 2> pixels_between(std::int64_t a, std::int64_t b, std::int64_t c, int size) {
  const auto centres_before = [&](std::int64_t step) {
    return static_cast<int>(
        std::clamp<std::int64_t>((step + kSubpixels / 2 - 1) >> kSubpixelBits, 0, size));
  };
  return {centres_before(std::min({a, b, c})), centres_before(std::max({a, b, c}) + 1)};
}

// The outward normals at a triangle's corners, world axes, by which its sides are multiplied: their
// sum is linear on the screen but for its length, which means nothing. It is about as many pixels
// as the triangle has, over its depth, so that its square is a float in any unit of length.
std::array<Vec3, 3> normals_of(const View& view, const DualMesh& mesh, const Face& face,
                               const FaceCorners& corner) {
  const double unit =
      (std::abs(view.w_row[2]) + std::abs(view.w_row[3])) * (1.0 / kSubpixels);  // of w, per pixel
  const auto& [a, b, c] = face.corner;
  const Vec3d& from = mesh.position[a];
  const Vec3d flat = world_direction(view, cross(mesh.position[b] - from, mesh.position[c] - from));
  const double least = kCreaseNormals * kCreaseNormals * dot(flat, flat);
  std::array<Vec3, 3> normals;
  for (std::size_t k = 0; k < 3; ++k) {
    const double along = dot(corner[k]->normal, flat);
    const bool crease = !(along > 0 && along * along >= least);
    normals[k] = static_cast<Vec3>((crease ? normalized(flat) : corner[k]->normal) *
                                   (double{corner[k]->inverse_w} * unit));
  }
  return normals;
}

// Projects the mesh, and lists the faces of each band of rows. Those that rays enter at the front
// are left out: most that they enter.
ScreenMesh project_mesh(const View& view, const DualMesh& mesh, const float* front,
                        float least_air) {
  ScreenMesh screen;
  screen.corner.resize(mesh.position.size());
  parallel_for(screen.corner.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const Vec3d& at = mesh.position[k];
      const PixelPosition p = project(view, at);
      if (!(-at.z > 0 && p.w > 0 && std::abs(p.u) < kFarthestPixel &&
            std::abs(p.v) < kFarthestPixel))
        continue;
      screen.corner[k] = {std::llround(p.u * kSubpixels),          std::llround(p.v * kSubpixels),
                          static_cast<float>(-at.z * view.radius), static_cast<float>(1 / p.w),
                          world_direction(view, mesh.normal[k]),   true};
    }
    // Pixels lie far from each other in memory: a loop that does nothing else waits for many at
    // once.
    for (std::size_t k = begin; k < end; ++k) {
      ScreenCorner& corner = screen.corner[k];
      const std::int64_t column = corner.u >> kSubpixelBits, row = corner.v >> kSubpixelBits;
      if (column < 0 || row < 0 || column >= view.width || row >= view.height) continue;
      corner.shown = corner.depth <= front[row * view.width + column] + least_air;
    }
  });
  screen.of_band.resize(static_cast<std::size_t>((view.height + kRowsDrawn - 1) / kRowsDrawn));
  screen.face.reserve(mesh.triangle.size());
  for (std::array<std::uint32_t, 3> t : mesh.triangle) {
    const auto [a, b, c] = corners_of(screen, t);
    if (!a->usable || !b->usable || !c->usable) continue;
    const std::int64_t area = side_of(*a, *b, c->u, c->v);
    const bool enters = area < 0;  // rows run down
    if (area == 0 || (enters && a->shown && b->shown && c->shown)) continue;
    const std::array<int, 2> columns = pixels_between(a->u, b->u, c->u, view.width),
                             rows = pixels_between(a->v, b->v, c->v, view.height);
    if (columns[0] >= columns[1] || rows[0] >= rows[1]) continue;
    const auto number = static_cast<std::uint32_t>(screen.face.size());
    for (int band = rows[0] / kRowsDrawn; band <= (rows[1] - 1) / kRowsDrawn; ++band)
      screen.of_band[static_cast<std::size_t>(band)].push_back(number);
    if (enters) std::swap(t[1], t[2]);
    screen.face.push_back({t, columns, rows, enters});
  }
  return screen;
}

// What a face's rows in a band are drawn from. Its depth is a quotient of two numbers that are
// linear on the screen, as its normal is. An entry that is less than `least_air` behind the front
// tells nothing: the first body begins at the front, and air between both would be none.
FaceRows rows_of(const View& view, const DualMesh& mesh, const ScreenMesh& screen, const Face& face,
                 int first, int behind, float least_air) {
  const FaceCorners corner = corners_of(screen, face.corner);
  const int top = std::max(first, face.rows[0]);
  FaceRows rows{};
  rows.column = face.columns[0];
  rows.columns = face.columns[1] - face.columns[0];
  rows.row = top - first;
  rows.rows = std::min(behind, face.rows[1]) - top;
  rows.enters = face.enters;
  rows.nearest = face.enters ? least_air : 0;
  rows.depth = corner[0]->depth;
  rows.least = std::min({corner[0]->depth, corner[1]->depth, corner[2]->depth});
  rows.most = std::max({corner[0]->depth, corner[1]->depth, corner[2]->depth});
  const Sides sides = sides_of(corner, centre_of(face.columns[0]), centre_of(top));
  std::array<float, 3> side, by_column, by_row, below;
  for (std::size_t k = 0; k < 3; ++k) {
    const ScreenCorner &from = *corner[(k + 1) % 3], &to = *corner[(k + 2) % 3];
    rows.to_right[k] = from.v - to.v;
    rows.down[k] = to.u - from.u;
    rows.within[k] = (sides[k] - (owns_edge(from, to) ? 0 : 1)) >> kSubpixelBits;
    side[k] = static_cast<float>(sides[k]) * (1.0f / kSubpixels);
    by_column[k] = static_cast<float>(rows.to_right[k]);
    by_row[k] = static_cast<float>(rows.down[k]);
    below[k] = corner[k]->inverse_w;
  }
  // What is a at the first corner, b and c at the others.
  const auto put = [&](FaceNumber n, float a, float b, float c) {
    rows.at[n] = a * side[0] + b * side[1] + c * side[2];
    rows.by_column[n] = a * by_column[0] + b * by_column[1] + c * by_column[2];
    rows.by_row[n] = a * by_row[0] + b * by_row[1] + c * by_row[2];
  };
  put(kAbove, 0, below[1] * (corner[1]->depth - rows.depth),
      below[2] * (corner[2]->depth - rows.depth));
  put(kBelow, below[0], below[1], below[2]);
  if (face.enters) return rows;
  const auto [a, b, c] = normals_of(view, mesh, face, corner);
  put(kNormalX, a.x, b.x, c.x);
  put(kNormalY, a.y, b.y, c.y);
  put(kNormalZ, a.z, b.z, c.z);
  return rows;
}

// A crossing of a ray. In order of these numbers: by depth, which is positive; entries before
// exits, because bodies that touch are one; as they were drawn.
class Crossing {
 public:
  Crossing(float depth, bool enters, std::size_t drawn)
      : bits_(std::uint64_t{std::bit_cast<std::uint32_t>(depth)} << 32 |
              std::uint64_t{!enters} << 31 | drawn) {}
  float depth() const { return std::bit_cast<float>(static_cast<std::uint32_t>(bits_ >> 32)); }
  int enters() const { return (bits_ >> 31 & 1) != 0 ? -1 : 1; }  // -1: the ray leaves
  std::size_t drawn() const { return bits_ & 0x7fffffff; }
  auto operator<=>(const Crossing&) const = default;

 private:
  std::uint64_t bits_;
};

// Lists the crossings of single pixels of a band.
class PixelCrossings {
 public:
  explicit PixelCrossings(const BandCrossings& band)
      : band_(band), last_(band.exit.size(), kNoOther) {}

  // Once all of a band are drawn: finds out which pixels have others than the first exit.
  void link() {
    if (before_.size() < band_.others) before_.resize(band_.other_pixel.size());
    for (std::size_t k = 0; k < band_.others; ++k) {
      std::uint32_t& last = last_[band_.other_pixel[k] / 2];
      before_[k] = last;
      last = static_cast<std::uint32_t>(k);
    }
  }

  // Forgets them again.
  void unlink() {
    for (std::size_t k = 0; k < band_.others; ++k) last_[band_.other_pixel[k] / 2] = kNoOther;
  }

  // [pixels] of the band: the last one of the others, or kNoOther.
  const std::uint32_t* last() const { return last_.data(); }

  // The crossings of a pixel, in order. `drawn`: 0, or 1 + the place of another one.
  void list(std::size_t pixel, std::vector<Crossing>& sorted) const {
    sorted.clear();
    if (band_.exit[pixel] < kNoSurface) sorted.emplace_back(band_.exit[pixel], false, 0);
    for (std::uint32_t at = last_[pixel]; at != kNoOther; at = before_[at]) {
      sorted.emplace_back(band_.other_depth[at], (band_.other_pixel[at] & 1) != 0, at + 1);
      for (std::size_t k = sorted.size() - 1; k > 0 && sorted[k] < sorted[k - 1]; --k)
        std::swap(sorted[k], sorted[k - 1]);
    }
  }

  Vec3 normal(std::size_t pixel, std::size_t drawn) const {
    const std::size_t at = drawn == 0 ? pixel : drawn - 1;
    const std::array<std::vector<float>, 3>& of = drawn == 0 ? band_.normal : band_.other_normal;
    return {of[0][at], of[1][at], of[2][at]};
  }

 private:
  const BandCrossings& band_;
  std::vector<std::uint32_t> last_, before_;
};

struct Interval {
  float from, to;                     // depths, world units
  std::optional<std::size_t> leaves;  // Crossing::drawn() of its end; none: a film's
};

// The bodies along one ray behind its front, from its crossings there in order; air of less depth
// than `least_air` is none. The mesh is closed but for the front: what a ray leaves more often than
// it enters it behind the front, it is in there, and its body begins before it.
void list_intervals(const std::vector<Crossing>& crossings, float least_air,
                    std::vector<Interval>& bodies) {
  bodies.clear();
  int all = 0;
  for (const Crossing& c : crossings) all += c.enters();
  int within = std::max(-all, 0);
  float from = 0;
  for (const Crossing& c : crossings) {
    const int before = within;
    within += c.enters();
    if (before <= 0 && within > 0) from = c.depth();
    if (before <= 0 || within > 0) continue;
    if (!bodies.empty() && from - bodies.back().to < least_air)
      bodies.back() = {bodies.back().from, c.depth(), c.drawn()};
    else
      bodies.push_back({from, c.depth(), c.drawn()});
  }
}

// The next number above a depth that is not negative.
float next_above(float depth) {
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(depth) + 1);
}

struct Tracer {
  const View& view;
  Layers& layers;  // whose first entries are the front
  FillOnce* fill;

  // Writes a row: most rays leave the mesh once behind the front and meet it nowhere else. Pixels
  // without a front are passed over several at a time. `crossings` and `bodies` are room to work
  // in.
  void write_row(int row, std::size_t in_band, const PixelCrossings& of, BandCrossings& band,
                 std::vector<Crossing>& crossings, std::vector<Interval>& bodies) const {
    constexpr int kAtATime = 32;
    const std::size_t pixel = static_cast<std::size_t>(row) * static_cast<std::size_t>(view.width);
    for (int column = 0; column < view.width; column += kAtATime) {
      const RowPart part{column, row, std::min(kAtATime, view.width - column),
                         pixel + static_cast<std::size_t>(column),
                         in_band + static_cast<std::size_t>(column)};
      const float* const front = &layers.entry[part.pixel];
      int any = 0;
      for (int k = 0; k < part.count; ++k) any |= front[k] < kNoSurface;
      if (any == 0) continue;
      std::uint32_t rest = fill(view, part, band, of.last(), layers);
      for (; rest != 0; rest &= rest - 1) {
        const int k = std::countr_zero(rest);
        if (front[k] == kNoSurface) continue;
        const std::size_t at = part.in_band + static_cast<std::size_t>(k);
        const double stretch = stretch_of(column + k, row);  // a root, done before it is needed
        of.list(at, crossings);
        write(column + k, row, stretch, part.pixel + static_cast<std::size_t>(k), at, of, crossings,
              bodies);
      }
      std::fill_n(&band.exit[part.in_band], part.count, kNoSurface);
    }
  }

  // Writes what is kept of one ray.
  void write(int column, int row, double stretch, std::size_t pixel, std::size_t in_band,
             const PixelCrossings& of, const std::vector<Crossing>& crossings,
             std::vector<Interval>& bodies) const {
    const float first = layers.entry[pixel];
    layers.exit[pixel] = kNoSurface;
    const double depth_of_radius = view.radius / stretch;
    const auto thinnest = static_cast<float>(kThinnest * depth_of_radius);
    const double meets_front = first + kMeetsFront * depth_of_radius,
                 fold = first + kFold * depth_of_radius;
    list_intervals(crossings, thinnest, bodies);
    if (bodies.size() > 1 && bodies[0].to < first + thinnest && bodies[1].from <= fold)
      bodies.erase(bodies.begin());
    if (bodies.empty() || bodies[0].from > meets_front)
      bodies.insert(bodies.begin(),
                    {first, static_cast<float>(first + kFilm * depth_of_radius), std::nullopt});
    bodies[0] = {first, std::max(bodies[0].to, next_above(first)), bodies[0].leaves};
    double thickness = 0;
    std::uint32_t count = 0;
    float last = 0;  // where the layer before ends
    for (const Interval& body : bodies) {
      const float from = std::max(body.from, next_above(last));
      if (!(body.to > from)) continue;
      put(pixel, count++, from, body.to);
      thickness += (double{body.to} - double{from}) * stretch;
      last = body.to;
    }
    if (bodies[0].leaves)
      put_normal(pixel, of.normal(in_band, *bodies[0].leaves));
    else
      layers.back_normal[pixel] = static_cast<Vec3>(
          world_direction(view, normalized(ray_direction(view, column + 0.5, row + 0.5))));
    layers.count[pixel] = count;
    layers.thickness[pixel] = static_cast<float>(thickness);
  }

 private:
  // How long the way along a ray is for its depth.
  double stretch_of(int column, int row) const {
    return length(ray_direction(view, column + 0.5, row + 0.5));
  }

  void put(std::size_t pixel, std::uint32_t layer, float from, float to) const {
    if (layer >= static_cast<std::uint32_t>(layers.most)) return;
    const std::size_t at = layer * layers.count.size() + pixel;
    layers.entry[at] = from;
    layers.exit[at] = to;
  }

  // The normal where the first body ends, made a unit one.
  void put_normal(std::size_t pixel, const Vec3& n) const {
    const float size = 1 / std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
    layers.back_normal[pixel] = {n.x * size, n.y * size, n.z * size};
  }
};

// Makes a map larger by pixels without a surface. Copies of a short run go to memory that is not
// read before; a loop that fills it reads each line first, and takes three times as long.
void add_nothing(std::vector<float>& map, std::size_t size) {
  std::array<float, 1024> run;
  run.fill(kNoSurface);
  map.reserve(size);
  while (map.size() < size) {
    const std::size_t count = std::min(size - map.size(), run.size());
    map.insert(map.end(), run.begin(), run.begin() + static_cast<std::ptrdiff_t>(count));
  }
}

// How much longer the way along a ray is than its depth, at most: at a corner of the image.
double most_stretch(const View& view) {
  double most = 0;
  for (const int u : {0, view.width})
    for (const int v : {0, view.height}) most = std::max(most, length(ray_direction(view, u, v)));
  return most;
}

}  // namespace

Layers trace_layers(const View& view, const DualMesh& mesh, std::vector<float> front, int most) {
  Layers layers;
  const std::size_t pixels = front.size();
  layers.most = most;
  layers.count.resize(pixels, 0);
  layers.thickness.resize(pixels, 0);
  layers.back_normal.resize(pixels);
  layers.entry = std::move(front);
  add_nothing(layers.entry, pixels * static_cast<std::size_t>(most));
  add_nothing(layers.exit, pixels * static_cast<std::size_t>(most));

  const LayerLoops loops = layer_loops()[0];
  const auto least_air = static_cast<float>(kThinnest * view.radius / most_stretch(view));
  const ScreenMesh screen = project_mesh(view, mesh, layers.entry.data(), least_air);
  parallel_for(screen.of_band.size(), 1, [&](std::size_t begin, std::size_t end) {
    BandCrossings band(kRowsDrawn, view.width);
    PixelCrossings of_pixels(band);
    const Tracer tracer{view, layers, loops.fill};
    std::vector<Crossing> crossings;
    std::vector<Interval> bodies;
    for (std::size_t k = begin; k < end; ++k) {
      const int first = static_cast<int>(k) * kRowsDrawn,
                behind = std::min(first + kRowsDrawn, view.height);
      const float* const front = layers.entry.data() + static_cast<std::size_t>(first) *
                                                           static_cast<std::size_t>(view.width);
      band.others = 0;
      for (const std::uint32_t number : screen.of_band[k]) {
        const FaceRows rows =
            rows_of(view, mesh, screen, screen.face[number], first, behind, least_air);
        band.make_room(static_cast<std::size_t>(rows.rows) *
                       static_cast<std::size_t>(rows.columns));
        loops.draw(rows, front, view.width, band);
      }
      of_pixels.link();
      for (int row = first; row < behind; ++row)
        tracer.write_row(row, static_cast<std::size_t>(row - first) * band.stride, of_pixels, band,
                         crossings, bodies);
      of_pixels.unlink();
    }
  });
  return layers;
}

}  // namespace meniscus
