// The faces beside edges, of fits made by hand.
#include "stages/fit/faces.hpp"

#include <gtest/gtest.h>

namespace meniscus {
namespace {

// A plane through `through`, whose surface is its level one particle radius outside.
void add_plane(ParticleFits& fits, const Vec3d& at, const Vec3d& normal, const Vec3d& through,
               double edge) {
  fits.position.push_back(at);
  fits.foot.push_back(at + normal);
  fits.normal.push_back(normal);
  fits.quadric.push_back({static_cast<float>(dot(normal, at - through) - 1),
                          static_cast<float>(normal.x), static_cast<float>(normal.y),
                          static_cast<float>(normal.z)});
  fits.visible.push_back(0.5);
  fits.surface.push_back(1);
  fits.support.push_back(10);
  fits.roundness.push_back(0);
  fits.edge.push_back(edge);
  fits.firmness.push_back(edge);
  fits.spread.push_back(edge < 0.1 ? 0.7 : 0.05);
  fits.residual.push_back(0.1f);
}

// A bevel where a face across x and one across y meet, and a face that passes it by. The faces'
// fits lie within them.
ParticleFits edge_of_block(double edge_of_bevel) {
  const Vec3d x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1}, origin;
  ParticleFits fits;
  add_plane(fits, origin, normalized(x + y), origin, edge_of_bevel);
  fits.visible[0] = 0.25;
  add_plane(fits, y * -2, x, origin, 0.6);
  add_plane(fits, y * -3, x, origin, 0.8);  // the same face, farther away
  add_plane(fits, x * -2.5, y, origin, 0.6);
  add_plane(fits, z * -1, z, z * -1, 0.6);
  add_plane(fits, z * -6, normalized(x - z), origin, 0.6);  // out of reach
  // passes where the bevel's surface would be, but faces another way than the edge
  add_plane(fits, z * -2.2, normalized(z * 2 - x - y), origin, 0.6);
  return fits;
}

TEST(FacesBesideEdges, AreTheNearestOfEachDirectionOnWhichTheBevelLies) {
  const ParticleFits fits = edge_of_block(0.0005);
  const auto [faces, trust] = faces_beside_edges(fits, {1, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4}, 1);
  ASSERT_EQ(faces.size(), 2U);
  EXPECT_EQ(trust, (std::vector<double>{0.9, 0.7}));
  for (const std::size_t k : {0, 1}) {
    const Vec3d normal = k == 0 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
    EXPECT_EQ(length(faces.position[k]), 0);
    EXPECT_LT(length(faces.foot[k] - normal), 1e-6);
    EXPECT_LT(length(faces.normal[k] - normal), 1e-6);
    EXPECT_EQ(faces.visible[k], 0.25);
    EXPECT_EQ(faces.edge[k], 0.6);
  }
}

// However little the value of its quadric is at the bevel, where it is hardly steep.
TEST(FacesBesideEdges, PassNearTheBevel) {
  ParticleFits fits = edge_of_block(0.0005);
  for (float& value : fits.quadric[1]) value /= 2;
  fits.quadric[1][0] = -1;  // it is 0 two particle radii before the bevel's particle
  const auto [faces, trust] = faces_beside_edges(fits, {1, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4}, 1);
  ASSERT_EQ(faces.size(), 2U);
  EXPECT_EQ(trust, (std::vector<double>{0.7, 0.8}));
}

TEST(FacesBesideEdges, CountAsFarAsThereIsAnEdge) {
  const std::vector<double> trust(7, 1.0);
  const auto beside = [&](double edge) {
    ParticleFits fits = edge_of_block(edge);
    fits.spread[0] = 0.7;  // a bevel, however many agree with it
    return faces_beside_edges(fits, trust, 1).fits;
  };
  const ParticleFits half = beside(0.45);
  ASSERT_EQ(half.size(), 2U);
  EXPECT_NEAR(half.edge[0], 0.3, 1e-12);
  EXPECT_EQ(beside(0.6).size(), 0U);
}

// A face that looks much as the fit does is the one that it follows, unless it is a bevel.
TEST(FacesBesideEdges, OfTheFitsOwnDirectionCountAsFarAsItIsABevel) {
  const auto beside = [](double edge) {
    const Vec3d origin, normal = normalized({0.3, 0, 1});
    ParticleFits fits;
    add_plane(fits, origin, {0, 0, 1}, origin, edge);
    add_plane(fits, cross(normal, {0, 1, 0}) * 2, normal, origin, 0.6);
    const TrustedFits faces = faces_beside_edges(fits, {1, 1}, 1);
    return faces.fits.size() == 0 ? 0 : faces.fits.edge[0];
  };
  EXPECT_NEAR(beside(0.01), 0.6, 1e-12);
  EXPECT_NEAR(beside(0.02), 0.3, 1e-12);
  EXPECT_EQ(beside(0.03), 0);
}

// A particle in the corner of three faces, whose fit follows the first of them.
ParticleFits corner_of_block(double edge) {
  const Vec3d x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1}, origin;
  ParticleFits fits;
  add_plane(fits, origin, x, origin, edge);
  fits.spread[0] = 0.1;
  add_plane(fits, y * -2 + z * -2, x, origin, 0.6);
  add_plane(fits, x * -2 + z * -2, y, origin, 0.7);
  add_plane(fits, x * -2 + y * -2, z, origin, 0.8);
  return fits;
}

TEST(FacesBesideEdges, StandInBesideAFitThatFollowsOneFaceOfACorner) {
  const std::vector<double> trust(4, 1.0);
  const TrustedFits faces = faces_beside_edges(corner_of_block(0.2), trust, 1);
  ASSERT_EQ(faces.fits.size(), 2U);
  EXPECT_LT(length(faces.fits.normal[0] + faces.fits.normal[1] - Vec3d{0, 1, 1}), 1e-6);
  EXPECT_NEAR(faces.fits.edge[0] + faces.fits.edge[1], 1.5, 1e-12);
  for (const Vec3d& at : faces.fits.position) EXPECT_EQ(length(at), 0);
  const TrustedFits half = faces_beside_edges(corner_of_block(0.45), trust, 1);
  ASSERT_EQ(half.fits.size(), 2U);
  EXPECT_NEAR(half.fits.edge[0] + half.fits.edge[1], 0.75, 1e-12);
  EXPECT_EQ(faces_beside_edges(corner_of_block(0.6), trust, 1).fits.size(), 0U);
}

TEST(FacesBesideEdges, AreNotWhereTheFluidIsRound) {
  ParticleFits round = edge_of_block(0.0005);
  round.roundness[0] = 1;
  EXPECT_EQ(faces_beside_edges(round, std::vector<double>(7, 1.0), 1).fits.size(), 0U);
}

TEST(FacesBesideEdges, AreNotOfGroups) {
  ParticleFits groups = edge_of_block(0.0005);
  groups.extent.assign(groups.size(), 1.0);
  EXPECT_EQ(faces_beside_edges(groups, std::vector<double>(7, 1.0), 1).fits.size(), 0U);
}

}  // namespace
}  // namespace meniscus
