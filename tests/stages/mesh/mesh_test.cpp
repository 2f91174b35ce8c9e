// The mesher on every combination of layers around a node, and on planes.
#include "stages/mesh/mesh.hpp"

#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>

#include "meniscus/camera.hpp"
#include "meniscus/error.hpp"
#include "stages/mesh/silhouettes.hpp"
#include "stages/orthographic_view.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

constexpr double kZMax = 2;
constexpr double kNone = std::numeric_limits<double>::infinity();

View perspective_view(int width, int height) {
  return make_view(look_at({4, 3, 30}, {0, 0, 0}, {0, 1, 0}, 50, width, height), 0.5, {1, 2, 3});
}

SurfaceMap node_map(int nx, int ny, const std::vector<double>& depth) {
  SurfaceMap map;
  map.grid = {nx, ny, 0.0f, 1.0f};
  map.depth.assign(depth.begin(), depth.end());
  return map;
}

Mesh mesh_of(const View& view, const SurfaceMap& map, int rounds, double z_max = kZMax) {
  MeshParams params;
  params.z_max = z_max;
  params.silhouette_rounds = rounds;
  return make_mesh(view, map, find_silhouette_edges(map, z_max), params);
}

using Edge = std::pair<std::uint32_t, std::uint32_t>;

// Directed edges of a mesh; the value counts the triangles that run along it that way.
std::map<Edge, int> directed_edges(const Mesh& mesh) {
  std::map<Edge, int> edges;
  for (const auto& t : mesh.triangle)
    for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  return edges;
}

// What must hold of every mesh: an empty string, or what does not.
std::string topology_fault(const Mesh& mesh) {
  if (mesh.normal.size() != mesh.position.size()) return "a vertex without a normal";
  std::vector<int> triangles_at(mesh.position.size(), 0);
  for (const auto& t : mesh.triangle) {
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return "a triangle with a repeated vertex";
    for (const auto v : t) {
      if (v >= mesh.position.size()) return "an index out of range";
      ++triangles_at[v];
    }
  }
  const auto edges = directed_edges(mesh);
  std::vector<int> open_edges_from(mesh.position.size(), 0);
  for (const auto& [edge, count] : edges) {
    if (count > 1) return "an edge that two triangles run along in the same direction";
    if (!edges.count({edge.second, edge.first})) ++open_edges_from[edge.first];
  }
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    if (triangles_at[v] == 0) return "an unused vertex";
    // One open edge may leave a vertex; two are two fans that share nothing but the vertex.
    if (open_edges_from[v] > 1) return "a vertex in two fans";
    const Vec3d p(mesh.position[v]), n(mesh.normal[v]);
    if (!std::isfinite(dot(p, p))) return "a vertex that is not finite";
    if (!(std::abs(length(n) - 1) < 1e-6)) return "a normal that is not of unit length";
  }
  return "";
}

struct Screen {
  double u, v, depth;
};

// The orthographic view's pixel coordinates; exact, because nodes lie at multiples of a half.
Screen screen_of(const Vec3& p, int width, int height) {
  return {p.x + width * 0.5, height * 0.5 - p.y, -p.z};
}

bool whole(double x) { return x == std::floor(x); }

// The share of a cell that is surface: nodes without surface keep what the cuts half way give them,
// and the middle of a cell with three or four cuts goes to a surface.
double covered_share(const std::array<double, 4>& corner) {
  int none = 0;
  for (const double d : corner) none += !std::isfinite(d);
  const bool opposite = none == 2 && std::isfinite(corner[0]) == std::isfinite(corner[2]);
  if (opposite) return 0.75;  // two corner triangles of 1/8 are left out
  return std::array{1.0, 7.0 / 8, 0.5, 1.0 / 8, 0.0}[none];
}

// Checks the mesh of one pattern of depths; returns the first thing that is wrong.
std::string fault(int nx, int ny, const std::vector<double>& depth) {
  const SurfaceMap map = node_map(nx, ny, depth);
  const int width = nx - 1, height = ny - 1;
  const View view = orthographic_view(width, height);
  const Mesh smoothed = mesh_of(view, map, 3);
  if (const auto f = topology_fault(smoothed); !f.empty()) return "smoothed: " + f;
  for (const auto& t : smoothed.triangle) {
    const Screen a = screen_of(smoothed.position[t[0]], width, height),
                 b = screen_of(smoothed.position[t[1]], width, height),
                 c = screen_of(smoothed.position[t[2]], width, height);
    // Positions are rounded to floats of at most 4: an area is off by less than 1e-5.
    if ((b.u - a.u) * (a.v - c.v) - (a.v - b.v) * (c.u - a.u) < -1e-5)
      return "smoothed: a triangle that is turned away";
  }

  const Mesh mesh = mesh_of(view, map, 0);
  if (const auto f = topology_fault(mesh); !f.empty()) return f;
  if (mesh.triangle.size() != smoothed.triangle.size()) return "smoothing changed the triangles";
  std::vector<Screen> screen;
  for (const Vec3& p : mesh.position) screen.push_back(screen_of(p, width, height));

  // Orientation and coverage, cell by cell.
  std::vector<double> area(width * height, 0);
  for (const auto& t : mesh.triangle) {
    const Screen &a = screen[t[0]], &b = screen[t[1]], &c = screen[t[2]];
    const double twice = (b.u - a.u) * (a.v - c.v) - (a.v - b.v) * (c.u - a.u);
    if (!(twice > 1e-3)) return "a triangle without area or turned away";
    const int i = static_cast<int>((a.u + b.u + c.u) / 3),
              j = static_cast<int>((a.v + b.v + c.v) / 3);
    area[j * width + i] += twice / 2;
  }
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) {
      const int n = j * nx + i;
      const double expected =
          covered_share({depth[n], depth[n + nx], depth[n + nx + 1], depth[n + 1]});
      if (std::abs(area[j * width + i] - expected) > 1e-5) return "a cell that is not covered once";
    }

  // Every finite node is a vertex; no crack: an open edge joins two cuts or lies on the border.
  std::vector<char> is_node(screen.size(), 0);
  int nodes_found = 0, nodes_wanted = 0;
  for (std::size_t v = 0; v < screen.size(); ++v) {
    if (!whole(screen[v].u) || !whole(screen[v].v)) continue;
    const int n = static_cast<int>(screen[v].v) * nx + static_cast<int>(screen[v].u);
    if (static_cast<float>(depth[n]) != static_cast<float>(screen[v].depth))
      return "a vertex on a node that is not at its depth";
    is_node[v] = 1;
    ++nodes_found;
  }
  for (const double d : depth) nodes_wanted += std::isfinite(d);
  if (nodes_found != nodes_wanted) return "a node that is not one vertex";
  const auto edges = directed_edges(mesh);
  for (const auto& [edge, count] : edges) {
    if (edges.count({edge.second, edge.first})) continue;
    const Screen &a = screen[edge.first], &b = screen[edge.second];
    const bool on_border =
        (a.u == b.u && (a.u == 0 || a.u == width)) || (a.v == b.v && (a.v == 0 || a.v == height));
    if (!on_border && (is_node[edge.first] || is_node[edge.second])) return "a crack in a layer";
  }
  return "";
}

std::string pattern_text(int nx, const std::vector<double>& depth) {
  std::string text;
  for (std::size_t k = 0; k < depth.size(); ++k)
    text += (k % nx ? " " : "\n  ") + std::to_string(depth[k]);
  return text;
}

// All ways to put `levels` on nx x ny nodes.
void expect_all_patterns(int nx, int ny, const std::vector<double>& levels) {
  const std::size_t size = static_cast<std::size_t>(nx) * ny;
  std::vector<std::size_t> digit(size, 0);
  std::vector<double> depth(size);
  for (bool more = true; more;) {
    for (std::size_t k = 0; k < size; ++k) depth[k] = levels[digit[k]];
    ASSERT_EQ(fault(nx, ny, depth), "") << pattern_text(nx, depth);
    more = false;
    for (std::size_t k = 0; k < size && !more; ++k) {
      digit[k] = (digit[k] + 1) % levels.size();
      more = digit[k] != 0;
    }
  }
}

TEST(Mesh, EveryCellOfSeparateLayers) { expect_all_patterns(2, 2, {kNone, 4, 8, 12, 16}); }

// Levels of which neighbours hang together (1.5 <= z_max) but no others: tears end in cells.
TEST(Mesh, EveryCellOfLayersThatHangTogetherInAChain) {
  expect_all_patterns(2, 2, {kNone, 4, 5.5, 7, 8.5, 10});
}

TEST(Mesh, EveryPairOfCells) { expect_all_patterns(3, 2, {kNone, 4, 5.5, 7, 12}); }

TEST(Mesh, EveryPatternOfTwoLayersAroundANode) { expect_all_patterns(3, 3, {kNone, 4, 8}); }

TEST(Mesh, EveryPatternOfATearAroundANode) { expect_all_patterns(3, 3, {4, 5.5, 7}); }

TEST(Mesh, RandomPatternsOnLargerGrids) {
  std::mt19937 random(1);
  const std::vector<double> levels{kNone, kNone, 4, 5.5, 7, 8.5, 12};
  for (int trial = 0; trial < 4000; ++trial) {
    const int nx = 4 + static_cast<int>(random() % 2), ny = 4 + static_cast<int>(random() % 2);
    std::vector<double> depth;
    for (int k = 0; k < nx * ny; ++k) depth.push_back(levels[random() % levels.size()]);
    ASSERT_EQ(fault(nx, ny, depth), "") << pattern_text(nx, depth);
  }
}

// Random cuts, with and without a sample there, keep all promises but the coverage by halves.
TEST(Mesh, RandomCutsAndSmoothingKeepTheTopology) {
  std::mt19937 random(2);
  const std::vector<double> levels{kNone, 4, 5.5, 7, 12};
  const View view = perspective_view(5, 4);
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<double> depth;
    for (int k = 0; k < 30; ++k) depth.push_back(levels[random() % levels.size()]);
    const SurfaceMap map = node_map(6, 5, depth);
    auto edges = find_silhouette_edges(map, kZMax);
    for (auto& edge : edges) {
      edge.cut = static_cast<float>(random() % 11) / 10;
      if (random() % 2)
        edge.surface.depth = map.depth[edge.front] + static_cast<float>(random() % 7) - 3;
    }
    MeshParams params;
    params.z_max = kZMax;
    params.silhouette_rounds = trial % 5;
    const Mesh mesh = make_mesh(view, map, edges, params);
    ASSERT_EQ(topology_fault(mesh), "");
    for (const auto& t : mesh.triangle) {
      const auto at = [&](int k) { return eye_from_world(view, Vec3d(mesh.position[t[k]])); };
      // Positive volume with the eye behind: counter-clockwise seen from the eye. A float position
      // of size 30 is off by 2e-6 world units, 4e-6 radii; depths are below 16, sides below 40.
      EXPECT_GT(-dot(at(0), cross(at(1) - at(0), at(2) - at(0))), -4e-6 * 3 * 16 * 40);
    }
  }
}

// Depth of the plane normal . e = offset (radii) on the ray of (u, v).
double plane_depth(const View& view, const Vec3d& normal, double offset, double u, double v) {
  const Vec3d origin = point_at(view, u, v, 0), direction = ray_direction(view, u, v);
  return (offset - dot(normal, origin)) / dot(normal, direction);
}

class MeshOfPlanes : public testing::TestWithParam<bool> {};

// Two half planes, one in front of the other, and none beside them: each sheet stays on its plane,
// cut vertices, extrapolated ones and smoothed ones included.
TEST_P(MeshOfPlanes, StayPlanes) {
  const int width = 23, height = 17;
  const View view = GetParam() ? perspective_view(width, height) : orthographic_view(width, height);
  const Vec3d front_normal = normalized({0.2, -0.1, 1}), back_normal = normalized({-0.1, 0.3, 1});
  const double front_offset = GetParam() ? -40 : -10, back_offset = GetParam() ? -70 : -40;
  SurfaceMap map;
  map.grid = node_grid(view, 1);
  for (int j = 0; j < map.grid.ny; ++j)
    for (int i = 0; i < map.grid.nx; ++i) {
      const bool front = i + (j / 2)<14, none = i> 20;
      map.depth.push_back(
          none ? kNoSurface
               : static_cast<float>(front ? plane_depth(view, front_normal, front_offset, i, j)
                                          : plane_depth(view, back_normal, back_offset, i, j)));
    }
  const double z_max = 8;
  MeshParams params;
  params.z_max = z_max;
  auto edges = find_silhouette_edges(map, z_max);
  ASSERT_FALSE(edges.empty());
  for (std::size_t e = 0; e < edges.size(); ++e) edges[e].cut = 0.1f * static_cast<float>(e % 11);
  const Mesh mesh = make_mesh(view, map, edges, params);
  ASSERT_EQ(topology_fault(mesh), "");
  int on_front = 0, on_back = 0;
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    const Vec3d eye = eye_from_world(view, Vec3d(mesh.position[v]));
    const double from_front = std::abs(dot(front_normal, eye) - front_offset);
    const double from_back = std::abs(dot(back_normal, eye) - back_offset);
    // Depths of at most 128 radii are rounded to floats (4e-6 off). An extrapolated depth takes
    // at most five such errors (its node twice an axis, the neighbours). A smoothing round steps
    // forward (weights sum to 1) and back (3/2 and 1/2: 2 in all), so three grow errors by 8.
    // The position is rounded too: three axes below 64 world units, 2e-6 each, 4e-6 radii.
    const double tolerance = 4e-6 * 5 * 8 + 3 * 4e-6;
    EXPECT_LT(std::min(from_front, from_back), tolerance) << v;
    (from_front < from_back ? on_front : on_back) += 1;
    const Vec3d n = from_front < from_back ? front_normal : back_normal;
    const Vec3d world = world_direction(view, n);
    // A triangle is at least a fiftieth of a cell (0.02 radii) high: it tilts by tolerance / 0.02,
    // 0.0086, and the cosine of that is over 1 - 0.0086^2 / 2.
    EXPECT_GT(dot(world, Vec3d(mesh.normal[v])), 1 - 0.5 * 0.0086 * 0.0086) << v;
  }
  EXPECT_GT(on_front, 0);
  EXPECT_GT(on_back, 0);
}

INSTANTIATE_TEST_SUITE_P(Views, MeshOfPlanes, testing::Bool(), [](const auto& info) {
  return info.param ? "perspective" : "orthographic";
});

// The whole screen at one depth: the two triangles of every cell, with alternating diagonals.
TEST(Mesh, FlatScreenAlternatesDiagonals) {
  const SurfaceMap map = node_map(4, 3, std::vector<double>(12, 5.0));
  const Mesh mesh = mesh_of(orthographic_view(3, 2), map, 3);
  EXPECT_EQ(mesh.position.size(), 12u);
  EXPECT_EQ(mesh.triangle.size(), 12u);
  std::set<Edge> edges;
  for (const auto& [edge, count] : directed_edges(mesh)) edges.insert(edge);
  EXPECT_TRUE(edges.count({0, 5}));  // cell (0, 0): upper left to lower right
  EXPECT_TRUE(edges.count({5, 2}));  // cell (1, 0): lower left to upper right
  EXPECT_TRUE(edges.count({4, 9}) == 0 && edges.count({8, 5}) == 1);  // cell (0, 1)
  for (const Vec3& n : mesh.normal) EXPECT_EQ(n, (Vec3{0, 0, 1}));
}

// A disc keeps its area and gets smoother: the staircase of cuts half way vanishes.
TEST(Mesh, SmoothingKeepsADiscsAreaAndRoundsIt) {
  const int side = 40;
  const double radius = 14.3, centre = 20.2;
  std::vector<double> depth;
  for (int j = 0; j <= side; ++j)
    for (int i = 0; i <= side; ++i)
      depth.push_back(std::hypot(i - centre, j - centre) < radius ? 10 : kNone);
  const SurfaceMap map = node_map(side + 1, side + 1, depth);
  const View view = orthographic_view(side, side);
  struct Outline {
    double area = 0, roughness = 0;  // cells^2; RMS distance of the cuts from the circle, cells
    int cuts = 0;
  };
  const auto measure = [&](int rounds) {
    const Mesh mesh = mesh_of(view, map, rounds);
    Outline outline;
    for (const auto& t : mesh.triangle) {
      const Vec3d a(mesh.position[t[0]]);
      outline.area +=
          0.5 * length(cross(Vec3d(mesh.position[t[1]]) - a, Vec3d(mesh.position[t[2]]) - a));
    }
    const auto edges = directed_edges(mesh);
    double squares = 0;
    for (const auto& [edge, count] : edges) {
      if (edges.count({edge.second, edge.first})) continue;
      const Screen s = screen_of(mesh.position[edge.first], side, side);
      const double off = std::hypot(s.u - centre, s.v - centre) - radius;
      squares += off * off;
      ++outline.cuts;
    }
    outline.roughness = std::sqrt(squares / outline.cuts);
    return outline;
  };
  const Outline rough = measure(0), smooth = measure(3);
  // The area of a polygon is the sum of n/2 sin(2 pi k/n) |c_k|^2 over its Fourier coefficients.
  // Three rounds keep k = 1, the circle, to 3 (1 - cos(2 pi/n))^2 / 2; the others, which they may
  // remove, hold the mean square roughness in all and weigh at most 1/sin(2 pi/n) of k = 1.
  const double step = 2 * std::acos(-1.0) / rough.cuts;
  const double bound = 1.5 * std::pow(1 - std::cos(step), 2) +
                       std::pow(rough.roughness / radius, 2) / std::sin(step);
  EXPECT_LT(bound, 0.02);
  EXPECT_NEAR(smooth.area / rough.area, 1, bound);
  EXPECT_LT(smooth.roughness, 0.8 * rough.roughness);
}

TEST(Mesh, UsesTheImplicitNormalsWhereThereAreAny) {
  SurfaceMap map = node_map(2, 2, {5, 5, 5, 5});
  const Vec3d tilted = normalized({0.6, 0, 0.8});
  map.normal = {Vec3(tilted), {}, Vec3(tilted), {}};
  const View view = perspective_view(1, 1);
  const Mesh mesh = mesh_of(view, map, 0);
  ASSERT_EQ(mesh.normal.size(), 4u);
  const Vec3d world = world_direction(view, tilted), facing = world_direction(view, {0, 0, 1});
  for (int v = 0; v < 4; ++v)  // two roundings to float
    EXPECT_LT(length(Vec3d(mesh.normal[v]) - (v % 2 ? facing : world)), 4 * FLT_EPSILON) << v;
}

TEST(Mesh, FindsSilhouetteEdgesInCanonicalOrder) {
  const SurfaceMap map = node_map(3, 2, {4, 6, 8.5, kNone, 5, kNone});
  const auto edges = find_silhouette_edges(map, 2);
  std::vector<std::pair<int, int>> ends;
  for (const auto& edge : edges) ends.emplace_back(edge.front, edge.back);
  EXPECT_EQ(ends, (std::vector<std::pair<int, int>>{{0, 3}, {1, 2}, {2, 5}, {4, 3}, {4, 5}}));
}

TEST(Mesh, NamesWhatIsWrong) {
  const View view = orthographic_view(2, 1);
  const SurfaceMap map = node_map(3, 2, {4, kNone, kNone, 4, kNone, kNone});
  const auto edges = find_silhouette_edges(map, kZMax);
  const auto message = [&](const SurfaceMap& nodes, std::vector<SilhouetteEdge> given) {
    return text_of_thrown<InvalidArgument>([&] { make_mesh(view, nodes, given, {}); });
  };
  EXPECT_EQ(message(map, edges), "no error");
  EXPECT_NE(message(map, {}).find("no silhouette edge lies between"), std::string::npos);
  auto bad = edges;
  bad[0].cut = 1.5f;
  EXPECT_NE(message(map, bad).find("must be in [0, 1]"), std::string::npos);
  bad = edges;
  bad[0].cut = std::nanf("");
  EXPECT_NE(message(map, bad).find("must be in [0, 1]"), std::string::npos);
  bad = edges;
  bad[0].back = 2;
  EXPECT_NE(message(map, bad).find("not neighbours"), std::string::npos);
  bad = edges;
  std::swap(bad[0].front, bad[0].back);
  EXPECT_NE(message(map, bad).find("no surface at its front node"), std::string::npos);
  bad = edges;
  bad.push_back(bad[0]);
  EXPECT_NE(message(map, bad).find("given twice"), std::string::npos);
  SurfaceMap wrong = map;
  wrong.depth.pop_back();
  EXPECT_NE(message(wrong, edges).find("5 depths"), std::string::npos);
  EXPECT_THROW(find_silhouette_edges(map, 0), InvalidArgument);
}

}  // namespace
}  // namespace meniscus
