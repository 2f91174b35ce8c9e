// Groups of particles on surfaces that are known: who is in which, and what they do not depend on.
#include "stages/sheet/merge.hpp"

#include <algorithm>
#include <cmath>

#include "stages/stage_test_support.hpp"
#include "verify/stage_cases/mesh_by_hand.hpp"

namespace meniscus {
namespace {

// Surface particles two radii apart, moved by a tenth of that, with their true normals.
struct Sheets {
  std::vector<Vec3d> uvt;     // screen position and depth, as place() takes them
  std::vector<Vec3d> normal;  // eye space
  std::vector<float> owned;

  // A square with corner `at` and sides along a and b, side x side particles.
  void add(const Vec3d& at, const Vec3d& a, const Vec3d& b, int side, float share, Random& random) {
    const Vec3d up = cross({b.x, -b.y, -b.z}, {a.x, -a.y, -a.z});
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i) {
        const Vec3d off{random(-0.1, 0.1), random(-0.1, 0.1), random(-0.1, 0.1)};
        uvt.push_back(at + a * (2.0 * i) + b * (2.0 * j) + off * 2);
        normal.push_back(up);
        owned.push_back(share);
      }
  }
};

struct Placed {
  Projected projected;
  Visible rim;
  SurfaceParticles around;
};

Placed placed(const Sheets& sheets) {
  Placed p{place(sheets.uvt), {}, {}};
  for (std::size_t i = 0; i < sheets.uvt.size(); ++i) {
    p.rim.index.push_back(static_cast<std::int32_t>(i));
    p.rim.owned.push_back(sheets.owned[i]);
    p.around.index.push_back(static_cast<std::int32_t>(i));
    p.around.weight.push_back(1);
    p.around.normal.push_back(sheets.normal[i]);
  }
  return p;
}

MergedGroups merged(const View& view, const Placed& p, const MergeParams& params) {
  return merge_particles(view, p.projected, p.rim, p.around,
                         list_near(p.projected, p.rim.index, p.around.index, merge_reach(params)),
                         params);
}

// A level face and one that falls off from its edge, at 90 degrees.
Sheets two_faces(float share = 0.3f) {
  Random random(5);
  Sheets sheets;
  sheets.add({10, 10, 30}, {1, 0, 0}, {0, 1, 0}, 20, share, random);
  sheets.add({50, 10, 32}, {0, 0, 1}, {0, 1, 0}, 20, share, random);
  return sheets;
}

// Whether a group of the particle's own sheet holds it.
bool stands_for(const Placed& p, const MergedGroups& groups, std::size_t k) {
  const Vec3d at = p.projected.eye(k);
  for (std::size_t g = 0; g < groups.extent.size(); ++g) {
    const std::size_t seed = static_cast<std::size_t>(groups.seed.index[g]);
    if (length(p.projected.eye(seed) - at) <= groups.extent[g] &&
        dot(p.around.normal[seed], p.around.normal[k]) > 0.7)
      return true;
  }
  return false;
}

TEST(Merge, EveryParticleIsInAGroupOfItsOwnSheet) {
  const Placed p = placed(two_faces());
  const MergedGroups groups = merged(plain_view(), p, {});
  ASSERT_TRUE(std::is_sorted(groups.seed.index.begin(), groups.seed.index.end()));
  for (std::size_t k = 0; k < p.rim.index.size(); ++k)
    EXPECT_TRUE(stands_for(p, groups, k)) << "particle " << k;
}

TEST(Merge, CalmWaterHasFewGroupsAndSmallReachesManyMore) {
  Random random(5);
  Sheets sheets;
  sheets.add({10, 10, 30}, {1, 0, 0}, {0, 1, 0}, 30, 0.3f, random);
  const Placed p = placed(sheets);
  MergeParams params;
  params.reach = 5;
  const MergedGroups calm = merged(plain_view(), p, params);
  EXPECT_LT(calm.extent.size(), 900u / 4);
  EXPECT_GT(calm.extent.size(), 900u / 30);
  for (const double extent : calm.extent) EXPECT_FLOAT_EQ(static_cast<float>(extent), 5);
  // Nearer than any two particles: nothing merges.
  params.reach = params.least_reach = 1;
  const MergedGroups alone = merged(plain_view(), p, params);
  EXPECT_EQ(alone.seed.index, p.rim.index);
  EXPECT_EQ(alone.seed.influence, std::vector<float>(900, 1.0f));
}

// The other face of an edge is another sheet: each face is calm up to it.
TEST(Merge, FlatFacesAreCalmUpToTheirEdge) {
  const Placed p = placed(two_faces());
  MergeParams params;
  params.reach = 5;
  params.least_reach = 2.5;
  const MergedGroups groups = merged(plain_view(), p, params);
  ASSERT_FALSE(groups.extent.empty());
  for (const double extent : groups.extent) EXPECT_FLOAT_EQ(static_cast<float>(extent), 5);
}

// Half a tube of radius 6: weighted as b is, 1 - n.n' is .04 in the mean.
TEST(Merge, GroupsAreSmallWhereTheSurfaceBends) {
  Sheets tube;
  for (int j = 0; j < 20; ++j)
    for (int i = 0; i <= 9; ++i) {
      const double angle = M_PI * (i / 9.0 - 0.5);
      tube.uvt.push_back({40 + 6 * std::sin(angle), 10 + 2.0 * j, 40 - 6 * std::cos(angle)});
      tube.normal.push_back({std::sin(angle), 0, std::cos(angle)});
      tube.owned.push_back(0.3f);
    }
  const Placed p = placed(tube);
  MergeParams params;
  params.reach = 5;
  params.least_reach = 2.5;
  const MergedGroups groups = merged(plain_view(), p, params);
  ASSERT_FALSE(groups.extent.empty());
  for (const double extent : groups.extent) EXPECT_LT(extent, 2.6);
}

TEST(Merge, AGroupIsSeenAsFarAsItsMembersAre) {
  Sheets sheets = two_faces(0);
  sheets.owned[205] = 0.5f;
  const Placed p = placed(sheets);
  const MergedGroups groups = merged(plain_view(), p, {});
  const Vec3d at = p.projected.eye(205);
  float most = 0;
  for (std::size_t g = 0; g < groups.extent.size(); ++g) {
    const Vec3d seed = p.projected.eye(static_cast<std::size_t>(groups.seed.index[g]));
    if (length(seed - at) >= groups.extent[g]) {
      EXPECT_EQ(groups.seed.owned[g], 0);
    }
    most = std::max(most, groups.seed.owned[g]);
  }
  EXPECT_FLOAT_EQ(most, 0.5f);
}

// What hardly tells anything stands for nobody but itself, and its group counts as little.
TEST(Merge, GroupsFadeWithWhatTheirSeedsTell) {
  Placed p = placed(two_faces());
  const MergedGroups all = merged(plain_view(), p, {});
  p.rim.influence.assign(p.rim.index.size(), 0.25f);
  const MergedGroups faint = merged(plain_view(), p, {});
  EXPECT_GT(faint.seed.index.size(), all.seed.index.size());
  for (const float influence : faint.seed.influence) EXPECT_LE(influence, 0.25f);
  p.rim.influence.assign(p.rim.index.size(), 0.0f);
  EXPECT_TRUE(merged(plain_view(), p, {}).seed.index.empty());
}

// A camera that moves keeps the groups: eye coordinates change, places in the world do not.
TEST(Merge, GroupsDoNotDependOnTheCamera) {
  const Placed p = placed(two_faces());
  const View view = plain_view();
  const MergedGroups expected = merged(view, p, {});
  View turned = view;  // by a rotation about the eye's z axis, and shifted
  const double c = std::cos(0.7), s = std::sin(0.7);
  const auto rotate = [&](const Vec3d& v) {
    return Vec3d{c * v.x - s * v.y, s * v.x + c * v.y, v.z};
  };
  const auto& m = view.rotation;
  turned.rotation = {c * m[0] - s * m[3],
                     c * m[1] - s * m[4],
                     c * m[2] - s * m[5],
                     s * m[0] + c * m[3],
                     s * m[1] + c * m[4],
                     s * m[2] + c * m[5],
                     m[6],
                     m[7],
                     m[8]};
  const Vec3d step{3, -2, 1};
  turned.shift = rotate(view.shift) + step;
  Placed other = p;
  for (std::size_t i = 0; i < p.projected.size(); ++i) {
    const Vec3d at = rotate(p.projected.eye(i)) + step;
    other.projected.x[i] = static_cast<float>(at.x);
    other.projected.y[i] = static_cast<float>(at.y);
    other.projected.z[i] = static_cast<float>(at.z);
    other.around.normal[i] = rotate(p.around.normal[i]);
  }
  const MergedGroups groups = merged(turned, other, {});
  ASSERT_EQ(groups.seed.index, expected.seed.index);
  // Coordinates round at 1e-5; smoothsteps over .02 of a rank are the steepest.
  for (std::size_t g = 0; g < groups.seed.influence.size(); ++g) {
    EXPECT_NEAR(groups.seed.influence[g], expected.seed.influence[g], 0.02);
    EXPECT_NEAR(groups.extent[g], expected.extent[g], 1e-3);
  }
}

// A group that is about to be taken in fades: shares go steadily with the particles.
TEST(Merge, SmallMotionsChangeSharesLittle) {
  const Placed p = placed(two_faces());
  const auto shares = [&](double step) {
    Placed moved = p;
    for (float& x : moved.projected.x) x += static_cast<float>(step);
    const MergedGroups groups = merged(plain_view(), moved, {});
    std::vector<double> share(p.rim.index.size(), 0.0);
    for (std::size_t g = 0; g < groups.seed.influence.size(); ++g)
      share[static_cast<std::size_t>(groups.seed.index[g])] = groups.seed.influence[g];
    return share;
  };
  // Over 1e-4 radii ranks change by 3e-4 against each other, takings by 1.5 / .04 times that, and a
  // chain of a few takings by a few times that. A jump would be one of up to 1.
  const auto largest_change = [&](double step, int steps) {
    double most = 0;
    std::vector<double> before = shares(0);
    for (int k = 1; k <= steps; ++k) {
      const std::vector<double> now = shares(k * step);
      for (std::size_t i = 0; i < now.size(); ++i)
        most = std::max(most, std::abs(now[i] - before[i]));
      before = now;
    }
    return most;
  };
  EXPECT_LT(largest_change(1e-4, 200), 0.1);
}

TEST(Merge, NothingMergesToNothing) {
  const MergedGroups groups = merge_particles(plain_view(), place({}), {}, {}, {}, {});
  EXPECT_TRUE(groups.seed.index.empty());
  EXPECT_TRUE(groups.seed.influence.empty());
}

}  // namespace
}  // namespace meniscus
