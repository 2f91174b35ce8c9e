// The only file that includes CGAL: it takes long to compile.
#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "stages/triangulate.hpp"

namespace meniscus {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
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
std::vector<std::int32_t> insertion_order(const std::vector<ScreenPoint>& points) {
  constexpr int kBits = 8;
  ScreenPoint low{INFINITY, INFINITY}, high{-INFINITY, -INFINITY};
  for (const ScreenPoint& p : points) {
    low = {std::min(low.u, p.u), std::min(low.v, p.v)};
    high = {std::max(high.u, p.u), std::max(high.v, p.v)};
  }
  const double scale = ((1 << kBits) - 1) / std::max({high.u - low.u, high.v - low.v, 1e-9});
  std::vector<std::uint64_t> keys(points.size());  // round, place on the curve, index
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint64_t round = i % 64 == 0 ? 0 : i % 16 == 0 ? 1 : i % 4 == 0 ? 2 : 3;
    const std::uint64_t place =
        along_curve(static_cast<std::uint32_t>((points[i].u - low.u) * scale),
                    static_cast<std::uint32_t>((points[i].v - low.v) * scale), kBits);
    keys[i] = round << 62 | place << 32 | i;
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::int32_t> order(points.size());
  for (std::size_t k = 0; k < order.size(); ++k)
    order[k] = static_cast<std::int32_t>(keys[k] & 0xffffffffu);
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
  triangulation.clear();
  vertex.assign(points.size(), nullptr);
  Delaunay::Face_handle hint;
  for (const std::int32_t index : insertion_order(points)) {
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
