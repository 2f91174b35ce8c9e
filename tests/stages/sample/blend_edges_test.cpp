// Where sheets meet: creases, corners of three faces, and hidden faces that end the surface, on
// planes whose answer is exact.
#include <algorithm>
#include <cmath>
#include <functional>

#include "stages/sample/blend_test_support.hpp"

namespace meniscus {
namespace {

using BlendEdges = OnDevice;

// Two faces of a box, whose edge is the line x = 0 at depth 20, with fits two radii apart on both.
void expect_crease(Device& device, double tilt, bool convex) {
  const View view = frontal_view(37, 21);
  const Vec3d left = normalized({convex ? -tilt : tilt, 0, 1}),
              right = normalized({convex ? tilt : -tilt, 0, 1});
  const Vec3d line{0, 0, -20};
  Scene scene;
  for (int j = -3; j <= 3; ++j)
    for (int i = 0; i < 4; ++i) {
      const Vec3d along = line + Vec3d{0, 2.0 * j, 0};
      scene.add(along + normalized(cross(left, {0, 1, 0})) * (1 + 2.0 * i), left);
      scene.add(along - normalized(cross(right, {0, 1, 0})) * (1 + 2.0 * i), right);
    }
  ASSERT_LT(scene.fits.foot[0].x, 0);
  const Samples samples = blended(device, view, kGrids[0], scene, 20);
  std::size_t count = 0;
  for_each(samples, [&](double depth, const Vec3d& n, double u, double v) {
    const double a = plane_depth(view, line, left, u, v);
    const double b = plane_depth(view, line, right, u, v);
    const Vec3d at = point_at(view, u, v, depth);
    if (std::abs(at.x) > 3 || std::abs(at.y) > 5) return;
    ++count;
    EXPECT_NEAR(depth, convex ? std::max(a, b) : std::min(a, b), kDepthError);
    if (std::abs(a - b) < 2 * kDepthError) return;
    EXPECT_NEAR(length(n - ((a > b) == convex ? left : right)), 0, kNormalError);
  });
  EXPECT_GT(count, 40u);
  // Samples beside a convex edge are marked: the density is low there.
  std::size_t marked = 0, beside = 0;
  for (std::size_t s = 0; s < samples.map.grid.size(); ++s) {
    if (!(samples.map.depth[s] < kNoSurface)) continue;
    const Vec3d at = point_at(view, u_of(kGrids[0], s), v_of(kGrids[0], s), samples.map.depth[s]);
    if (std::abs(at.x) > 0.5 || std::abs(at.y) > 5) continue;
    ++beside;
    marked += samples.on_edge[s];
  }
  EXPECT_GT(beside, 5u);
  EXPECT_EQ(marked, convex ? beside : 0);
}

TEST_P(BlendEdges, AConvexCreaseTakesTheFartherSheet) { expect_crease(device_, 1, true); }
TEST_P(BlendEdges, AConcaveCreaseTakesTheNearerSheet) { expect_crease(device_, 1, false); }

// The front face x < 3 of a box at depth 20, whose side x = 3 faces away from the eye: only hidden
// particles tell of it.
Scene face_and_side(bool with_side) {
  Scene scene;
  for (int j = -4; j <= 2; ++j)
    for (int i = 0; i < 4; ++i) {
      scene.add({2 - 2.0 * i, 2.0 * j, -20}, {0, 0, 1});
      if (with_side) scene.add({3, 2.0 * j, -21 - 2.0 * i}, {1, 0, 0}, 0);
    }
  return scene;
}

TEST_P(BlendEdges, AFaceEndsWhereItsHiddenNeighbourBegins) {
  const View view =
      frontal_view(40, 40);  // a pixel is one radius at depth 20, x = 3 lies at u = 23
  const SampleGrid grid{201, 201, 22, 0.01f};
  const Samples samples = blended(device_, view, grid, face_and_side(true), 20);
  for (std::size_t s = 0; s < grid.size(); ++s) {
    ASSERT_NEAR(samples.map.depth[s], 20, kDepthError);
    const double x = point_at(view, u_of(grid, s), v_of(grid, s), 20).x;
    // A hundredth of a radius is a pixel of this grid.
    if (std::abs(x - 3) > 0.01) {
      ASSERT_EQ(samples.ended[s], x > 3) << x;
      ASSERT_EQ(samples.on_edge[s], x < 3) << x;
    }
  }
  // A face beside which no hidden sheet is known ends where its fits do.
  const Samples alone = blended(device_, view, grid, face_and_side(false), 20);
  EXPECT_EQ(std::count(alone.ended.begin(), alone.ended.end(), true), 0);
  EXPECT_EQ(std::count(alone.on_edge.begin(), alone.on_edge.end(), true), 0);
  // Nor does one that a hidden sheet behind it does not touch.
  Scene apart = face_and_side(false);
  for (int j = -4; j <= 2; ++j) apart.add({3, 2.0 * j, -27}, {1, 0, 0}, 0);
  const Samples free = blended(device_, view, grid, apart, 20);
  EXPECT_EQ(std::count(free.ended.begin(), free.ended.end(), true), 0);
  EXPECT_EQ(std::count(free.on_edge.begin(), free.on_edge.end(), true), 0);
}

// The same face beside one that rays meet at a cosine of about `facing`, beyond the reach of its
// fits.
TEST_P(BlendEdges, ASteepFaceVouchesForItsNeighbourAndEndsNothing) {
  const View view = frontal_view(40, 40);
  const SampleGrid grid{201, 201, 22, 0.01f};
  const auto with_side = [&](double facing) {
    const Vec3d normal{std::sqrt(1 - facing * facing), 0, facing}, down{facing, 0, -normal.x};
    Scene scene = face_and_side(false);
    for (int j = -4; j <= 2; ++j)
      for (int i = 0; i < 4; ++i)
        scene.add(Vec3d{3, 2.0 * j, -20} + down * (1 + 2.0 * i), normal, 0);
    return blended(device_, view, grid, scene, 20);
  };
  const Samples steep = with_side(0.3);
  for (std::size_t s = 0; s < grid.size(); ++s) {
    ASSERT_FALSE(steep.ended[s]);
    const double x = point_at(view, u_of(grid, s), v_of(grid, s), 20).x;
    if (std::abs(x - 3) > 0.01) {
      ASSERT_EQ(steep.on_edge[s], x < 3) << x;
    }
  }
  const Samples flat = with_side(0.7);
  EXPECT_EQ(std::count(flat.on_edge.begin(), flat.on_edge.end(), true), 0);
}

// Where two faces meet at x = 0, and a third face at y = 0 as `third` says: fits two radii apart on
// each of the three planes through (0, 0, -20), as far as that plane is of the surface.
struct Corner {
  Vec3d normal[3];
  // Whether a point is within the fluid, by how far it lies over each of the planes.
  std::function<bool(double, double, double)> holds;
};

// The depth at which a ray enters what a corner holds: from one plane to the next.
double corner_depth(const View& view, const Corner& corner, double u, double v, int* plane) {
  const Vec3d tip{0, 0, -20};
  double depth = kNoSurface;
  for (int k = 0; k < 3; ++k) {
    const double t = plane_depth(view, tip, corner.normal[k], u, v);
    const auto within = [&](double at) {
      const Vec3d x = point_at(view, u, v, at) - tip;
      return corner.holds(dot(x, corner.normal[0]), dot(x, corner.normal[1]),
                          dot(x, corner.normal[2]));
    };
    if (!within(t - 1e-6) && within(t + 1e-6) && t < depth) {
      depth = t;
      *plane = k;
    }
  }
  return depth;
}

// Samples around the tip, whose answer is exact where all three faces have fits near.
void expect_corner(Device& device, const Corner& corner) {
  const View view = frontal_view(40, 40);  // a pixel is one radius at depth 20
  const Vec3d tip{0, 0, -20};
  Scene scene;
  for (int k = 0; k < 3; ++k) {
    const Vec3d n = corner.normal[k], across = normalized(cross(n, {0.3, 1, 0.1})),
                along = cross(n, across);
    for (int j = -6; j <= 6; ++j)
      for (int i = -6; i <= 6; ++i) {
        const Vec3d foot = tip + across * (1.0 * i + 0.3) + along * (1.0 * j + 0.2);
        const Vec3d x = foot - tip;
        double over[3];
        for (int m = 0; m < 3; ++m) over[m] = m == k ? 0 : dot(x, corner.normal[m]);
        over[k] = -1e-9;
        const bool below = corner.holds(over[0], over[1], over[2]);
        over[k] = 1e-9;
        if (below && !corner.holds(over[0], over[1], over[2])) scene.add(foot, n);
      }
  }
  const SampleGrid grid{31, 31, 17, 0.2f};
  const Samples samples = blended(device, view, grid, scene, 20);
  std::size_t count = 0, exact = 0, planes[3] = {0, 0, 0};
  for_each(samples, [&](double depth, const Vec3d& n, double u, double v) {
    int plane = 0;
    const double expected = corner_depth(view, corner, u, v, &plane);
    if (length(point_at(view, u, v, expected) - tip) > 2) return;
    ++count;
    ++planes[plane];
    EXPECT_NEAR(depth, expected, 0.1) << u << " " << v;
    double nearest = 1;  // of the other planes
    for (int k = 0; k < 3; ++k)
      if (k != plane)
        nearest =
            std::min(nearest, std::abs(plane_depth(view, tip, corner.normal[k], u, v) - expected));
    exact += std::abs(depth - expected) < kDepthError &&
             (nearest < 2 * kDepthError || length(n - corner.normal[plane]) < kNormalError);
  });
  EXPECT_GT(count, 100U);
  for (int k = 0; k < 3; ++k) {
    if (corner.normal[k].z > 0.3) {
      EXPECT_GT(planes[k], 20U);
    }
  }
  // A sheet of .3 to 2 % of the weights counts in part.
  EXPECT_GT(exact, count * 95 / 100) << "of " << count;
}

// Three faces that all turn by 55 degrees from the eye.
const Vec3d kThreeWays[] = {normalized({1, 0, 0.7}), normalized({-0.5, 0.866, 0.7}),
                            normalized({-0.5, -0.866, 0.7})};

TEST_P(BlendEdges, ThreeFacesMeetInATip) {
  expect_corner(device_, {{kThreeWays[0], kThreeWays[1], kThreeWays[2]},
                          [](double a, double b, double c) { return a < 0 && b < 0 && c < 0; }});
}

TEST_P(BlendEdges, ThreeFacesMeetInAPit) {
  expect_corner(device_, {{-1 * kThreeWays[0] + Vec3d{0, 0, 2 * kThreeWays[0].z},
                           -1 * kThreeWays[1] + Vec3d{0, 0, 2 * kThreeWays[1].z},
                           -1 * kThreeWays[2] + Vec3d{0, 0, 2 * kThreeWays[2].z}},
                          [](double a, double b, double c) { return a < 0 || b < 0 || c < 0; }});
}

// As where a notch in a block reaches its face: two edges are convex and one is concave.
TEST_P(BlendEdges, TwoFacesOfANotchEndAtAThird) {
  expect_corner(device_,
                {{normalized({0, -0.5, 1}), normalized({0.8, 0.6, 1}), normalized({-0.8, 0.6, 1})},
                 [](double a, double b, double c) { return a < 0 && (b < 0 || c < 0); }});
}

// As at the end of a step's inner edge, where the riser turns away from the eye. No ray meets it,
// but it holds the wall beside it, which the tread alone would end.
TEST_P(BlendEdges, AHiddenFaceHoldsTheNearerOfTwo) {
  for (const double facing : {0.0, -0.1, -0.2})
    expect_corner(device_,
                  {{normalized({0, -0.3, 1}), normalized({0, 1, 0.8}), normalized({-1, 0, facing})},
                   [](double a, double b, double c) { return a < 0 && (b < 0 || c < 0); }});
}

// A bevel between two hidden faces, which its neighbours hardly agree with, would cut off what both
// hold.
TEST_P(BlendEdges, ABevelEndsNothingThatHiddenFacesHold) {
  const View view = frontal_view(40, 40);
  const SampleGrid grid{101, 101, 20, 0.03f};
  const auto ended = [&](double edge_of_bevel) {
    Scene scene = face_and_side(false);
    for (int j = -4; j <= 2; ++j) scene.add({3, 2.0 * j, -23.7}, {1, 0, 0}, 0);
    scene.add({2, 0, -22}, {1, 0, 0}, 0);  // a radius within the side
    scene.fits.edge.back() = edge_of_bevel;
    const Samples samples = blended(device_, view, grid, scene, 20);
    std::size_t within = 0;
    for (std::size_t s = 0; s < grid.size(); ++s)
      within += samples.ended[s] && point_at(view, u_of(grid, s), v_of(grid, s), 20).x < 2.9;
    return within;
  };
  EXPECT_GT(ended(1), 100U);
  EXPECT_EQ(ended(0.005), 0U);
}

MENISCUS_ON_EVERY_DEVICE(BlendEdges);

}  // namespace
}  // namespace meniscus
