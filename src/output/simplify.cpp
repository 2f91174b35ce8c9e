#include "output/simplify.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "base/parallel.hpp"
#include "meniscus/error.hpp"
#include "stages/vec.hpp"

namespace meniscus {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

// A vertex whose normal is farther than 25 degrees from a triangle's lies on a crease.
constexpr double kCrease = 0.906;
// Elsewhere interpolated normals stay within 10 degrees of those of the full mesh.
constexpr double kBent = 0.985;
// A triangle turns by at most 50 degrees at a time.
constexpr double kTurned = 0.643;
// The quality of a triangle (1: all sides equal) that is let become worse.
constexpr double kThin = 0.05;
// Directions in which planes weigh less than this share of all: the vertex stays between the edge's
// ends.
constexpr double kLevel = 1e-3;
// Squared lengths of edges count so far beside squared distances: of edges that cost the same, as
// in a plane, the short ones collapse first.
constexpr double kShort = 1e-4;
// Tiles: large against triangles, small enough for a processor's cache.
constexpr double kTileSide = 64;

// The sum of weighted squared distances from planes, as a function of a point.
struct Quadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0, x = 0, y = 0, z = 0, c = 0, weight = 0;

  void add_plane(const Vec3d& n, const Vec3d& at, double w) {
    const double d = -dot(n, at);
    xx += w * n.x * n.x;
    xy += w * n.x * n.y;
    xz += w * n.x * n.z;
    yy += w * n.y * n.y;
    yz += w * n.y * n.z;
    zz += w * n.z * n.z;
    x += w * n.x * d;
    y += w * n.y * d;
    z += w * n.z * d;
    c += w * d * d;
    weight += w;
  }
  Quadric operator+(const Quadric& q) const {
    return {xx + q.xx, xy + q.xy, xz + q.xz, yy + q.yy, yz + q.yz,        zz + q.zz,
            x + q.x,   y + q.y,   z + q.z,   c + q.c,   weight + q.weight};
  }
  Vec3d half_slope(const Vec3d& p) const {
    return {xx * p.x + xy * p.y + xz * p.z + x, xy * p.x + yy * p.y + yz * p.z + y,
            xz * p.x + yz * p.y + zz * p.z + z};
  }
  double at(const Vec3d& p) const {
    return dot(p, half_slope(p)) + x * p.x + y * p.y + z * p.z + c;
  }
  // Where it is least, as far as its planes fix it; else as near to `from` as that allows.
  Vec3d least(const Vec3d& from) const {
    const double level = kLevel * (xx + yy + zz) + 1e-30;
    const Vec3d g = half_slope(from);
    // By Cholesky's factors: the matrix is positive definite.
    const double a = std::sqrt(xx + level), b = xy / a, d = xz / a;
    const double e = std::sqrt(yy + level - b * b), f = (yz - d * b) / e;
    const double h = std::sqrt(zz + level - d * d - f * f);
    const double u = g.x / a, v = (g.y - b * u) / e, w = (g.z - d * u - f * v) / h;
    const double mz = w / h, my = (v - f * mz) / e, mx = (u - b * my - d * mz) / a;
    return from - Vec3d(mx, my, mz);
  }
};

// The shares of a triangle's corners in the point of it that is nearest to p (Ericson 2005, 5.1.5).
std::array<double, 3> foot_of(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d ab = b - a, ac = c - a, ap = p - a;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const Vec3d bp = p - b;
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double of_c = d1 * d4 - d3 * d2;
  if (of_c <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  const Vec3d cp = p - c;
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double of_b = d5 * d2 - d1 * d6;
  if (of_b <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  const double of_a = d3 * d6 - d5 * d4;
  if (of_a <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - w, w};
  }
  const double all = of_a + of_b + of_c;
  return {of_a / all, of_b / all, of_c / all};
}

// 1: all sides of a triangle are equal; 0: it has no area. `twice` its area, two of its sides.
double quality(double twice, const Vec3d& one, const Vec3d& two) {
  const Vec3d three = two - one;
  return 3.4641016151377544 * twice / (dot(one, one) + dot(two, two) + dot(three, three));
}

// Triangles as half-edges: 3 t + k goes from corner k of triangle t to the next one.
class HalfEdges {
 public:
  HalfEdges(const std::vector<std::array<std::uint32_t, 3>>& triangle, std::size_t vertices)
      : start_(3 * triangle.size()), twin_(3 * triangle.size(), kNone), leaving_(vertices, kNone) {
    std::vector<std::uint32_t> other(start_.size());  // that leaves the same vertex
    for (std::uint32_t h = 0; h < start_.size(); ++h) {
      const std::uint32_t v = start_[h] = triangle[h / 3][h % 3];
      other[h] = std::exchange(leaving_[v], h);
    }
    for (std::uint32_t h = 0; h < start_.size(); ++h) {
      std::uint32_t back = leaving_[end(h)];
      while (back != kNone && end(back) != start_[h]) back = other[back];
      require(back != kNone && (twin_[back] == kNone || twin_[back] == h),
              "simplify: an edge of the mesh has not two triangles");
      twin_[h] = back;
      twin_[back] = h;
    }
  }

  static std::uint32_t next(std::uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
  static std::uint32_t previous(std::uint32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }
  std::uint32_t start(std::uint32_t h) const { return start_[h]; }
  std::uint32_t end(std::uint32_t h) const { return start_[next(h)]; }
  std::uint32_t opposite(std::uint32_t h) const { return start_[previous(h)]; }
  /// One that leaves a vertex; kNone: the vertex is gone.
  std::uint32_t leaving(std::uint32_t v) const { return leaving_[v]; }
  bool has_triangle(std::size_t t) const { return start_[3 * t] != kNone; }

  /// Those that leave a vertex, in order.
  template <class Visit>
  void around(std::uint32_t v, const Visit& visit) const {
    const std::uint32_t first = leaving_[v];
    for (std::uint32_t h = first;;) {
      const std::uint32_t after = twin_[previous(h)];
      visit(h);
      if (after == first) return;
      h = after;
    }
  }

  /// Joins the end of an edge to its start, which takes its triangles; the two beside it vanish.
  void collapse(std::uint32_t h) {
    const std::uint32_t a = start_[h], b = end(h), back = twin_[h];
    around(b, [&](std::uint32_t k) { start_[k] = a; });
    leaving_[b] = kNone;
    for (const std::uint32_t side : {h, back}) {
      const std::uint32_t one = twin_[next(side)], two = twin_[previous(side)];
      twin_[one] = two;
      twin_[two] = one;
      leaving_[opposite(side)] = one;
      leaving_[a] = two;
    }
    for (const std::uint32_t side : {h, back})
      for (const std::uint32_t k : {side, next(side), previous(side)}) start_[k] = kNone;
  }

 private:
  std::vector<std::uint32_t> start_, twin_;  // [half-edges] the vertex; the one back
  std::vector<std::uint32_t> leaving_;       // [vertices]
};

// An edge that may collapse.
struct Candidate {
  double cost;
  std::uint32_t a, b;   // its ends, a < b
  std::uint32_t stamp;  // the sum of theirs: it is of the past once one has changed
  bool operator<(const Candidate& other) const {  // of a heap whose top costs least
    if (cost != other.cost) return cost > other.cost;
    return a != other.a ? a > other.a : b > other.b;
  }
};

// A mesh on the way to fewer triangles. Lengths are in units, from the middle of the mesh.
struct Work {
  Work(Mesh mesh, double tolerance, double in_units);

  Vec3d at_first(std::size_t v) const { return (Vec3d(full.position[v]) - middle) / unit; }
  bool exists(std::uint32_t v) const { return edges.leaving(v) != kNone; }
  void add_point(std::uint32_t vertex, std::uint32_t triangle) {
    following[vertex] = std::exchange(first_point[triangle], vertex);
  }

  Mesh full;              // positions, normals and triangles; what vertices carry is that of now
  double unit, farthest;  // squared
  Vec3d middle;
  HalfEdges edges;
  std::vector<Vec3d> at;             // [vertices]
  std::vector<Vec3> normal;          // [vertices]
  std::vector<Quadric> quadric;      // [vertices]
  std::vector<std::uint8_t> crease;  // [vertices of the full mesh]
  std::vector<std::uint32_t> stamp;  // [vertices] how often it has changed
  std::vector<std::uint32_t> tile;   // [vertices] of simplify_in_tiles()
  // The vertices of the full mesh, each with the triangle that it is near: lists.
  std::vector<std::uint32_t> first_point;  // [triangles]
  std::vector<std::uint32_t> following;    // [vertices of the full mesh]
};

Work::Work(Mesh mesh, double tolerance, double in_units)
    : full(std::move(mesh)),
      unit(in_units),
      farthest(tolerance * tolerance),
      edges(full.triangle, full.position.size()),
      at(full.position.size()),
      normal(full.normal),
      quadric(at.size()),
      crease(at.size()),
      stamp(at.size()),
      tile(at.size()),
      first_point(full.triangle.size(), kNone),
      following(at.size(), kNone) {
  Vec3d low(full.position[0]), high = low;
  for (const Vec3& p : full.position) {
    low = {std::min(low.x, double{p.x}), std::min(low.y, double{p.y}),
           std::min(low.z, double{p.z})};
    high = {std::max(high.x, double{p.x}), std::max(high.y, double{p.y}),
            std::max(high.z, double{p.z})};
  }
  middle = (low + high) * 0.5;
  for (std::uint32_t v = 0; v < at.size(); ++v) {
    at[v] = at_first(v);
    if (exists(v)) add_point(v, edges.leaving(v) / 3);
  }
  for (const auto& t : full.triangle) {
    const Vec3d area = cross(at[t[1]] - at[t[0]], at[t[2]] - at[t[0]]);
    const double twice = length(area);
    if (!(twice > 0)) continue;
    for (const std::uint32_t v : t) {
      quadric[v].add_plane(area / twice, at[v], twice);
      if (dot(area, Vec3d(normal[v])) < kCrease * twice) crease[v] = 1;
    }
  }
}

// Collapses edges within a tile: of those whose neighbours all belong to it. So tiles do not touch
// what belongs to others, and are worked on at the same time.
class Tile {
 public:
  Tile(Work& work, std::uint32_t tile) : work_(work), tile_(tile) {}

  void simplify(const std::uint32_t* vertex, std::size_t count) {
    for (std::size_t k = 0; k < count; ++k)
      work_.edges.around(vertex[k], [&](std::uint32_t h) {
        if (vertex[k] < work_.edges.end(h)) propose(vertex[k], work_.edges.end(h));
      });
    std::make_heap(heap_.begin(), heap_.end());
    while (!heap_.empty()) {
      std::pop_heap(heap_.begin(), heap_.end());
      const Candidate next = heap_.back();
      heap_.pop_back();
      if (work_.exists(next.a) && work_.exists(next.b) &&
          work_.stamp[next.a] + work_.stamp[next.b] == next.stamp && may_collapse(next.a, next.b))
        collapse();
    }
  }

 private:
  // A triangle around the new vertex, which is its first corner.
  struct Side {
    std::uint32_t triangle, p, q;
    Vec3d normal;
  };
  // A vertex of the full mesh, and the side that is nearest to it.
  struct Point {
    std::uint32_t vertex, side;
  };

  // Where planes around an edge are nearest to meeting.
  Vec3d meeting(const Quadric& planes, std::uint32_t a, std::uint32_t b) const {
    const Vec3d between = (work_.at[a] + work_.at[b]) * 0.5, along = work_.at[b] - work_.at[a];
    const Vec3d x = planes.least(between), off = x - between;
    return dot(off, off) > dot(along, along) ? between : x;
  }

  // Adds an edge to the heap unless its planes do not meet near enough. Returns whether it did.
  bool propose(std::uint32_t a, std::uint32_t b) {
    if (work_.tile[a] != work_.tile[b]) return false;
    if (a > b) std::swap(a, b);
    const Quadric planes = work_.quadric[a] + work_.quadric[b];
    const double off = planes.at(meeting(planes, a, b));
    if (off > work_.farthest * planes.weight) return false;
    const Vec3d along = work_.at[b] - work_.at[a];
    heap_.push_back(
        {off + kShort * dot(along, along) * planes.weight, a, b, work_.stamp[a] + work_.stamp[b]});
    return true;
  }

  bool may_collapse(std::uint32_t a, std::uint32_t b) {
    a_ = a;
    b_ = b;
    if (!is_own_and_manifold()) return false;
    x_ = keep_volume(meeting(work_.quadric[a] + work_.quadric[b], a, b));
    const Vec3d along = work_.at[b] - work_.at[a];
    const double most = dot(along, along);
    share_ = most > 0 ? std::clamp(dot(x_ - work_.at[a], along) / most, 0.0, 1.0) : 0.5;
    n_ = normalized(mixed(work_.normal[a], work_.normal[b]), Vec3d(work_.normal[a]));
    if (!find_sides()) return false;
    find_points();
    return std::all_of(points_.begin(), points_.end(),
                       [&](Point& point) { return is_near(point); });
  }

  // Whether all neighbours of the edge's ends are the tile's, and the ends have none in common but
  // those of the edge's two triangles, and these four are not all there is.
  bool is_own_and_manifold() {
    bool own = true;
    ring_.clear();
    work_.edges.around(a_, [&](std::uint32_t h) {
      const std::uint32_t v = work_.edges.end(h);
      own &= work_.tile[v] == tile_;
      ring_.push_back(v);
    });
    std::ptrdiff_t around_b = 0, common = 0;
    work_.edges.around(b_, [&](std::uint32_t h) {
      const std::uint32_t v = work_.edges.end(h);
      own &= work_.tile[v] == tile_;
      common += std::count(ring_.begin(), ring_.end(), v);
      ++around_b;
    });
    return own && common == 2 && ring_.size() + static_cast<std::size_t>(around_b) > 6;
  }

  // visit(half-edge, its start, p, q): the triangles around the edge's ends, but for those of both.
  template <class Visit>
  void each_side(const Visit& visit) const {
    const auto of = [&](std::uint32_t v, std::uint32_t other) {
      work_.edges.around(v, [&](std::uint32_t h) {
        const std::uint32_t p = work_.edges.end(h), q = work_.edges.opposite(h);
        if (p != other && q != other) visit(h, v, p, q);
      });
    };
    of(a_, b_);
    of(b_, a_);
  }

  // Moves the new vertex along the mean normal, so that the mesh encloses as much as before.
  Vec3d keep_volume(const Vec3d& x) const {
    const Vec3d from = (work_.at[a_] + work_.at[b_]) * 0.5;
    Vec3d area;
    double volume = 0;
    each_side([&](std::uint32_t, std::uint32_t v, std::uint32_t p, std::uint32_t q) {
      const Vec3d part = cross(work_.at[p] - from, work_.at[q] - from);
      area += part;
      volume += dot(work_.at[v] - from, part);
    });
    const double square = dot(area, area), missing = volume - dot(x - from, area);
    return missing * missing < work_.farthest * square ? x + area * (missing / square) : x;
  }

  // The triangles as they would be. Returns whether none turns too far or becomes too thin.
  bool find_sides() {
    sides_.clear();
    bool good = true;
    each_side([&](std::uint32_t h, std::uint32_t v, std::uint32_t p, std::uint32_t q) {
      if (!good) return;
      const Vec3d one = work_.at[p] - x_, two = work_.at[q] - x_, area = cross(one, two);
      const Vec3d one_before = work_.at[p] - work_.at[v], two_before = work_.at[q] - work_.at[v];
      const Vec3d before = cross(one_before, two_before);
      const double twice = length(area), twice_before = length(before);
      const double now = quality(twice, one, two);
      good = twice > 0 && dot(area, before) >= kTurned * twice * twice_before &&
             (now > kThin || now > quality(twice_before, one_before, two_before));
      if (good) sides_.push_back({h / 3, p, q, area / twice});
    });
    return good;
  }

  void find_points() {
    points_.clear();
    const auto take = [&](std::uint32_t h) {
      for (std::uint32_t v = work_.first_point[h / 3]; v != kNone; v = work_.following[v])
        points_.push_back({v, 0});
    };
    work_.edges.around(a_, take);
    work_.edges.around(b_, [&](std::uint32_t h) {
      if (work_.edges.end(h) != a_ && work_.edges.opposite(h) != a_) take(h);
    });
  }

  // Finds the side that is nearest to a point. Returns whether that is near enough, and its normal
  // there near that of the full mesh.
  bool is_near(Point& point) const {
    const Vec3d p = work_.at_first(point.vertex);
    double nearest = std::numeric_limits<double>::infinity();
    std::array<double, 3> share{};
    for (std::uint32_t s = 0; s < sides_.size(); ++s) {
      const Side& side = sides_[s];
      const double above = dot(side.normal, p - x_);
      if (above * above >= nearest) continue;
      const Vec3d &b = work_.at[side.p], &c = work_.at[side.q];
      const std::array<double, 3> foot = foot_of(p, x_, b, c);
      const Vec3d off = p - x_ * foot[0] - b * foot[1] - c * foot[2];
      if (dot(off, off) >= nearest) continue;
      nearest = dot(off, off);
      point.side = s;
      share = foot;
    }
    if (nearest > work_.farthest) return false;
    if (work_.crease[point.vertex]) return true;
    const Side& side = sides_[point.side];
    const Vec3d normal = n_ * share[0] + Vec3d(work_.normal[side.p]) * share[1] +
                         Vec3d(work_.normal[side.q]) * share[2];
    const Vec3d first(work_.full.normal[point.vertex]);
    return dot(normal, first) >= kBent * length(normal) * length(first);
  }

  Vec3d mixed(const Vec3& of_a, const Vec3& of_b) const {
    return Vec3d(of_a) * (1 - share_) + Vec3d(of_b) * share_;
  }

  void collapse() {
    const auto forget = [&](std::uint32_t h) { work_.first_point[h / 3] = kNone; };
    work_.edges.around(a_, forget);
    work_.edges.around(b_, forget);
    for (const Point& point : points_) work_.add_point(point.vertex, sides_[point.side].triangle);
    std::uint32_t between = kNone;
    work_.edges.around(a_, [&](std::uint32_t h) {
      if (work_.edges.end(h) == b_) between = h;
    });
    work_.edges.collapse(between);
    work_.at[a_] = x_;
    work_.normal[a_] = static_cast<Vec3>(n_);
    work_.quadric[a_] = work_.quadric[a_] + work_.quadric[b_];
    if (std::vector<Vec3>& velocity = work_.full.velocity; !velocity.empty())
      velocity[a_] = static_cast<Vec3>(mixed(velocity[a_], velocity[b_]));
    for (Attribute& attribute : work_.full.attributes) {
      std::vector<float>& values = attribute.values;
      values[a_] = static_cast<float>(values[a_] * (1 - share_) + values[b_] * share_);
    }
    ++work_.stamp[a_];
    work_.edges.around(a_, [&](std::uint32_t h) {
      if (propose(a_, work_.edges.end(h))) std::push_heap(heap_.begin(), heap_.end());
    });
  }

  Work& work_;
  std::uint32_t tile_;
  std::vector<Candidate> heap_;
  // The collapse that is looked at: a takes b's place, too, and moves to x.
  std::uint32_t a_ = 0, b_ = 0;
  Vec3d x_, n_;
  double share_ = 0;  // how far x is on the way from a to b
  std::vector<std::uint32_t> ring_;
  std::vector<Side> sides_;
  std::vector<Point> points_;
};

// Shares the vertices out to cubes whose sides are moved by a share of their length, and simplifies
// each of them.
void simplify_in_tiles(Work& work, double moved) {
  constexpr std::int64_t kMost = std::int64_t{1} << 20;
  const auto cube = [&](double x) {
    return static_cast<std::uint64_t>(
        std::clamp(static_cast<std::int64_t>(std::floor(x / kTileSide + moved)), -kMost,
                   kMost - 1) +
        kMost);
  };
  std::vector<std::pair<std::uint64_t, std::uint32_t>> of_tiles;
  for (std::uint32_t v = 0; v < work.at.size(); ++v)
    if (work.exists(v)) {
      const Vec3d& at = work.at[v];
      of_tiles.push_back({cube(at.z) << 42 | cube(at.y) << 21 | cube(at.x), v});
    }
  std::sort(of_tiles.begin(), of_tiles.end());
  std::vector<std::uint32_t> vertex;
  std::vector<std::size_t> begin;  // of each tile's
  for (std::size_t k = 0; k < of_tiles.size(); ++k) {
    if (k == 0 || of_tiles[k].first != of_tiles[k - 1].first) begin.push_back(k);
    vertex.push_back(of_tiles[k].second);
    work.tile[vertex.back()] = static_cast<std::uint32_t>(begin.size() - 1);
  }
  const std::size_t tiles = begin.size();
  begin.push_back(vertex.size());
  of_tiles = {};
  parallel_for(tiles, 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t t = first; t < last; ++t)
      Tile(work, static_cast<std::uint32_t>(t))
          .simplify(vertex.data() + begin[t], begin[t + 1] - begin[t]);
  });
}

Mesh what_is_left(Work& work) {
  Mesh& mesh = work.full;
  std::vector<std::uint32_t> place(work.at.size());
  std::uint32_t left = 0;
  for (std::uint32_t v = 0; v < place.size(); ++v) {
    if (!work.exists(v)) continue;
    mesh.position[left] = static_cast<Vec3>(work.at[v] * work.unit + work.middle);
    mesh.normal[left] = work.normal[v];
    if (!mesh.velocity.empty()) mesh.velocity[left] = mesh.velocity[v];
    for (Attribute& attribute : mesh.attributes) attribute.values[left] = attribute.values[v];
    place[v] = left++;
  }
  mesh.position.resize(left);
  mesh.normal.resize(left);
  if (!mesh.velocity.empty()) mesh.velocity.resize(left);
  for (Attribute& attribute : mesh.attributes) attribute.values.resize(left);
  std::size_t kept = 0;
  for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
    if (!work.edges.has_triangle(t)) continue;
    for (std::uint32_t k = 0; k < 3; ++k)
      mesh.triangle[kept][k] = place[work.edges.start(3 * t + k)];
    ++kept;
  }
  mesh.triangle.resize(kept);
  return std::move(mesh);
}

}  // namespace

Mesh simplify(Mesh mesh, double tolerance, double unit) {
  if (mesh.triangle.empty()) return mesh;
  Work work(std::move(mesh), tolerance, unit);
  // What lies between tiles at first lies within them then.
  for (const double moved : {0.0, 0.5, 0.25}) simplify_in_tiles(work, moved);
  return what_is_left(work);
}

}  // namespace meniscus
