// What the triangles' depth map is without triangles, and flaws of samples, on every device. The
// map itself is compared with a loop over all triangles in References.EveryStageIsWithinItsBounds.
#include "stages/sample/region.hpp"

#include "stages/sample/specks.hpp"
#include "stages/stage_test_support.hpp"
#include "verify/stage_cases/into_new.hpp"
#include "verify/stage_cases/mesh_by_hand.hpp"

namespace meniscus {
namespace {

using Region = OnDevice;

TEST_P(Region, NoTrianglesCoverNothing) {
  const SampleGrid grid{9, 5, 0.5f, 1};
  for (const float depth :
       download(device_, draw_triangles(device_, plain_view(), triangulated(place({})), grid,
                                        any_blocks(device_, grid))))
    EXPECT_EQ(depth, kNoSurface);
}

// A tilted plane whose normals turn slowly, with the sample (i, j) at j * nx + i.
SurfaceMap plain(int nx, int ny) {
  SurfaceMap map;
  map.grid = {nx, ny, 0.5f, 1};
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      map.depth.push_back(50 + 0.25f * static_cast<float>(i) - 0.125f * static_cast<float>(j));
      const Vec3d normal = normalized({0.01 * i, -0.01 * j, 1});
      map.normal.push_back(static_cast<Vec3>(normal));
      map.group.push_back(i / 4);
      map.kind.push_back(Kind::surface);
    }
  return map;
}

// Where all particles are large, if nothing else is said.
SurfaceMap closed(Device& device, const SurfaceMap& map, double large_until = INFINITY) {
  const SurfaceBuffers surface = upload(device, map);
  close_specks(device, surface, blocks_of(device, map.grid, true), large_until);
  return download(device, surface);
}

void clear(SurfaceMap& map, int s) {
  map.depth[s] = kNoSurface;
  map.normal[s] = {};
  map.group[s] = -1;
  map.kind[s] = Kind::none;
}

TEST_P(Region, SamplesBetweenTwoLayersGoWhereParticlesAreLarge) {
  // A step of 5 radii; samples of the nearer layer's rim half-way down, one of them the field's.
  SurfaceMap map = plain(37, 23);
  const auto at = [](int i, int j) { return static_cast<std::size_t>(j * 37 + i); };
  for (int j = 0; j < 23; ++j)
    for (int i = 20; i < 37; ++i) map.depth[at(i, j)] += 5;
  const SurfaceMap whole = map;
  for (const int j : {6, 12}) map.depth[at(20, j)] -= 2.5f;
  map.kind[at(20, 12)] = Kind::splash;
  EXPECT_EQ(closed(device_, map, 0).depth, map.depth) << "a droplet may be one sample";
  const SurfaceMap after = closed(device_, map);
  for (std::size_t s = 0; s < map.depth.size(); ++s)
    if (map.depth[s] == whole.depth[s]) {
      EXPECT_EQ(after.depth[s], map.depth[s]) << s;
    } else {  // the mean of five of the farther layer around
      EXPECT_NEAR(after.depth[s], whole.depth[s], 0.3) << s;
      EXPECT_EQ(after.kind[s], Kind::surface);
    }
}

TEST_P(Region, WhatIsWholeStaysAsItIs) {
  SurfaceMap map = plain(37, 23);
  // A silhouette and a hole of 3 x 3 samples are no flaws.
  for (int j = 0; j < 23; ++j)
    for (int i = 20; i < 37; ++i) map.depth[j * 37 + i] += 30;
  for (int j = 5; j < 8; ++j)
    for (int i = 5; i < 8; ++i) {
      map.depth[j * 37 + i] = kNoSurface;
      map.normal[j * 37 + i] = {};
      map.group[j * 37 + i] = -1;
      map.kind[j * 37 + i] = Kind::none;
    }
  for (const double large_until : {static_cast<double>(INFINITY), 0.0}) {
    if (large_until == 0) {  // a droplet of one sample is none, either, of small particles
      map.depth[12 * 37 + 12] = 20;
      map.kind[12 * 37 + 12] = Kind::splash;
    }
    const SurfaceMap after = closed(device_, map, large_until);
    EXPECT_EQ(after.depth, map.depth);
    EXPECT_EQ(after.normal, map.normal);
    EXPECT_EQ(after.group, map.group);
    EXPECT_EQ(after.kind, map.kind);
  }
}

TEST_P(Region, PinholesSpecksAndLoneNormalsTakeTheirNeighboursMean) {
  const SurfaceMap whole = plain(37, 23);
  const int hole = 5 * 37 + 9, twin = 5 * 37 + 10, speck = 11 * 37 + 20, lone = 17 * 37 + 30;
  SurfaceMap flawed = whole;
  for (const int s : {hole, twin}) {
    flawed.depth[s] = kNoSurface;
    flawed.normal[s] = {};
    flawed.group[s] = -1;
    flawed.kind[s] = Kind::none;
  }
  flawed.depth[speck] -= 10;
  flawed.normal[lone] = {0.6f, 0, 0.8f};
  const SurfaceMap after = closed(device_, flawed);
  for (int s = 0; s < 37 * 23; ++s) {
    if (s == hole || s == twin || s == speck || s == lone) {
      // The mean over a whole ring is the plane, but for eight roundings of sums up to 460; the
      // ring of a hole of two lacks one neighbour, which is 0.25 deeper or nearer.
      const double lean = s == hole || s == twin ? 0.25 / 7 : 0;
      EXPECT_NEAR(after.depth[s], whole.depth[s], lean + 460 * kEpsilon) << s;
      // Normals of neighbours differ by 0.015 at most: the mean's angle is below that.
      const double along = dot(Vec3d(after.normal[s]), Vec3d(whole.normal[s]));
      EXPECT_GT(along, 1 - 0.5 * 0.015 * 0.015) << s;
      EXPECT_NEAR(length(Vec3d(after.normal[s])), 1, 4 * FLT_EPSILON) << s;
      EXPECT_EQ(after.kind[s], Kind::surface) << s;
      EXPECT_GE(after.group[s], 0) << s;
    } else {
      EXPECT_EQ(after.depth[s], whole.depth[s]) << s;
      EXPECT_EQ(after.normal[s], whole.normal[s]) << s;
    }
  }
}

TEST_P(Region, PitsOfTwoOrThreeSamplesTakeTheLayerInFront) {
  const SurfaceMap whole = plain(37, 23);
  // Beside, below and diagonally below each other; three at a corner, in a row and as a stair.
  const std::vector<std::vector<std::pair<int, int>>> pits{{{5, 5}, {6, 5}},
                                                           {{12, 5}, {12, 6}},
                                                           {{19, 5}, {20, 6}},
                                                           {{5, 14}, {6, 14}, {5, 15}},
                                                           {{12, 14}, {13, 14}, {14, 14}},
                                                           {{20, 14}, {21, 15}, {22, 16}}};
  SurfaceMap map = whole;
  for (const auto& pit : pits)
    for (const auto& [i, j] : pit) map.depth[j * 37 + i] += 20;
  const SurfaceMap after = closed(device_, map);
  for (int s = 0; s < 37 * 23; ++s)  // the mean of three neighbours or more
    EXPECT_NEAR(after.depth[s], whole.depth[s], map.depth[s] == whole.depth[s] ? 0 : 0.4) << s;
  EXPECT_EQ(closed(device_, map, 0).depth, map.depth) << "what is seen between drops";
}

TEST_P(Region, WhatEndsBehindAnotherLayerIsNoPit) {
  // Two samples of what lies behind, between a layer in front and nothing at all.
  SurfaceMap map = plain(37, 23);
  for (int j = 0; j < 23; ++j)
    for (int i = 20; i < 37; ++i) {
      if (i == 20) map.depth[j * 37 + i] += 20;
      if (i > 20) clear(map, j * 37 + i);
    }
  EXPECT_EQ(closed(device_, map).depth, map.depth);
}

TEST_P(Region, SmallParticlesKeepDropsAndGapsOfAFewSamples) {
  // Particles of the farther layer, on the right, are small.
  SurfaceMap whole = plain(37, 23);
  for (int j = 0; j < 23; ++j)
    for (int i = 17; i < 37; ++i) whole.depth[j * 37 + i] += 20;
  constexpr double kLargeUntil = 60;
  SurfaceMap map = whole;
  const int pinhole = 5 * 37 + 30, twin = 5 * 37 + 31;
  std::vector<int> mended{pinhole, twin}, kept;
  for (const int s : {pinhole, twin}) clear(map, s);
  // The same staircase of six without surface, and drop in front, on both sides.
  const std::pair<int, int> stairs[] = {{0, 0}, {1, 0}, {1, 1}, {2, 1}, {2, 2}, {3, 2}};
  for (const int left : {6, 26}) {
    std::vector<int>& told = left == 6 ? mended : kept;
    for (const auto& [i, j] : stairs) {
      told.push_back((12 + j) * 37 + left + i);
      clear(map, told.back());
    }
    const int drop = 18 * 37 + left;
    for (const int s : {drop, drop + 1}) {
      map.depth[s] -= 8;
      told.push_back(s);
    }
  }
  const SurfaceMap after = closed(device_, map, kLargeUntil);
  for (const int s : mended) EXPECT_NEAR(after.depth[s], whole.depth[s], 0.4) << s;
  for (const int s : kept) EXPECT_EQ(after.depth[s], map.depth[s]) << s;
}

TEST_P(Region, CracksCloseAndTakeTheFartherOfTwoLayers) {
  const SurfaceMap whole = plain(37, 23);
  SurfaceMap cracked = whole;
  for (int i = 20; i < 30; ++i)
    for (int j = 0; j < 23; ++j) cracked.depth[j * 37 + i] += 30;
  const SurfaceMap layers = cracked;
  // Cracks of one sample's width: within the front layer and where it ends to the right and left.
  for (int j = 6; j < 15; ++j)
    for (const int i : {9, 20, 29}) clear(cracked, j * 37 + i);
  const SurfaceMap after = closed(device_, cracked);
  for (int j = 0; j < 23; ++j)
    for (int i = 0; i < 37; ++i) {
      const int s = j * 37 + i;
      if (j < 6 || j >= 15 || (i != 9 && i != 20 && i != 29)) {
        EXPECT_EQ(after.depth[s], layers.depth[s]) << i << " " << j;
        EXPECT_EQ(after.normal[s], layers.normal[s]) << i << " " << j;
        continue;
      }
      // Neighbours on both sides of the first crack have the plane for their mean but at its ends,
      // on the far side of the others they lie one sample to one side; the neighbours above
      // and below are 0.125 nearer and farther, and lack one of them at the ends.
      const double lean = i == 9 ? 0.125 / 7 : 0.25 + 0.125 / 3;
      EXPECT_NEAR(after.depth[s], layers.depth[s], lean + 700 * kEpsilon) << i << " " << j;
      EXPECT_GT(dot(Vec3d(after.normal[s]), Vec3d(whole.normal[s])), 1 - 0.5 * 0.015 * 0.015);
      EXPECT_NEAR(length(Vec3d(after.normal[s])), 1, 4 * FLT_EPSILON);
      EXPECT_EQ(after.kind[s], Kind::surface);
      EXPECT_GE(after.group[s], 0);
    }
}

TEST_P(Region, AStaircaseOfSixClosesFromItsEndsInThreeRounds) {
  const SurfaceMap whole = plain(37, 23);
  SurfaceMap holed = whole;
  const std::pair<int, int> stairs[] = {{9, 5}, {10, 5}, {10, 6}, {11, 6}, {11, 7}, {12, 7}};
  for (const auto& [i, j] : stairs) clear(holed, j * 37 + i);
  const SurfaceMap after = closed(device_, holed);
  for (int s = 0; s < 37 * 23; ++s) {
    // Two neighbours of eight are missing, each at most 0.375 off, and in later rounds the others
    // are off by as much as those before.
    EXPECT_NEAR(after.depth[s], whole.depth[s], holed.depth[s] < kNoSurface ? 0 : 3 * 0.375 * 2 / 6)
        << s;
  }
}

TEST_P(Region, WhatHangsTogetherWithFewerThanThreeAtTheOutlineGoes) {
  SurfaceMap map = plain(37, 23);
  for (int j = 0; j < 23; ++j)
    for (int i = 20; i < 37; ++i) clear(map, j * 37 + i);
  const SurfaceMap straight = map, whole = plain(37, 23);
  const auto show = [&](SurfaceMap& on, int i, int j, Kind kind) {
    const int s = j * 37 + i;
    on.depth[s] = whole.depth[s];
    on.normal[s] = whole.normal[s];
    on.group[s] = whole.group[s];
    on.kind[s] = kind;
  };
  SurfaceMap expected = straight;
  // One, two and three alone, and the far one of two that stand out; the near one has three
  // neighbours.
  for (const auto& [i, j] :
       {std::pair{30, 3}, {30, 8}, {31, 8}, {25, 10}, {26, 10}, {25, 11}, {21, 14}})
    show(map, i, j, Kind::surface);
  for (SurfaceMap* both : {&map, &expected}) show(*both, 20, 14, Kind::surface);
  show(map, 30, 18, Kind::splash);
  // One that hangs together with nothing around it though it is surrounded by five takes their
  // place.
  const int loose = 20 + 37 * 5;
  map.depth[loose - 1] -= 10;
  const SurfaceMap after = closed(device_, map);
  for (int s = 0; s < 37 * 23; ++s) {
    if (s == loose - 1) {
      // The mean of five neighbours, three to the left and one each above and below: 3/5 of a
      // sample's 0.25 from the plane.
      EXPECT_NEAR(after.depth[s], whole.depth[s] - 0.15, 250 * kEpsilon);
      continue;
    }
    EXPECT_EQ(after.depth[s], expected.depth[s]) << s;
    EXPECT_EQ(after.kind[s], expected.kind[s]) << s;
    EXPECT_EQ(after.group[s], expected.group[s]) << s;
  }
}

MENISCUS_ON_EVERY_DEVICE(Region);

}  // namespace
}  // namespace meniscus
