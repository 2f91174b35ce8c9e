// The only file that includes CGAL: it takes long to compile.
#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>

#include "stages/triangulate.hpp"

namespace meniscus {

std::vector<std::array<std::int32_t, 3>> delaunay(const std::vector<ScreenPoint>& points) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<std::int32_t, Kernel>;
  using Structure = CGAL::Triangulation_data_structure_2<VertexBase>;
  using Delaunay = CGAL::Delaunay_triangulation_2<Kernel, Structure>;

  // Insert along boustrophedon rows of the screen, each point with its predecessor's face as a
  // hint: short walks. The triangulation does not depend on the order, because CGAL settles
  // cocircular points by a symbolic perturbation in the lexicographic order of the points.
  double low = 0, high = 1;
  for (std::size_t i = 0; i < points.size(); ++i) {
    low = i ? std::min(low, points[i].v) : points[i].v;
    high = i ? std::max(high, points[i].v) : points[i].v;
  }
  const double rows = std::max(1.0, std::sqrt(static_cast<double>(points.size()) / 2));
  const double per_row = std::max((high - low) / rows, 1e-9);
  struct Place {
    long row;
    double u, v;
    std::int32_t index;
  };
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

  Delaunay triangulation;
  Delaunay::Face_handle hint;
  for (const Place& place : order) {
    const std::size_t before = triangulation.number_of_vertices();
    const auto vertex = triangulation.insert({place.u, place.v}, hint);
    if (triangulation.number_of_vertices() > before) vertex->info() = place.index;
    hint = vertex->face();
  }

  std::vector<std::array<std::int32_t, 3>> triangles;
  triangles.reserve(triangulation.number_of_faces());
  for (auto face = triangulation.finite_faces_begin(); face != triangulation.finite_faces_end();
       ++face) {
    std::array<std::int32_t, 3> t{face->vertex(0)->info(), face->vertex(1)->info(),
                                  face->vertex(2)->info()};
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    triangles.push_back(t);
  }
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

}  // namespace meniscus
