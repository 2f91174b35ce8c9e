// The only file that includes CGAL: it takes long to compile.
#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>

#include "stages/triangulate.hpp"

namespace meniscus {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<std::int32_t, Kernel>;
using Structure = CGAL::Triangulation_data_structure_2<VertexBase>;
using Delaunay = CGAL::Delaunay_triangulation_2<Kernel, Structure>;

// A point on its way into the triangulation: along boustrophedon rows of the screen.
struct Place {
  long row;
  double u, v;
  std::int32_t index;
};

std::vector<Place> rows_of(const std::vector<ScreenPoint>& points) {
  double low = 0, high = 1;
  for (std::size_t i = 0; i < points.size(); ++i) {
    low = i ? std::min(low, points[i].v) : points[i].v;
    high = i ? std::max(high, points[i].v) : points[i].v;
  }
  const double rows = std::max(1.0, std::sqrt(static_cast<double>(points.size()) / 2));
  const double per_row = std::max((high - low) / rows, 1e-9);
  std::vector<Place> order(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    order[i] = {static_cast<long>((points[i].v - low) / per_row), points[i].u, points[i].v,
                static_cast<std::int32_t>(i)};
  std::sort(order.begin(), order.end(), [](const Place& a, const Place& b) {
    if (a.row != b.row) return a.row < b.row;
    if (a.u != b.u) return (a.u < b.u) == (a.row % 2 == 0);
    if (a.v != b.v) return a.v < b.v;
    return a.index < b.index;  // of equal points the first stays
  });
  return order;
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
  for (const Place& place : rows_of(points)) {
    const std::size_t before = triangulation.number_of_vertices();
    const auto at = triangulation.insert({place.u, place.v}, hint);
    if (triangulation.number_of_vertices() > before) {
      at->info() = place.index;
      vertex[place.index] = at;
    }
    hint = at->face();
  }
}

ScreenDelaunay::ScreenDelaunay(const std::vector<ScreenPoint>& points)
    : net_(std::make_unique<Net>()) {
  net_->points = points;
  net_->insert_all();
}

ScreenDelaunay::~ScreenDelaunay() = default;

void ScreenDelaunay::remove(const std::vector<std::int32_t>& indices) {
  Net& net = *net_;
  // A point at the place of one that goes would have to come in.
  const bool again = net.triangulation.dimension() < 2 ||
                     std::count(net.vertex.begin(), net.vertex.end(), nullptr) > 0;
  std::size_t kept = 0, next = 0;
  for (std::size_t i = 0; i < net.points.size(); ++i) {
    if (next < indices.size() && indices[next] == static_cast<std::int32_t>(i)) {
      ++next;
      if (!again) net.triangulation.remove(net.vertex[i]);
      continue;
    }
    net.points[kept] = net.points[i];
    net.vertex[kept] = net.vertex[i];
    if (!again) net.vertex[kept]->info() = static_cast<std::int32_t>(kept);
    ++kept;
  }
  net.points.resize(kept);
  net.vertex.resize(kept);
  if (again) net.insert_all();
}

std::vector<std::array<std::int32_t, 3>> ScreenDelaunay::triangles() const {
  const Delaunay& triangulation = net_->triangulation;
  // In lists by their smallest vertex, which are short.
  std::vector<std::array<std::int32_t, 3>> found, triangles;
  found.reserve(triangulation.number_of_faces());
  std::vector<std::int32_t> start(net_->points.size() + 1, 0);
  for (auto face = triangulation.finite_faces_begin(); face != triangulation.finite_faces_end();
       ++face) {
    std::array<std::int32_t, 3> t{face->vertex(0)->info(), face->vertex(1)->info(),
                                  face->vertex(2)->info()};
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    found.push_back(t);
    ++start[t[0] + 1];
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
