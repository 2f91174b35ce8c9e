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
  std::vector<std::int32_t> order(points.size());
  double low = 0, high = 1;
  for (std::size_t i = 0; i < points.size(); ++i) {
    order[i] = static_cast<std::int32_t>(i);
    low = i ? std::min(low, points[i].v) : points[i].v;
    high = i ? std::max(high, points[i].v) : points[i].v;
  }
  const double rows = std::max(1.0, std::sqrt(static_cast<double>(points.size()) / 2));
  const double per_row = std::max((high - low) / rows, 1e-9);
  const auto row = [&](std::int32_t i) { return static_cast<long>((points[i].v - low) / per_row); };
  std::sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) {
    const long ra = row(a), rb = row(b);
    if (ra != rb) return ra < rb;
    if (points[a].u != points[b].u) return (points[a].u < points[b].u) == (ra % 2 == 0);
    if (points[a].v != points[b].v) return points[a].v < points[b].v;
    return a < b;  // of equal points the first stays
  });

  Delaunay triangulation;
  Delaunay::Face_handle hint;
  for (const std::int32_t i : order) {
    const std::size_t before = triangulation.number_of_vertices();
    const auto vertex = triangulation.insert({points[i].u, points[i].v}, hint);
    if (triangulation.number_of_vertices() > before) vertex->info() = i;
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
