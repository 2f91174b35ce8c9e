#include "stages/layers.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>

#include "base/parallel.hpp"

namespace meniscus {
namespace {

constexpr int kRowsDrawn = 16;  // rows of pixels that one thread draws at a time
constexpr int kSubpixelBits = 12;
constexpr std::int64_t kSubpixels = 1 << kSubpixelBits;  // of a pixel
constexpr double kFarthestPixel = 1
                                  << 17;  // pixels; products of differences of steps fit in 64 bits

// A mesh's entry so near behind the front, along the ray, is the front's. Particle radii.
constexpr double kMeetsFront = 2;
// Thickness of a film: a front that the mesh does not know. Particle radii along the ray.
constexpr double kFilm = 0.02;

// Air between two bodies that is thinner along the ray is none: it is the surface's roughness,
// where a ray skims it or nicks an edge. Particles of two sheets leave at least .7 between the
// sheets. Water at the front that is thinner is none, either, where the mesh enters near behind it:
// the front bulges there before a fold of the mesh. Particle radii.
constexpr double kThinnest = 0.5;

// Vertices of a triangle whose normal is off the triangle's by more lie on a crease: there the
// triangle's own counts. 25 degrees.
constexpr double kCreaseNormals = 0.9063077870366499;

// A vertex on the screen.
struct ScreenCorner {
  std::int64_t u = 0, v = 0;  // steps
  double depth = 0;           // world units
  double inverse_w = 0;
  Vec3d normal;  // world axes
  bool usable = false;
};

// A triangle that rays may meet. Its inside is to the right of its edges; the k-th lies opposite
// corner k.
struct Face {
  std::array<std::uint32_t, 3> corner;
  std::array<int, 2> columns, rows;  // whose centres it may cover, first and behind the last
  bool enters;                       // it faces the eye
};

// The mesh on the screen.
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
std::array<Vec3d, 3> normals_of(const View& view, const DualMesh& mesh, const Face& face,
                                const FaceCorners& corner) {
  const double unit = (std::abs(view.w_row[2]) + std::abs(view.w_row[3])) *
                      (1.0 / (kSubpixels * kSubpixels));  // of w, per pixel
  const auto& [a, b, c] = face.corner;
  const Vec3d& from = mesh.position[a];
  const Vec3d flat =
      normalized(world_direction(view, cross(mesh.position[b] - from, mesh.position[c] - from)));
  std::array<Vec3d, 3> normals;
  for (std::size_t k = 0; k < 3; ++k) {
    const bool crease = dot(corner[k]->normal, flat) < kCreaseNormals;
    normals[k] = (crease ? flat : corner[k]->normal) * (corner[k]->inverse_w * unit);
  }
  return normals;
}

// Projects the mesh, and lists the faces of each band of rows.
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
                          -at.z * view.radius,
                          1 / p.w,
                          world_direction(view, mesh.normal[k]),
                          true};
    }
  });
  screen.of_band.resize(static_cast<std::size_t>((view.height + kRowsDrawn - 1) / kRowsDrawn));
  screen.face.reserve(mesh.triangle.size());
  for (std::array<std::uint32_t, 3> t : mesh.triangle) {
    const auto [a, b, c] = corners_of(screen, t);
    if (!a->usable || !b->usable || !c->usable) continue;
    const std::int64_t area = side_of(*a, *b, c->u, c->v);
    if (area == 0) continue;
    const std::array<int, 2> columns = pixels_between(a->u, b->u, c->u, view.width),
                             rows = pixels_between(a->v, b->v, c->v, view.height);
    if (columns[0] >= columns[1] || rows[0] >= rows[1]) continue;
    const auto number = static_cast<std::uint32_t>(screen.face.size());
    for (int band = rows[0] / kRowsDrawn; band <= (rows[1] - 1) / kRowsDrawn; ++band)
      screen.of_band[static_cast<std::size_t>(band)].push_back(number);
    const bool enters = area < 0;  // rows run down
    if (enters) std::swap(t[1], t[2]);
    screen.face.push_back({t, columns, rows, enters});
  }
  return screen;
}

// Where a ray meets a triangle.
struct Crossing {
  float depth;          // world units
  std::uint32_t face;   // of the band
  std::int32_t enters;  // 1, or -1 where the ray leaves
  Vec3 normal;          // the mesh's where it leaves, world axes; not of unit length

  bool operator<(const Crossing& other) const {
    if (depth != other.depth) return depth < other.depth;
    if (enters != other.enters) return enters > other.enters;  // bodies that touch are one
    return face < other.face;
  }
};

// Whether a pixel's centre lies in a triangle, by how far it is beyond what each side takes.
bool is_inside(const Sides& beyond) { return (beyond[0] | beyond[1] | beyond[2]) >= 0; }

void step(Sides& sides, const Sides& by) {
  for (std::size_t k = 0; k < 3; ++k) sides[k] += by[k];
}

// What lies behind the fronts of a band of rows: the crossings of each of its pixels, one after the
// other.
class BandCrossings {
 public:
  // `least_air`: between two bodies, along the depth, of all rays of the view.
  BandCrossings(const View& view, const DualMesh& mesh, const ScreenMesh& screen,
                const std::vector<float>& front, float least_air)
      : view_(view), mesh_(mesh), screen_(screen), front_(front), least_air_(least_air) {}

  // Forgets all, for the rows `first` and up to before `behind`.
  void begin(int first, int behind) {
    first_ = first;
    behind_ = behind;
    const auto rows = static_cast<std::size_t>(behind - first);
    head_.assign(rows * static_cast<std::size_t>(view_.width), kEnd);
    if (links_.size() < head_.size()) links_.resize(head_.size());
    used_ = 0;
  }

  // The rows of a face that lie in the band, which is the band's `number`-th. Its depth is a
  // quotient of two numbers that are linear on the screen, as its normal is. An entry that is less
  // than `least_air` behind the front tells nothing: the first body begins at the front, and air
  // between both would be none.
  void draw(const Face& face, std::uint32_t number) {
    const FaceCorners corner = corners_of(screen_, face.corner);
    Sides to_right, down, least;            // of sides: by a column, by a row; on the inside
    std::array<double, 3> above, below;     // of the depth, by the side
    double above_step = 0, below_step = 0;  // by a column
    for (std::size_t k = 0; k < 3; ++k) {
      const ScreenCorner &from = *corner[(k + 1) % 3], &to = *corner[(k + 2) % 3];
      to_right[k] = (from.v - to.v) * kSubpixels;
      down[k] = (to.u - from.u) * kSubpixels;
      least[k] = owns_edge(from, to) ? 0 : 1;
      below[k] = corner[k]->inverse_w;
      above[k] = below[k] * corner[k]->depth;
      above_step += static_cast<double>(to_right[k]) * above[k];
      below_step += static_cast<double>(to_right[k]) * below[k];
    }
    std::array<Vec3d, 3> normals{};  // by the side
    if (!face.enters) normals = normals_of(view_, mesh_, face, corner);
    Vec3d normal_step;
    for (std::size_t k = 0; k < 3; ++k)
      normal_step += normals[k] * static_cast<double>(to_right[k]);
    const float nearest = face.enters ? least_air_ : 0;
    const int top = std::max(first_, face.rows[0]), end = std::min(behind_, face.rows[1]);
    Sides left = sides_of(corner, centre_of(face.columns[0]), centre_of(top));
    for (std::size_t k = 0; k < 3; ++k) left[k] -= least[k];
    for (int row = top; row < end; ++row, step(left, down)) {
      // Most triangles are few pixels wide.
      Sides beyond = left;
      int column = face.columns[0];
      for (; column < face.columns[1] && !is_inside(beyond); ++column) step(beyond, to_right);
      if (column == face.columns[1]) continue;
      Line above_line{0, above_step}, below_line{0, below_step};
      Vec3d normal;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto at = static_cast<double>(beyond[k] + least[k]);
        above_line.at += at * above[k];
        below_line.at += at * below[k];
        normal += normals[k] * at;
      }
      const std::size_t pixel =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(view_.width) +
          static_cast<std::size_t>(column);
      add_row(pixel, static_cast<std::size_t>(face.columns[1] - column), beyond, to_right,
              above_line, below_line, static_cast<Vec3>(normal), static_cast<Vec3>(normal_step),
              nearest, number, face.enters ? 1 : -1);
    }
  }

  std::size_t first_pixel() const {
    return static_cast<std::size_t>(first_) * static_cast<std::size_t>(view_.width);
  }

  // The only crossing of a pixel, where there is one alone, and it is an exit.
  const Crossing* only_exit(std::size_t pixel) const {
    const std::uint32_t at = head_[pixel - first_pixel()];
    if (at == kEnd || links_[at].next != kEnd || links_[at].crossing.enters > 0) return nullptr;
    return &links_[at].crossing;
  }

  // Those of a pixel, in order.
  void list(std::size_t pixel, std::vector<Crossing>& sorted) const {
    sorted.clear();
    for (std::uint32_t at = head_[pixel - first_pixel()]; at != kEnd; at = links_[at].next) {
      sorted.push_back(links_[at].crossing);
      for (std::size_t k = sorted.size() - 1; k > 0 && sorted[k] < sorted[k - 1]; --k)
        std::swap(sorted[k], sorted[k - 1]);
    }
  }

 private:
  struct Link {
    Crossing crossing;
    std::uint32_t next;
  };
  static constexpr std::uint32_t kEnd = ~0u;

  // A number that is linear along a row.
  struct Line {
    double at, step;
  };

  // Adds the crossings of a face at up to n pixels of a row, as long as they lie in it, at depths
  // top / bottom, where these are more than `nearest` behind the front.
  void add_row(std::size_t pixel, std::size_t n, Sides beyond, const Sides& to_right, Line top,
               Line bottom, const Vec3& normal, const Vec3& normal_step, float nearest,
               std::uint32_t face, std::int32_t enters) {
    if (links_.size() < used_ + n) links_.resize(2 * (used_ + n));
    const float* const front = &front_[pixel];
    std::uint32_t* const head = &head_[pixel - first_pixel()];
    Link* const links = links_.data();
    std::uint32_t used = used_;
    for (std::size_t k = 0; k < n && is_inside(beyond); ++k, step(beyond, to_right)) {
      const auto depth = static_cast<float>(top.at / bottom.at);
      top.at += top.step;
      bottom.at += bottom.step;
      if (!(depth > front[k] + nearest)) continue;
      const auto steps = static_cast<float>(k);
      Link& link = links[used];
      link.crossing.depth = depth;
      link.crossing.face = face;
      link.crossing.enters = enters;
      link.crossing.normal = {normal.x + steps * normal_step.x, normal.y + steps * normal_step.y,
                              normal.z + steps * normal_step.z};
      link.next = head[k];
      head[k] = used++;
    }
    used_ = used;
  }

  const View& view_;
  const DualMesh& mesh_;
  const ScreenMesh& screen_;
  const std::vector<float>& front_;
  const float least_air_;
  int first_ = 0, behind_ = 0;
  std::vector<std::uint32_t> head_;  // [pixels] of the band
  std::vector<Link> links_;
  std::uint32_t used_ = 0;  // links
};

struct Interval {
  float from, to;           // depths, world units
  const Crossing* leaving;  // its end; none: a film's
};

// The bodies along one ray behind its front, from its crossings there in order; air of less depth
// than `least_air` is none. The mesh is closed but for the front: what a ray leaves more often than
// it enters it behind the front, it is in there, and its body begins before it.
void list_intervals(const std::vector<Crossing>& crossings, float least_air,
                    std::vector<Interval>& bodies) {
  bodies.clear();
  int all = 0;
  for (const Crossing& c : crossings) all += c.enters;
  int within = std::max(-all, 0);
  float from = 0;
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
  Layers& layers;  // whose first entries are the front

  // Writes what is kept of one ray. `bodies` is room to work in.
  void write(int column, int row, std::size_t pixel, const std::vector<Crossing>& crossings,
             std::vector<Interval>& bodies) const {
    const float first = layers.entry[pixel];
    const double stretch = stretch_of(column, row), depth_of_radius = view.radius / stretch;
    const auto thinnest = static_cast<float>(kThinnest * depth_of_radius);
    const double meets_front = first + kMeetsFront * depth_of_radius;
    list_intervals(crossings, thinnest, bodies);
    if (bodies.size() > 1 && bodies[0].to < first + thinnest && bodies[1].from <= meets_front)
      bodies.erase(bodies.begin());
    if (bodies.empty() || bodies[0].from > meets_front)
      bodies.insert(bodies.begin(),
                    {first, static_cast<float>(first + kFilm * depth_of_radius), nullptr});
    bodies[0] = {first, std::max(bodies[0].to, next_above(first)), bodies[0].leaving};
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
    if (bodies[0].leaving)
      put_normal(pixel, bodies[0].leaving->normal);
    else
      layers.back_normal[pixel] = static_cast<Vec3>(
          world_direction(view, normalized(ray_direction(view, column + 0.5, row + 0.5))));
    layers.count[pixel] = count;
    layers.thickness[pixel] = static_cast<float>(thickness);
  }

  // The same of a ray that leaves the mesh once behind the front and meets it nowhere else, as most
  // do.
  void write(int column, int row, std::size_t pixel, const Crossing& exit) const {
    const float from = layers.entry[pixel];
    layers.exit[pixel] = exit.depth;
    put_normal(pixel, exit.normal);
    layers.count[pixel] = 1;
    layers.thickness[pixel] =
        static_cast<float>((double{exit.depth} - double{from}) * stretch_of(column, row));
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

// Calls visit(column, pixel) for the pixels of a row that have a front. Those without one, which
// are many, are passed over several at a time.
template <class Visit>
void each_shown(const float* front, int row, int width, const Visit& visit) {
  constexpr int kAtATime = 32;
  const std::size_t pixel = static_cast<std::size_t>(row) * static_cast<std::size_t>(width);
  for (int begin = 0; begin < width; begin += kAtATime) {
    const int end = std::min(begin + kAtATime, width);
    int any = 0;
    for (int column = begin; column < end; ++column)
      any |= front[pixel + static_cast<std::size_t>(column)] < kNoSurface;
    if (any == 0) continue;
    for (int column = begin; column < end; ++column)
      if (front[pixel + static_cast<std::size_t>(column)] < kNoSurface)
        visit(column, pixel + static_cast<std::size_t>(column));
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
  layers.entry.resize(pixels * static_cast<std::size_t>(most), kNoSurface);
  layers.exit.resize(pixels * static_cast<std::size_t>(most), kNoSurface);

  const ScreenMesh screen = project_mesh(view, mesh);
  const auto least_air = static_cast<float>(kThinnest * view.radius / most_stretch(view));
  parallel_for(screen.of_band.size(), 1, [&](std::size_t begin, std::size_t end) {
    BandCrossings band(view, mesh, screen, layers.entry, least_air);
    const Tracer tracer{view, layers};
    std::vector<Crossing> crossings;
    std::vector<Interval> bodies;
    for (std::size_t k = begin; k < end; ++k) {
      const int first = static_cast<int>(k) * kRowsDrawn,
                behind = std::min(first + kRowsDrawn, view.height);
      const std::vector<std::uint32_t>& faces = screen.of_band[k];
      band.begin(first, behind);
      for (std::uint32_t number = 0; number < faces.size(); ++number)
        band.draw(screen.face[faces[number]], number);
      for (int row = first; row < behind; ++row)
        each_shown(layers.entry.data(), row, view.width, [&](int column, std::size_t pixel) {
          if (const Crossing* const exit = band.only_exit(pixel)) {
            tracer.write(column, row, pixel, *exit);
            return;
          }
          band.list(pixel, crossings);
          tracer.write(column, row, pixel, crossings, bodies);
        });
    }
  });
  return layers;
}

}  // namespace meniscus
