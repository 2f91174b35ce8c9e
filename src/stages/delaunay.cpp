// The only file that includes CGAL: it takes long to compile.
#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "stages/triangulate.hpp"

namespace meniscus {
namespace {

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
using Structure = CGAL::Triangulation_data_structure_2<VertexBase>;
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
                                          const ScreenPoint& low, double extent) {
  constexpr int kBits = 8;
  const double scale = ((1 << kBits) - 1) / std::max(extent, 1e-9);
  std::vector<std::uint32_t> keys(points.size());  // round, place on the curve
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint32_t round = i % 64 == 0 ? 0 : i % 16 == 0 ? 1 : i % 4 == 0 ? 2 : 3;
    const std::uint32_t place =
        along_curve(static_cast<std::uint32_t>((points[i].u - low.u) * scale),
                    static_cast<std::uint32_t>((points[i].v - low.v) * scale), kBits);
    keys[i] = round << (2 * kBits) | place;
  }
  // Those with equal keys in their order: counted by the low half of the keys, then by the high
  // one.
  constexpr int kHalf = kBits + 1;
  std::vector<std::int32_t> order(points.size()), sorted(points.size());
  std::iota(order.begin(), order.end(), 0);
  for (int shift = 0; shift < 2 * kHalf; shift += kHalf) {
    const auto digit = [&](std::int32_t i) { return keys[i] >> shift & ((1u << kHalf) - 1); };
    std::array<std::int32_t, (1 << kHalf) + 1> start{};
    for (const std::int32_t i : order) ++start[digit(i) + 1];
    std::partial_sum(start.begin(), start.end(), start.begin());
    for (const std::int32_t i : order) sorted[start[digit(i)]++] = i;
    order.swap(sorted);
  }
  return order;
}

// The points of a face, the smallest first.
std::array<std::int32_t, 3> corners_of(const Delaunay::Face_handle& face) {
  std::array<std::int32_t, 3> t{face->vertex(0)->info(), face->vertex(1)->info(),
                                face->vertex(2)->info()};
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

}  // namespace

struct ScreenDelaunay::Net {
  std::vector<ScreenPoint> points;
  Delaunay triangulation;
  std::vector<Delaunay::Vertex_handle> vertex;  // of each point; none where an earlier one lies

  void insert_all();
};

// Each point with its predecessor's face as a hint: short walks. The triangulation does not depend
// on the order, because CGAL settles cocircular points by a symbolic perturbation in the
// lexicographic order of the points, when it inserts and when it removes.
void ScreenDelaunay::Net::insert_all() {
  ScreenPoint low{INFINITY, INFINITY}, high{-INFINITY, -INFINITY};
  for (const ScreenPoint& p : points) {
    low = {std::min(low.u, p.u), std::min(low.v, p.v)};
    high = {std::max(high.u, p.u), std::max(high.v, p.v)};
  }
  const double extent = std::max({high.u - low.u, high.v - low.v, 0.0});
  Kernel kernel;
  kernel.spread_over(extent);
  triangulation = Delaunay(kernel);
  vertex.assign(points.size(), nullptr);
  Delaunay::Face_handle hint;
  for (const std::int32_t index : insertion_order(points, low, extent)) {
    const std::size_t before = triangulation.number_of_vertices();
    const auto at = triangulation.insert({points[index].u, points[index].v}, hint);
    hint = at->face();
    if (triangulation.number_of_vertices() == before) {  // of equal points the first stays
      if (at->info() < index) continue;
      vertex[at->info()] = nullptr;
    }
    at->info() = index;
    vertex[index] = at;
  }
}

ScreenDelaunay::ScreenDelaunay(const std::vector<ScreenPoint>& points)
    : net_(std::make_unique<Net>()) {
  net_->points = points;
  net_->insert_all();
}

ScreenDelaunay::~ScreenDelaunay() = default;

ScreenDelaunay::Changes ScreenDelaunay::remove(const std::vector<std::int32_t>& indices) {
  Net& net = *net_;
  // A point at the place of one that goes would have to come in.
  const bool again = net.triangulation.dimension() < 2 ||
                     std::count(net.vertex.begin(), net.vertex.end(), nullptr) > 0;
  std::vector<char> touched(net.points.size(), again ? 1 : 0);
  if (!again)
    for (const std::int32_t i : indices) {
      auto around = net.triangulation.incident_vertices(net.vertex[i]);
      for (const auto first = around; around != nullptr;) {
        if (!net.triangulation.is_infinite(around)) touched[around->info()] = 1;
        if (++around == first) break;
      }
      net.triangulation.remove(net.vertex[i]);
    }
  Changes changes;
  std::size_t kept = 0, next = 0;
  for (std::size_t i = 0; i < net.points.size(); ++i) {
    if (next < indices.size() && indices[next] == static_cast<std::int32_t>(i)) {
      ++next;
      continue;
    }
    if (touched[i]) changes.points.push_back(static_cast<std::int32_t>(kept));
    net.points[kept] = net.points[i];
    net.vertex[kept] = net.vertex[i];
    if (!again) net.vertex[kept]->info() = static_cast<std::int32_t>(kept);
    ++kept;
  }
  net.points.resize(kept);
  net.vertex.resize(kept);
  if (again) {
    net.insert_all();
    changes.triangles = triangles();
    return changes;
  }
  for (const std::int32_t i : changes.points) {
    auto face = net.triangulation.incident_faces(net.vertex[i]);
    for (const auto first = face; face != nullptr;) {
      if (!net.triangulation.is_infinite(face)) changes.triangles.push_back(corners_of(face));
      if (++face == first) break;
    }
  }
  std::sort(changes.triangles.begin(), changes.triangles.end());
  changes.triangles.erase(std::unique(changes.triangles.begin(), changes.triangles.end()),
                          changes.triangles.end());
  return changes;
}

std::vector<std::array<std::int32_t, 3>> ScreenDelaunay::triangles() const {
  const Delaunay& triangulation = net_->triangulation;
  // In lists by their smallest vertex, which are short.
  std::vector<std::array<std::int32_t, 3>> found, triangles;
  found.reserve(triangulation.number_of_faces());
  std::vector<std::int32_t> start(net_->points.size() + 1, 0);
  for (auto face = triangulation.finite_faces_begin(); face != triangulation.finite_faces_end();
       ++face) {
    found.push_back(corners_of(face));
    ++start[found.back()[0] + 1];
  }
  for (std::size_t i = 1; i < start.size(); ++i) start[i] += start[i - 1];
  triangles.resize(found.size());
  std::vector<std::int32_t> next(start.begin(), start.end() - 1);
  for (const auto& t : found) triangles[next[t[0]]++] = t;
  for (std::size_t i = 1; i < start.size(); ++i)
    std::sort(triangles.begin() + start[i - 1], triangles.begin() + start[i]);
  return triangles;
}

}  // namespace meniscus
