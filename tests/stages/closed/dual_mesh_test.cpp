// Whatever the signs at the corners of cells, the mesh is closed and manifold.
#include <gtest/gtest.h>

#include <array>
#include <set>

#include "accuracy/closed.hpp"
#include "stages/closed/crumbs.hpp"
#include "stages/closed/dual_faces.hpp"
#include "stages/closed/dual_vertices.hpp"
#include "thrown.hpp"
#include "verify/stage_cases/inputs.hpp"

namespace meniscus {
namespace {

Mesh plain(const DualMesh& dual) {
  Mesh mesh;
  for (const Vec3d& at : dual.position) mesh.position.push_back(static_cast<Vec3>(at));
  for (const Vec3d& n : dual.normal) mesh.normal.push_back(static_cast<Vec3>(n));
  mesh.triangle = dual.triangle;
  return mesh;
}

// A cube of cells whose inner corners have the values of `value(x, y, z)`, and 1 around.
template <class Value>
SpaceGrid grid_of(int side, const Value& value) {
  Points points;
  for (int k = 0; k < side; ++k)
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i) points.add(Vec3d(i, j, k) * 0.5);
  SpaceGrid grid = grid_around(points, 1, 0.5);
  do {
    fill_corners(grid, 16, [&](const Points& wanted) {
      std::vector<float> values;
      for (std::size_t p = 0; p < wanted.size(); ++p) {
        const Vec3d at(wanted.x[p], wanted.y[p], wanted.z[p]);
        const auto within = [&](double v) { return v > 0.1 && v < 0.5 * side - 0.6; };
        values.push_back(within(at.x) && within(at.y) && within(at.z) ? value(at) : 1.0f);
      }
      return values;
    });
  } while (want_closed(grid));
  return grid;
}

// Crossings half-way along their edges, whose normals are the edges' directions.
CrossedEdges halved(const SpaceGrid& grid) {
  CrossedEdges edges = list_crossings(grid);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto b = static_cast<std::size_t>(edges.block[e]);
    const int bit = edges.bit[e];
    const double up = grid.blocks[b].value[static_cast<std::size_t>(bit)] < 0 ? 1 : -1;
    Vec3d along;
    (edges.axis[e] == 0 ? along.x : edges.axis[e] == 1 ? along.y : along.z) = 1;
    edges.position[e] = grid.position(b, bit) + along * (0.5 * grid.cell);
    edges.normal[e] = along * up;
  }
  return edges;
}

CrossedEdges guessed_crossings(const SpaceGrid& grid) {
  CrossedEdges edges = list_crossings(grid);
  guess_crossings(grid, edges);
  for (std::size_t e = 0; e < edges.size(); ++e) edges.normal[e] = guess_normal(grid, edges, e);
  return edges;
}

// F is linear along edges, and its slope is told by the corners around them.
TEST(SpaceGrid, GuessesTheCrossingsOfAPlane) {
  const Vec3d normal = normalized({0.3, -0.5, 0.8});
  const double offset = dot(normal, {3.1, 3.2, 3.3});
  const SpaceGrid grid =
      grid_of(14, [&](const Vec3d& at) { return static_cast<float>(dot(normal, at) - offset); });
  CrossedEdges edges = guessed_crossings(grid);
  int compared = 0;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const Vec3d& at = edges.position[e];
    const auto within = [](double v) { return v > 1.1 && v < 5.4; };  // no corner around is outside
    if (!within(at.x) || !within(at.y) || !within(at.z)) continue;
    ++compared;
    // Values round to 2^-24 of at most 8; the steepest edge has .15 of slope over half a radius.
    EXPECT_NEAR(dot(normal, at), offset, 1e-5);
    EXPECT_LT(length(edges.normal[e] - normal), 1e-5);
  }
  EXPECT_GT(compared, 100);
}

// White noise has all configurations of a cell, and pairs of cells that are neighbours twice.
TEST(DualMesh, OfNoiseIsClosedAndManifold) {
  std::int64_t between = 0, triangles = 0;
  for (const double share : {0.5, 0.2, 0.8})
    for (unsigned seed = 1; seed <= 3; ++seed) {
      Random random(seed);
      const SpaceGrid grid = grid_of(14, [&](const Vec3d&) {
        return static_cast<float>(random(0.1, 1) * (random(0, 1) < share ? -1 : 1));
      });
      const CrossedEdges edges = halved(grid);
      DualMesh mesh = place_vertices(grid, edges, {});
      const std::size_t of_cells = mesh.position.size();
      join_vertices(grid, edges, mesh);
      between += static_cast<std::int64_t>(mesh.position.size() - of_cells);
      triangles += static_cast<std::int64_t>(mesh.triangle.size());
      const accuracy::ClosedFigures figures = accuracy::check_topology(plain(mesh));
      EXPECT_EQ(figures.open_edges, 0) << "share " << share << ", seed " << seed;
      EXPECT_EQ(figures.bad_edges, 0) << "share " << share << ", seed " << seed;
      EXPECT_EQ(figures.bad_vertices, 0) << "share " << share << ", seed " << seed;
      EXPECT_GT(figures.volume, 0);
      // Each vertex lies in its own cell, and is used.
      std::vector<char> used(mesh.position.size(), 0);
      for (const auto& t : mesh.triangle)
        for (const std::uint32_t v : t) used[v] = 1;
      EXPECT_EQ(std::count(used.begin(), used.end(), 0), 0);
      for (std::size_t v = 0; v < of_cells; ++v) {
        const auto& [low, high] = mesh.bounds[v];
        const Vec3d& at = mesh.position[v];
        EXPECT_TRUE(at.x >= low.x && at.x <= high.x && at.y >= low.y && at.y <= high.y &&
                    at.z >= low.z && at.z <= high.z);
      }
    }
  EXPECT_GT(between, 100);
  EXPECT_GT(triangles, 30000);
}

// Planes that cross all edges exactly: their edges and corners are met to rounding.
TEST(DualMesh, OfABoxHasItsCorners) {
  const Vec3d low(1.3, 1.2, 1.4), high(4.6, 3.9, 4.3);
  const auto distance = [&](const Vec3d& p) {
    return std::max(
        {low.x - p.x, p.x - high.x, low.y - p.y, p.y - high.y, low.z - p.z, p.z - high.z});
  };
  const SpaceGrid grid =
      grid_of(14, [&](const Vec3d& p) { return static_cast<float>(distance(p)); });
  CrossedEdges edges = halved(grid);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    Vec3d& p = edges.position[e];
    double& x = edges.axis[e] == 0 ? p.x : edges.axis[e] == 1 ? p.y : p.z;
    const double n = dot(edges.normal[e], Vec3d(1, 1, 1));
    x = edges.axis[e] == 0   ? (n > 0 ? high.x : low.x)
        : edges.axis[e] == 1 ? (n > 0 ? high.y : low.y)
                             : (n > 0 ? high.z : low.z);
  }
  DualMesh mesh = place_vertices(grid, edges, {});
  join_vertices(grid, edges, mesh);
  for (const Vec3d& at : mesh.position) EXPECT_NEAR(distance(at), 0, 1e-12);
  const accuracy::ClosedFigures figures = accuracy::check_topology(plain(mesh));
  EXPECT_EQ(figures.open_edges + figures.bad_edges + figures.bad_vertices, 0);
  EXPECT_EQ(figures.pieces, 1);
  const Vec3d size = high - low;
  // All vertices are on the box, its corners among them: the volume is off by floats alone.
  EXPECT_NEAR(figures.volume, size.x * size.y * size.z, 1e-4);
}

// The upper half of a ball: its triangles are those of the whole, and however little it encloses,
// it stays.
TEST(DualMesh, LeavesOutPartOfTheSurface) {
  const Vec3d centre(3, 3, 3);
  const SpaceGrid grid =
      grid_of(15, [&](const Vec3d& p) { return static_cast<float>(length(p - centre) - 1.6); });
  const CrossedEdges edges = halved(grid);
  std::vector<std::uint32_t> upper;
  for (std::size_t e = 0; e < edges.size(); ++e)
    if (edges.position[e].z > centre.z) upper.push_back(static_cast<std::uint32_t>(e));
  DualMesh whole = place_vertices(grid, edges, {}), half = place_vertices(grid, edges, upper, {});
  join_vertices(grid, edges, whole);
  join_vertices(grid, edges, upper, half);
  const auto drawn = [](const DualMesh& mesh) {
    std::set<std::array<double, 9>> all;
    for (const auto& t : mesh.triangle) {
      std::array<double, 9> corners;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d& at = mesh.position[t[k]];
        corners[3 * k] = at.x, corners[3 * k + 1] = at.y, corners[3 * k + 2] = at.z;
      }
      all.insert(corners);
    }
    return all;
  };
  const auto of_whole = drawn(whole), of_half = drawn(half);
  EXPECT_EQ(of_half.size(), 2 * upper.size());
  EXPECT_LT(of_half.size(), of_whole.size());
  EXPECT_LT(half.position.size(), whole.position.size());
  for (const auto& triangle : of_half) EXPECT_TRUE(of_whole.contains(triangle));
  drop_crumbs(half, 1e9, 1e9);
  EXPECT_EQ(drawn(half), of_half);
  drop_crumbs(whole, 1e9, 1e9);
  EXPECT_TRUE(drawn(whole).empty());
}

// A ball of fluid of radius 1.5 with air of radius .5 in it, and a drop of radius .3 beside it.
TEST(DualMesh, LosesWhatIsTooSmall) {
  const Vec3d ball(2.6, 3, 3), drop(5.3, 3.1, 3.1);
  const SpaceGrid grid = grid_of(15, [&](const Vec3d& p) {
    const double around = length(p - ball);
    return static_cast<float>(
        std::min(std::max(around - 1.6, 0.7 - around), length(p - drop) - 0.4));
  });
  const CrossedEdges edges = halved(grid);
  DualMesh whole = place_vertices(grid, edges, {});
  join_vertices(grid, edges, whole);
  const accuracy::ClosedFigures all = accuracy::check_topology(plain(whole));
  ASSERT_EQ(all.pieces, 3);
  ASSERT_EQ(all.bubbles, 1);
  const auto kept = [&](double fluid, double air) {
    DualMesh mesh = whole;
    drop_crumbs(mesh, fluid, air);
    for (const auto& t : mesh.triangle)
      for (const std::uint32_t v : t) EXPECT_LT(v, mesh.position.size());
    const accuracy::ClosedFigures f = accuracy::check_topology(plain(mesh));
    EXPECT_EQ(f.open_edges + f.bad_edges + f.bad_vertices, 0);
    return std::pair{f.pieces, f.bubbles};
  };
  EXPECT_EQ(kept(0, 0), (std::pair<std::int64_t, std::int64_t>{3, 1}));
  EXPECT_EQ(kept(0, 8), (std::pair<std::int64_t, std::int64_t>{2, 0}));
  EXPECT_EQ(kept(1, 0), (std::pair<std::int64_t, std::int64_t>{2, 1}));
  EXPECT_EQ(kept(1e9, 8), (std::pair<std::int64_t, std::int64_t>{0, 0}));
}

TEST(SpaceGrid, RefusesCellsThatAreTooSmallForIt) {
  Points far;
  far.add({0, 0, 0});
  far.add({1e7, 0, 0});
  const std::string text = text_of_thrown<InvalidArgument>([&] { grid_around(far, 2, 0.1); });
  EXPECT_NE(text.find("cell is 0.1 particle radii"), std::string::npos) << text;
}

// A plane that lies beside the crossings, as F tells it: vertices go onto it where they may.
TEST(DualMesh, VerticesLeaveTheirCellsAsFarAsTheyMay) {
  const SpaceGrid grid =
      grid_of(14, [](const Vec3d& at) { return static_cast<float>(at.z - 3.2); });
  CrossedEdges edges = guessed_crossings(grid);
  const double off = 0.4;  // the cells end at 3.5
  for (float& value : edges.value) value = static_cast<float>(-off);
  const auto highest = [&](const Placing& placing) {
    double high = 0;
    const DualMesh mesh = place_vertices(grid, edges, placing);
    for (const Vec3d& at : mesh.position)
      if (at.x > 1.1 && at.x < 5.4 && at.y > 1.1 && at.y < 5.4 && at.z > 3)
        high = std::max(high, at.z);
    return high;
  };
  EXPECT_NEAR(highest({.most_off = 0.3}), 3.2, 1e-5);  // more than is believed
  EXPECT_NEAR(highest({.most_off = 1}), 3.5 - 0.01 * 0.5, 1e-5);
  EXPECT_NEAR(highest({.most_off = 1, .margin = -0.1}), 3.5 + 0.1 * 0.5, 1e-5);
  EXPECT_NEAR(highest({.most_off = 1, .margin = -0.5}), 3.6, 1e-5);
}

// Without eigenvalues vertices lie as near to the surface as with them, on smooth sheets and on
// creases.
TEST(DualMesh, QuickVerticesLieOnTheSurface) {
  const Vec3d ball(3, 3.1, 2.9), corner(4.1, 4.2, 4.3);
  const auto distance = [&](const Vec3d& p) {
    return std::max({length(p - ball) - 2.2, p.x - corner.x, p.y - corner.y, p.z - corner.z});
  };
  const SpaceGrid grid =
      grid_of(14, [&](const Vec3d& p) { return static_cast<float>(distance(p)); });
  CrossedEdges edges = guessed_crossings(grid);
  const DualMesh exact = place_vertices(grid, edges, {}),
                 quick = place_vertices(grid, edges, {.quick = true});
  ASSERT_EQ(quick.position.size(), exact.position.size());
  double of_exact = 0, of_quick = 0;
  std::size_t moved = 0, sharp = 0;
  for (std::size_t v = 0; v < exact.position.size(); ++v) {
    EXPECT_EQ(quick.normal[v], exact.normal[v]);
    const double far = std::abs(distance(exact.position[v])),
                 far_quick = std::abs(distance(quick.position[v]));
    // Where planes meet outside a cell, vertices stay where the way to there leaves it.
    EXPECT_LT(far_quick, far + (exact.sharp[v] ? 0.05 : 0.002));
    of_exact += far * far;
    of_quick += far_quick * far_quick;
    moved += quick.position[v] != exact.position[v];
    sharp += exact.sharp[v];
  }
  EXPECT_LT(of_quick, 1.05 * of_exact);
  EXPECT_GT(moved, 100u);
  EXPECT_GT(sharp, 10u);
}

}  // namespace
}  // namespace meniscus
