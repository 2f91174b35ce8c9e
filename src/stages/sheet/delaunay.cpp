// The only file that includes CGAL: it takes long to compile.
#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numeric>
#include <utility>

#include "base/parallel.hpp"
#include "stages/sheet/triangulate.hpp"

namespace meniscus {
namespace {

using Triangle = std::array<std::int32_t, 3>;
using Triangles = std::vector<Triangle>;
using Exact = CGAL::Exact_predicates_inexact_constructions_kernel;

// Tells most points inside a circle from those outside by one determinant in doubles: where that is
// larger than what its rounding can come to among these points, its sign is right. The rest is the
// exact kernel's.
struct Kernel : Exact {
  double rounding = INFINITY;  // of the determinant

  // For points that lie at most `extent` from each other along each axis: rounding is less than
  // (10 + 96 e) e times the sum of the products' sizes (Shewchuk 1997), which is 12 extent^4 at
  // most.
  void spread_over(double extent) {
    constexpr double kEpsilon = 0x1p-53;
    rounding = 121 * kEpsilon * extent * extent * extent * extent;
  }

  struct Side_of_oriented_circle_2 {
    double rounding;
    CGAL::Oriented_side operator()(const Point_2& a, const Point_2& b, const Point_2& c,
                                   const Point_2& d) const {
      const double ax = a.x() - d.x(), ay = a.y() - d.y(), bx = b.x() - d.x(), by = b.y() - d.y(),
                   cx = c.x() - d.x(), cy = c.y() - d.y();
      const double determinant = (ax * ax + ay * ay) * (bx * cy - cx * by) +
                                 (bx * bx + by * by) * (cx * ay - ax * cy) +
                                 (cx * cx + cy * cy) * (ax * by - bx * ay);
      if (determinant > rounding) return CGAL::ON_POSITIVE_SIDE;
      if (determinant < -rounding) return CGAL::ON_NEGATIVE_SIDE;
      return Exact().side_of_oriented_circle_2_object()(a, b, c, d);
    }
  };
  Side_of_oriented_circle_2 side_of_oriented_circle_2_object() const { return {rounding}; }
};
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<std::int32_t, Kernel>;
using FaceBase = CGAL::Triangulation_face_base_with_info_2<bool, Kernel>;  // whether it is wanted
using Structure = CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>;
using Delaunay = CGAL::Delaunay_triangulation_2<Kernel, Structure>;

// Where a cell of a square of 2^bits cells lies along Hilbert's curve through all of them.
std::uint32_t along_curve(std::uint32_t x, std::uint32_t y, int bits) {
  std::uint32_t place = 0;
  for (std::uint32_t side = 1u << (bits - 1); side > 0; side /= 2) {
    const bool right = (x & side) != 0, low = (y & side) != 0;
    place = 4 * place + ((right ? 3 : 0) ^ (low ? 1 : 0));
    if (low) continue;
    if (right) {
      x = ~x;
      y = ~y;
    }
    std::swap(x, y);
  }
  return place;
}

// The order in which points go into the triangulation: every 64th, every 16th, every fourth, then
// all others, each time along a curve. Few triangles are made in vain, and the walk to each is
// short.
std::vector<std::int32_t> insertion_order(const std::vector<ScreenPoint>& points,
                                          const std::vector<std::int32_t>& index,
                                          const ScreenPoint& low, double extent) {
  constexpr int kBits = 8;
  const double scale = ((1 << kBits) - 1) / std::max(extent, 1e-9);
  std::vector<std::uint32_t> keys(index.size());  // round, place on the curve
  for (std::size_t k = 0; k < index.size(); ++k) {
    const ScreenPoint& point = points[index[k]];
    const std::uint32_t round = k % 64 == 0 ? 0 : k % 16 == 0 ? 1 : k % 4 == 0 ? 2 : 3;
    const std::uint32_t place =
        along_curve(static_cast<std::uint32_t>((point.u - low.u) * scale),
                    static_cast<std::uint32_t>((point.v - low.v) * scale), kBits);
    keys[k] = round << (2 * kBits) | place;
  }
  // Those with equal keys in their order: counted by the low half of the keys, then by the high
  // one.
  constexpr int kHalf = kBits + 1;
  std::vector<std::int32_t> order(index.size()), sorted(index.size());
  std::iota(order.begin(), order.end(), 0);
  for (int shift = 0; shift < 2 * kHalf; shift += kHalf) {
    const auto digit = [&](std::int32_t k) { return keys[k] >> shift & ((1u << kHalf) - 1); };
    std::array<std::int32_t, (1 << kHalf) + 1> start{};
    for (const std::int32_t k : order) ++start[digit(k) + 1];
    std::partial_sum(start.begin(), start.end(), start.begin());
    for (const std::int32_t k : order) sorted[start[digit(k)]++] = k;
    order.swap(sorted);
  }
  for (std::int32_t& k : order) k = index[k];
  return order;
}

// The triangulation of the points with these indices. Each goes in with its predecessor's face as a
// hint: short walks. The triangulation does not depend on the order, because CGAL settles
// cocircular points by a symbolic perturbation in the lexicographic order of the points.
Delaunay net_of(const std::vector<ScreenPoint>& points, const std::vector<std::int32_t>& index) {
  ScreenPoint low{INFINITY, INFINITY}, high{-INFINITY, -INFINITY};
  for (const std::int32_t i : index) {
    low = {std::min(low.u, points[i].u), std::min(low.v, points[i].v)};
    high = {std::max(high.u, points[i].u), std::max(high.v, points[i].v)};
  }
  const double extent = std::max({high.u - low.u, high.v - low.v, 0.0});
  Kernel kernel;
  kernel.spread_over(extent);
  Delaunay net(kernel);
  Delaunay::Face_handle hint;
  for (const std::int32_t i : insertion_order(points, index, low, extent)) {
    const std::size_t before = net.number_of_vertices();
    const auto at = net.insert({points[i].u, points[i].v}, hint);
    hint = at->face();
    const bool is_new = net.number_of_vertices() > before;
    at->info() = is_new ? i : std::min(at->info(), i);  // of equal points the first stays
  }
  return net;
}

// The points of a face, the smallest first.
Triangle corners_of(const Delaunay::Face_handle& face) {
  Triangle t{face->vertex(0)->info(), face->vertex(1)->info(), face->vertex(2)->info()};
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

Triangles all_of(const Delaunay& net) {
  Triangles all;
  all.reserve(net.number_of_faces());
  for (auto face = net.finite_faces_begin(); face != net.finite_faces_end(); ++face)
    all.push_back(corners_of(face));
  return all;
}

// Triangles of so many points in ascending order: in lists by their smallest point, which are
// short.
Triangles sorted(const Triangles& found, std::size_t points) {
  std::vector<std::int32_t> start(points + 1, 0);
  for (const Triangle& t : found) ++start[t[0] + 1];
  for (std::size_t i = 1; i < start.size(); ++i) start[i] += start[i - 1];
  Triangles triangles(found.size());
  std::vector<std::int32_t> next(start.begin(), start.end() - 1);
  for (const Triangle& t : found) triangles[next[t[0]]++] = t;
  constexpr std::size_t kGrain = 4096;  // points that are worth a thread
  parallel_for(points, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      std::sort(triangles.begin() + start[i], triangles.begin() + start[i + 1]);
  });
  return triangles;
}

// Edges from one point to another.
class Edges {
 public:
  void add(std::int32_t from, std::int32_t to) { keys_.push_back(key(from, to)); }
  void sort() { std::sort(keys_.begin(), keys_.end()); }
  bool have(std::int32_t from, std::int32_t to) const {
    return std::binary_search(keys_.begin(), keys_.end(), key(from, to));
  }

 private:
  static std::uint64_t key(std::int32_t from, std::int32_t to) {
    return static_cast<std::uint64_t>(from) << 32 | static_cast<std::uint32_t>(to);
  }
  std::vector<std::uint64_t> keys_;
};

// The triangles of all points that are not among the known ones, when all their corners are among
// the points marked `open`. No circle around them holds a point, so they are triangles of the open
// points alone, too. Of those they are the ones that lie where nothing is known: beside an edge
// that has a known triangle on one side, and on from there up to other such edges.
Triangles missing_triangles(const std::vector<ScreenPoint>& points, const Triangles& known,
                            const std::vector<char>& open) {
  std::vector<std::int32_t> index;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (open[i]) index.push_back(static_cast<std::int32_t>(i));
  Delaunay net = net_of(points, index);
  if (known.empty()) return all_of(net);
  Edges edges;  // of known triangles, along them
  for (const Triangle& t : known)
    for (const auto& [from, to] : {std::pair{t[0], t[1]}, {t[1], t[2]}, {t[2], t[0]}})
      if (open[from] && open[to]) edges.add(from, to);
  edges.sort();
  // Whether the triangle on the other side of a face's edge is known, and on its own side none is.
  const auto ends_at = [&](Delaunay::Face_handle face, int edge) {
    const std::int32_t from = face->vertex(Delaunay::ccw(edge))->info(),
                       to = face->vertex(Delaunay::cw(edge))->info();
    return edges.have(to, from) && !edges.have(from, to);
  };
  std::vector<Delaunay::Face_handle> found;
  for (auto face = net.finite_faces_begin(); face != net.finite_faces_end(); ++face) {
    face->info() = ends_at(face, 0) || ends_at(face, 1) || ends_at(face, 2);
    if (face->info()) found.push_back(face);
  }
  Triangles missing;
  for (std::size_t k = 0; k < found.size(); ++k) {
    const Delaunay::Face_handle face = found[k];
    missing.push_back(corners_of(face));
    for (int edge = 0; edge < 3; ++edge) {
      const Delaunay::Face_handle beside = face->neighbor(edge);
      if (net.is_infinite(beside) || beside->info() || ends_at(face, edge)) continue;
      beside->info() = true;
      found.push_back(beside);
    }
  }
  return missing;
}

// How far a triangle's circle reaches along u, with room for rounding; everywhere where it is too
// flat to tell.
struct Span {
  double middle, low, high;
};

Span circle_of(const std::vector<ScreenPoint>& points, const Triangle& t) {
  const ScreenPoint &a = points[t[0]], &b = points[t[1]], &c = points[t[2]];
  const double bu = b.u - a.u, bv = b.v - a.v, cu = c.u - a.u, cv = c.v - a.v;
  const double bb = bu * bu + bv * bv, cc = cu * cu + cv * cv, twice = 2 * (bu * cv - bv * cu);
  if (!(std::abs(twice) > 1e-6 * (bb + cc))) return {a.u, -INFINITY, INFINITY};
  const double u = (cv * bb - bv * cc) / twice, v = (bu * cc - cu * bb) / twice;
  const double radius = (1 + 1e-6) * std::sqrt(u * u + v * v) + 1e-6;
  return {a.u + u, a.u + u - radius, a.u + u + radius};
}

// The triangulation of all points from that of strips of the screen, side by side, each with what
// lies beside it within a margin. A triangle whose circle lies in what a strip sees is one of all
// points; it is taken from the strip that holds the circle's middle. The rest is made at the end
// from the points that may have other triangles.
Triangles triangles_by_strips(const std::vector<ScreenPoint>& points, std::size_t strips) {
  constexpr double kMargin = 2.5;  // mean distances of points
  constexpr std::size_t kSampled = 16;
  std::vector<double> u;
  ScreenPoint low{INFINITY, INFINITY}, high{-INFINITY, -INFINITY};
  for (std::size_t i = 0; i < points.size(); ++i) {
    low = {std::min(low.u, points[i].u), std::min(low.v, points[i].v)};
    high = {std::max(high.u, points[i].u), std::max(high.v, points[i].v)};
    if (i % kSampled == 0) u.push_back(points[i].u);
  }
  std::sort(u.begin(), u.end());
  std::vector<double> bounds;  // between strips
  for (std::size_t k = 1; k < strips; ++k) bounds.push_back(u[k * u.size() / strips]);
  const double margin =
      kMargin * std::sqrt((high.u - low.u) * (high.v - low.v) / static_cast<double>(points.size()));
  const auto strip_at = [&](double at) {
    return static_cast<std::size_t>(std::upper_bound(bounds.begin(), bounds.end(), at) -
                                    bounds.begin());
  };
  const auto sees = [&](std::size_t strip, double from, double to) {
    return (strip == 0 || from >= bounds[strip - 1] - margin) &&
           (strip + 1 == strips || to <= bounds[strip] + margin);
  };
  std::vector<Triangles> of_strip(strips);
  std::vector<char> open(points.size(), 0);  // whether there may be triangles that no strip finds
  parallel_for(strips, 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t strip = first; strip < last; ++strip) {
      std::vector<std::int32_t> index;
      for (std::size_t i = 0; i < points.size(); ++i)
        if (sees(strip, points[i].u, points[i].u)) index.push_back(static_cast<std::int32_t>(i));
      const Delaunay net = net_of(points, index);
      const auto leave_open = [&](std::int32_t i) {
        if (strip_at(points[i].u) == strip) open[i] = 1;
      };
      if (net.dimension() < 2) std::ranges::for_each(index, leave_open);  // points on a line
      for (auto face = net.all_faces_begin(); face != net.all_faces_end(); ++face) {
        if (!net.is_infinite(face)) {
          const Triangle t = corners_of(face);
          const Span circle = circle_of(points, t);
          const std::size_t owner = strip_at(circle.middle);
          if (sees(strip, circle.low, circle.high) && sees(owner, circle.low, circle.high)) {
            if (owner == strip) of_strip[strip].push_back(t);
            continue;
          }
        }
        for (int k = 0; k < 3; ++k)
          if (!net.is_infinite(face->vertex(k))) leave_open(face->vertex(k)->info());
      }
    }
  });
  Triangles known;
  for (const Triangles& some : of_strip) known.insert(known.end(), some.begin(), some.end());
  const Triangles missing = missing_triangles(points, known, open);
  known.insert(known.end(), missing.begin(), missing.end());
  return known;
}

// The triangulation of all points; strips: 0 for as many as pay.
Triangles triangles_of(const std::vector<ScreenPoint>& points, std::size_t strips) {
  constexpr std::size_t kWorthAThread = 1024;  // points
  // Half of the threads: others are busy beside it, and two strips alone would hardly be faster.
  if (strips == 0)
    strips = std::min<std::size_t>(points.size() / kWorthAThread, threads_here() / 2);
  if (strips > 1 && !points.empty())
    return sorted(triangles_by_strips(points, strips), points.size());
  std::vector<std::int32_t> all(points.size());
  std::iota(all.begin(), all.end(), 0);
  return sorted(all_of(net_of(points, all)), points.size());
}

}  // namespace

ScreenDelaunay::ScreenDelaunay(std::vector<ScreenPoint> points, std::size_t strips)
    : points_(std::move(points)), triangles_(triangles_of(points_, strips)) {}

ScreenDelaunay::Changes ScreenDelaunay::remove(const std::vector<std::int32_t>& indices) {
  constexpr std::int32_t kGone = -1;
  std::vector<std::int32_t> place(points_.size(), 0);  // from now on
  for (const std::int32_t i : indices) place[i] = kGone;
  std::vector<char> used(points_.size(), 0), touched(points_.size(), 0);
  Triangles rest;
  rest.reserve(triangles_.size());
  for (const Triangle& t : triangles_) {
    const bool stays = place[t[0]] != kGone && place[t[1]] != kGone && place[t[2]] != kGone;
    if (stays) rest.push_back(t);
    for (const std::int32_t i : t) {
      used[i] = 1;
      if (!stays) touched[i] = 1;
    }
  }
  // A point at the place of one that goes would have to come in.
  const bool again = std::count(used.begin(), used.end(), 0) > 0;
  std::size_t left = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (place[i] == kGone) continue;
    place[i] = static_cast<std::int32_t>(left);
    points_[left] = points_[i];
    touched[left++] = again ? 1 : touched[i];
  }
  points_.resize(left);
  touched.resize(left);
  if (again) {
    triangles_ = triangles_of(points_, 1);
  } else {
    for (Triangle& t : rest) t = {place[t[0]], place[t[1]], place[t[2]]};
    Triangles made = missing_triangles(points_, rest, touched);
    std::sort(made.begin(), made.end());
    triangles_.clear();
    std::merge(rest.begin(), rest.end(), made.begin(), made.end(), std::back_inserter(triangles_));
  }
  Changes changes;
  for (std::size_t i = 0; i < left; ++i)
    if (touched[i]) changes.points.push_back(static_cast<std::int32_t>(i));
  for (const Triangle& t : triangles_)
    if (touched[t[0]] || touched[t[1]] || touched[t[2]]) changes.triangles.push_back(t);
  return changes;
}

}  // namespace meniscus
