// The blend against plain loops in double precision, and on surfaces whose answer is exact, on
// every device and in every vector width.
#include "verify/reference/blend.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "stages/orthographic_view.hpp"
#include "stages/sample/blend_test_support.hpp"

namespace meniscus {
namespace {

using Blend = OnDevice;

TEST_P(Blend, MatchesTheReferenceOnACrowdOfFits) {
  std::size_t compared = 0, skipped = 0, crowded = 0, on_edge = 0, ended = 0, partly = 0;
  for (const unsigned seed : {1u, 2u, 3u}) {
    const View view =
        seed == 3 ? orthographic_view(37, 21, {0.07, 0.12, -0.01}) : frontal_view(37, 21);
    const Scene scene = crowd(seed);
    Random random(seed + 10);
    std::vector<ParticleFits> others;
    for (int k = 0; k < 6; ++k) others.push_back(rounded(scene, random).fits);
    const SampleGrid& grid = kGrids[0];
    std::vector<float> reference(grid.size());
    for (float& t : reference) t = static_cast<float>(random(19, 21));
    for (std::size_t s = 0; s < reference.size(); s += 9) reference[s] = kNoSurface;
    const Samples actual = blended(device_, view, grid, scene, reference);
    for (std::size_t s = 0; s < grid.size(); ++s) {
      SCOPED_TRACE("seed " + std::to_string(seed) + " sample " + std::to_string(s));
      if (!(reference[s] < kNoSurface)) {
        EXPECT_EQ(actual.map.depth[s], kNoSurface);
        continue;
      }
      const reference::BoundedBlend bounded =
          reference::bounded_blend(scene.fits, scene.trust, others, view, u_of(grid, s),
                                   v_of(grid, s), reference[s], kFit, kBlend);
      const reference::Blended& expected = bounded.expected;
      if (!bounded.sure) {
        ++skipped;
        continue;
      }
      if (expected.hits == 0) {
        EXPECT_EQ(actual.map.depth[s], kNoSurface);
        EXPECT_EQ(actual.map.group[s], -1);
        continue;
      }
      ++compared;
      crowded += expected.hits > 48;
      on_edge += expected.on_edge && !expected.ended;
      ended += expected.ended;
      partly += expected.trust < 0.95;
      EXPECT_NEAR(actual.map.depth[s], expected.depth, bounded.depth_error);
      EXPECT_NEAR(length(Vec3d(actual.map.normal[s]) - expected.normal), 0, bounded.normal_error);
      EXPECT_NEAR(actual.trust[s], expected.trust, bounded.trust_error);
      EXPECT_EQ(actual.ended[s], expected.ended);
      EXPECT_EQ(actual.on_edge[s], expected.on_edge && !expected.ended);
    }
  }
  EXPECT_GT(crowded, 20u);
  EXPECT_GT(on_edge, 20u);
  EXPECT_GT(ended, 20u);
  EXPECT_GT(partly, 20u);
  EXPECT_LT(20 * skipped, compared) << "of " << compared;
}

TEST_P(Blend, APlaneStaysAPlane) {
  const View view = frontal_view(37, 21);
  const Vec3d foot{-2, -3, -20}, normal = normalized({0.3, 0.4, 1});
  Scene scene;
  scene.add(foot, normal);
  for (const SampleGrid& grid : kGrids) {
    const std::size_t count =
        for_each(blended(device_, view, grid, scene, 20.5f),
                 [&](double depth, const Vec3d& n, double u, double v) {
                   EXPECT_NEAR(depth, plane_depth(view, foot, normal, u, v), kDepthError);
                   if (near_a_fit(view, scene, u, v, depth)) {
                     EXPECT_NEAR(length(n - normal), 0, kNormalError);
                   }
                 });
    EXPECT_GT(count, 0u);
  }
}

TEST_P(Blend, FitsOnOnePlaneBlendIntoIt) {
  const View view = frontal_view(37, 21);
  const Vec3d normal = normalized({-0.2, 0.3, 1});
  const Vec3d side = normalized(cross(normal, {0, 1, 0}));
  Scene scene;
  const Vec3d foot{0, 0, -20};
  for (int k = -2; k <= 2; ++k) scene.add(foot + side * (3.0 * k), normal);
  const Samples samples = blended(device_, view, kGrids[0], scene, 20);
  const std::size_t count =
      for_each(samples, [&](double depth, const Vec3d& n, double u, double v) {
        EXPECT_NEAR(depth, plane_depth(view, foot, normal, u, v), kDepthError);
        if (near_a_fit(view, scene, u, v, depth)) {
          EXPECT_NEAR(length(n - normal), 0, kNormalError);
        }
      });
  EXPECT_GT(count, 110u);
  for (std::size_t s = 0; s < samples.map.grid.size(); ++s) {
    if (!(samples.map.depth[s] < kNoSurface)) continue;
    // Near the rim of the weights trust ends.
    if (near_a_fit(view, scene, u_of(kGrids[0], s), v_of(kGrids[0], s), samples.map.depth[s])) {
      EXPECT_EQ(samples.trust[s], 1);
    }
    EXPECT_FALSE(samples.on_edge[s] || samples.ended[s]);
  }
}

TEST_P(Blend, APlaneStaysAPlaneUpToTheRimOfTheWeight) {
  const View view = frontal_view(40, 40);
  Scene scene;
  scene.add({0, 0, -20}, {0, 0, 1});
  const SampleGrid grid{81, 81, 22.55f, 0.01f};  // the rim passes through, 4.2 pixels from (20, 20)
  const std::size_t count = for_each(blended(device_, view, grid, scene, 20.5f),
                                     [&](double depth, const Vec3d& n, double, double) {
                                       ASSERT_NEAR(depth, 20, kDepthError);
                                       ASSERT_NEAR(length(n - Vec3d{0, 0, 1}), 0, kNormalError);
                                     });
  EXPECT_GT(count, 1000u);
  EXPECT_LT(count, grid.size() - 1000);
}

TEST_P(Blend, FitsFarFromTheReferenceOrFacingAwayOrWithoutTrustDoNotCount) {
  const View view = frontal_view(37, 21);
  const Vec3d foot{0, 0, -20}, normal{0, 0, 1};
  Scene scene;
  scene.add(foot, normal);
  scene.add({0, 0, -27}, normal);  // seven radii behind the reference
  scene.add({0, 0, -20}, {0, 0, -1});
  scene.add({0, 0, -21}, normal);
  scene.trust.back() = 0.01;
  scene.add({0, 0, -21}, normal);
  scene.fits.residual.back() = -1;
  scene.add({0, 0, -21}, normal, 0.0009);
  const std::size_t count = for_each(blended(device_, view, kGrids[0], scene, 20),
                                     [&](double depth, const Vec3d& n, double u, double v) {
                                       EXPECT_NEAR(depth, 20, kDepthError);
                                       if (near_a_fit(view, scene, u, v, depth)) {
                                         EXPECT_NEAR(length(n - normal), 0, kNormalError);
                                       }
                                     });
  EXPECT_GT(count, 40u);
}

TEST_P(Blend, DepthsOfGrazingRaysCountLess) {
  const View view = frontal_view(37, 21);
  const std::size_t centre = 10 * 37 + 18;  // its ray is the axis
  const Vec3d grazed = normalized({std::sqrt(1 - 0.09), 0, 0.3});
  // Twice the cosine 0.3 times the distance is below six for eight radii and above for eleven.
  for (const double behind : {8, 11}) {
    Scene scene;
    scene.add({0, 0, -20 - behind}, grazed);
    const Samples samples = blended(device_, view, kGrids[0], scene, 20);
    if (behind < 10) {
      EXPECT_NEAR(samples.map.depth[centre], 20 + behind, kDepthError);
    } else {
      EXPECT_EQ(samples.map.depth[centre], kNoSurface);
    }
  }
}

// Where a drop turns away the ray misses one fit after the other. The last one that it meets would
// stick out of the outline as a flag.
TEST_P(Blend, AFitThatSticksOutOfARoundOutlineIsPassedBy) {
  const View view = frontal_view(16, 16);
  const SampleGrid grid{41, 41, 7.75f, 0.025f};
  const Vec3d centre{-4, 0, -20};
  Scene drop, alone;
  const auto add = [](Scene& scene, const Vec3d& foot, const Vec3d& outward) {
    scene.add(foot, outward, 1, 0.2);
    scene.fits.roundness.back() = 1;
  };
  Random random(5);
  for (int k = 0; k < 200; ++k) {
    const double x = random(-1, 1), y = random(-1, 1), z = random(-1, 1);
    const Vec3d outward = normalized(Vec3d{x, y, z});
    add(drop, centre + outward * 5, outward);
  }
  for (Scene* scene : {&drop, &alone}) add(*scene, centre + Vec3d{5.6, 0, 0}, {1, 0, 0});
  const Samples with = blended(device_, view, grid, drop, 20),
                without = blended(device_, view, grid, alone, 20);
  std::size_t over = 0, in = 0;
  for (std::size_t s = 0; s < grid.size(); ++s) {
    const double u = u_of(grid, s), v = v_of(grid, s);
    const Vec3d ray = normalized(ray_direction(view, u, v)), to = centre - point_at(view, u, v, 0);
    const double height = length(to - ray * dot(to, ray)) - 5;
    if (height < -0.2) {
      ++in;
      EXPECT_FALSE(with.ended[s]) << u << " " << v;
    } else if (height > 0.15 && height < 0.5 && without.map.depth[s] < kNoSurface) {
      ++over;
      EXPECT_TRUE(with.ended[s]) << u << " " << v;
      EXPECT_FALSE(without.ended[s]) << u << " " << v;
    }
  }
  EXPECT_GT(over, 100u);
  EXPECT_GT(in, 100u);
}

// Feet all over the surface of particles on a ball or around a cylinder, or of a cavity: quadrics
// that bend as the particles do, not as the surface one radius outside. Their mean misses the
// surface by hundredths of a radius; lifted fits by less than a quarter of that, as the mean square
// is a flat disc's.
TEST(LiftedBends, MissTheSurfaceByLittleOnTheMean) {
  constexpr double kReach = 2.5;
  // The surface's radii in two principal directions, negative in a cavity; 0: straight.
  for (const auto& [first, second] : {std::pair{6.0, 6.0}, {5.0, 0.0}, {-7.0, 0.0}, {12.0, -9.0}}) {
    const auto bend_of = [](double radius) { return radius == 0 ? 0 : 1 / radius; };
    // Of the surface, and of the particles one radius inside.
    const double a = bend_of(first), b = bend_of(second);
    const double inner_a = a / (1 - a), inner_b = b / (1 - b);
    BlendRecords records;
    for (double x = -3; x <= 3; x += 0.25)
      for (double y = -3; y <= 3; y += 0.25) {
        const Vec3d foot{x, y, -(a * x * x + b * y * y) / 2};
        const Vec3d n = normalized(Vec3d{a * x, b * y, 1});
        // Second derivatives: of directions across n alone.
        const Vec3d e = normalized(Vec3d{1, 0, -a * x}), f = cross(n, e);
        const auto across = [&](double Vec3d::*i, double Vec3d::*j) {
          return inner_a * (e.*i) * (e.*j) + inner_b * (f.*i) * (f.*j);
        };
        const double record[kFitRecord] = {0,
                                           n.x,
                                           n.y,
                                           n.z,
                                           across(&Vec3d::x, &Vec3d::x) / 2,
                                           across(&Vec3d::y, &Vec3d::y) / 2,
                                           across(&Vec3d::z, &Vec3d::z) / 2,
                                           across(&Vec3d::x, &Vec3d::y),
                                           across(&Vec3d::y, &Vec3d::z),
                                           across(&Vec3d::x, &Vec3d::z),
                                           1 / (kReach * kReach)};
        for (const double value : record) records.record.push_back(static_cast<float>(value));
        for (const double value : {foot.x, foot.y, foot.z, kReach})
          records.foot.push_back(static_cast<float>(value));
      }
    const auto mean = [&] {  // of the values on the surface, at the origin
      double sum = 0, weights = 0;
      for (std::size_t k = 0; k < records.size(); ++k) {
        const float *const c = &records.record[k * kFitRecord], *const at = &records.foot[4 * k];
        const Vec3d x{-at[0], -at[1], -at[2]};
        const double within = std::max(1 - dot(x, x) / (kReach * kReach), 0.0);
        const double weight = within * within * within;
        weights += weight;
        sum += weight *
               (c[0] + c[1] * x.x + c[2] * x.y + c[3] * x.z + c[4] * x.x * x.x + c[5] * x.y * x.y +
                c[6] * x.z * x.z + c[7] * x.x * x.y + c[8] * x.y * x.z + c[9] * x.x * x.z);
      }
      return sum / weights;
    };
    const double before = mean();
    lift_bends(records);
    EXPECT_GT(before, 0.004) << first << ", " << second;
    EXPECT_LT(std::abs(mean()), 0.25 * before) << first << ", " << second;
  }
}

TEST_P(Blend, FitsThatAreNotFirmAreTrustedAsFarAsTheyWeigh) {
  const View view = frontal_view(37, 21);
  const std::size_t centre = 10 * 37 + 18;  // its ray is the axis and meets the foot
  for (const auto& [firmness, trust] :
       {std::pair{0.002, 0.0}, {0.00525, 0.15625}, {0.0085, 0.5}, {0.015, 1.0}, {1.0, 1.0}}) {
    Scene scene;
    scene.add({0, 0, -20}, {0, 0, 1});
    scene.fits.firmness.back() = firmness;
    const Samples samples = blended(device_, view, kGrids[0], scene, 20);
    // Its slope is at most 1.5 / .013, and the firmness takes eight roundings at most.
    EXPECT_NEAR(samples.trust[centre], trust, 8 * kEpsilon * (1 + 1.5 / 0.013 * firmness))
        << firmness;
  }
}

TEST_P(Blend, ManyFirmFitsAreTrustedAlthoughEachIsNot) {
  const View view = frontal_view(37, 21);
  const std::size_t centre = 10 * 37 + 18;  // its ray is the axis and meets the foot
  Scene scene;
  // Each weighs its trust of a half; from .8 on they are trusted the more, at 1.4 fully.
  for (const double given_back : {0.0, 7.0 / 27, 1.0}) {
    scene.add({0, 0, -20}, {0, 0, 1});
    scene.trust.back() = 0.5;
    const Samples samples = blended(device_, view, kGrids[0], scene, 20);
    EXPECT_NEAR(samples.trust[centre], 1 - (1 - 1.001 * 0.5) * (1 - given_back), 16 * kEpsilon)
        << scene.trust.size();
  }
}

TEST_P(Blend, TrustIsTheMeanOfTheFitsUnderTheirWeightsWithoutIt) {
  const View view = frontal_view(37, 21);
  Scene scene;
  for (const double trust : {0.25, 1.0}) {
    scene.add({0, 0, -20}, {0, 0, 1});
    scene.trust.back() = trust;
    scene.fits.firmness.back() = 0.5;  // not enough to be trusted for that
  }
  const Samples samples = blended(device_, view, kGrids[0], scene, 20);
  std::size_t count = 0;
  for (std::size_t s = 0; s < samples.map.grid.size(); ++s) {
    if (!(samples.map.depth[s] < kNoSurface) ||
        !near_a_fit(view, scene, u_of(kGrids[0], s), v_of(kGrids[0], s), samples.map.depth[s]))
      continue;
    ++count;
    // Five roundings; the kernel lets a thousandth through so that 1 stays 1.
    EXPECT_NEAR(samples.trust[s], 1.001 * (0.25 + 1) / 2, 8 * kEpsilon);
  }
  EXPECT_GT(count, 20u);
}

TEST_P(Blend, ARayParallelToAPlaneDoesNotSpoilItsNeighbours) {
  // The second plane is met by the rays left of u = 4 and left by those right of it, at exactly
  // the slope at which the quadratic's stable root divides by zero.
  const View view = frontal_view(16, 16);
  Scene scene;
  for (int j = -4; j <= 4; ++j)
    for (int i = -4; i <= 4; ++i) scene.add({4.0 * i, 4.0 * j, -20}, {0, 0, 1});
  scene.add(point_at(view, 3.5, 8.5, 20), {1, 0, -0.5});
  scene.fits.quadric.back() = {0, 1, 0, -0.5f, 0, 0, 0, 0, 0, 0};
  const SampleGrid grid{16, 16, 0.5f, 1};
  const Samples samples = blended(device_, view, grid, scene, 20);
  for (std::size_t s = 0; s < grid.size(); ++s) {
    EXPECT_TRUE(std::isfinite(samples.map.depth[s]));
    EXPECT_NEAR(length(Vec3d(samples.map.normal[s])), 1, 8 * kEpsilon);
  }
}

TEST_P(Blend, SamplesWithoutReferenceOrFitsStayEmpty) {
  const View view = frontal_view(37, 21);
  Scene scene;
  scene.add({0, 0, -20}, {0, 0, 1});
  const Check nothing = [](double, const Vec3d&, double, double) {};
  EXPECT_EQ(for_each(blended(device_, view, kGrids[0], scene, kNoSurface), nothing), 0u);
  EXPECT_EQ(for_each(blended(device_, view, kGrids[0], Scene{}, 20), nothing), 0u);
}

TEST_P(Blend, PointsGiveTheBitsOfSamples) {
  const View view = frontal_view(37, 21);
  const Scene scene = crowd(4);
  const SampleGrid& grid = kGrids[0];
  const std::size_t n = grid.size();
  std::vector<float> reference(n, 20), points(2 * n);
  for (std::size_t s = 0; s < n; ++s) {
    if (s % 9 == 0) reference[s] = kNoSurface;
    points[s] = static_cast<float>(u_of(grid, s));
    points[n + s] = static_cast<float>(v_of(grid, s));
  }
  const Samples expected = blended(device_, view, grid, scene, reference);
  const BlendRecords records =
      make_records(scene.fits, scene.trust, kFit, kBlendReach * kBlend.radius);
  const SurfaceBuffers list = empty_surface(device_, {static_cast<int>(n), 1, 0, 1});
  blend_points(device_, view, upload_records(device_, records),
               list_fits(device_, view, records, grid), grid, upload(device_, points),
               upload(device_, reference), list, kBlend);
  const Samples actual = samples_of(device_, list);
  EXPECT_EQ(actual.map.depth, expected.map.depth);
  EXPECT_EQ(actual.map.normal, expected.map.normal);
  for (std::size_t s = 0; s < n; ++s) {
    if (reference[s] == kNoSurface) continue;  // nothing is written there
    EXPECT_EQ(actual.map.group[s], expected.map.group[s]) << s;
    EXPECT_EQ(actual.trust[s], expected.trust[s]) << s;
    EXPECT_EQ(actual.on_edge[s], expected.on_edge[s]) << s;
    EXPECT_EQ(actual.ended[s], expected.ended[s]) << s;
  }
}

// Samples that were interpolated get the fits that blending all samples finds, not those of the
// lattice's samples beside them.
TEST_P(Blend, InterpolatedSamplesChooseTheHeaviestFit) {
  const View view = frontal_view(37, 21);
  const SampleGrid grid{141, 77, 0.5f, 0.25f};
  const std::size_t n = grid.size();
  const Vec3d normal = normalized({-0.2, 0.3, 1}), side = normalized(cross(normal, {0, 1, 0}));
  const Vec3d up = cross(side, normal), foot{0, 0, -20};
  Scene scene;
  for (int k = 0; k < 60; ++k)  // spread evenly, in no rows
    scene.add(foot + side * (20 * std::fmod(0.5 + 0.7548776662 * k, 1) - 10) +
                  up * (14 * std::fmod(0.5 + 0.5698402910 * k, 1) - 7),
              normal);
  const Samples all = blended(device_, view, grid, scene, 20);
  const DeviceRecords records = upload_records(
      device_, make_records(scene.fits, scene.trust, kFit, kBlendReach * kBlend.radius));
  for (const int every : {2, 4, 8, 16}) {  // from half a radius on
    constexpr cl_int kOfCorner = records::OF_CORNER;
    std::vector<cl_int> found(n);
    std::size_t others = 0;
    for (std::size_t s = 0; s < n; ++s) {
      const std::size_t nx = static_cast<std::size_t>(grid.nx), e = static_cast<std::size_t>(every);
      const std::size_t corner = s / nx / e * e * nx + s % nx / e * e;
      const bool interpolated = corner != s && all.map.depth[corner] < kNoSurface;
      found[s] = interpolated ? all.map.group[corner] | kOfCorner : all.map.group[s];
      others += all.map.depth[s] < kNoSurface && all.map.group[s] != all.map.group[corner];
    }
    ASSERT_GT(others, 500u) << every;
    std::vector<cl_int> narrow;
    for (const int width : {1, 8, 16}) {
      device_.state().vector_width = width;
      const SurfaceBuffers surface{
          grid, upload(device_, all.map.depth), {}, upload(device_, found), {}, {}};
      const std::vector<cl_int> chosen =
          download(device_, choose_groups(device_, view, surface, records, every, kBlend));
      if (width == 1) narrow = chosen;
      EXPECT_EQ(chosen, narrow) << width;
    }
    const auto at_lattice_around = [&](std::size_t s, cl_int group) {
      const int i = static_cast<int>(s) % grid.nx, j = static_cast<int>(s) / grid.nx;
      for (int y = std::max(j - every, 0); y <= std::min(j + every, grid.ny - 1); ++y)
        for (int x = std::max(i - every, 0); x <= std::min(i + every, grid.nx - 1); ++x)
          if (x % every == 0 && y % every == 0 && all.map.group[y * grid.nx + x] == group)
            return true;
      return false;
    };
    std::size_t differing = 0;
    for (std::size_t s = 0; s < n; ++s) {
      const bool shown = all.map.depth[s] < kNoSurface;
      const cl_int best = shown ? all.map.group[s] : -1;
      differing += narrow[s] != best;
      if (!shown || at_lattice_around(s, best)) {
        EXPECT_EQ(narrow[s], best) << every << " " << s;
      }
    }
    if (every <= 4) {  // else the lattice misses fits
      EXPECT_LT(differing, others / 5) << every;
    }
  }
}

TEST_P(Blend, ListsEveryFitThatRaysMeetOrThatIsSteep) {
  const View view = frontal_view(70, 50);
  Random random(6);
  Scene scene;
  for (int k = 0; k < 80; ++k) {
    scene.add({random(-30, 30), random(-20, 20), random(-40, -12)},
              {random(-1, 1), random(-1, 1), random(-1, 1)}, k % 3 == 0 ? 0 : 1, random(-0.1, 0.1));
    scene.fits.support.back() = random(3, 10);
  }
  const BlendRecords records =
      make_records(scene.fits, scene.trust, kFit, kBlendReach * kBlend.radius);
  const SampleGrid grid{70, 50, 0.5f, 1};
  const FitTiles tiles = list_fits(device_, view, records, grid);
  const auto met_start = download(device_, tiles.met.start), met = download(device_, tiles.met.fit);
  const auto rim_start = download(device_, tiles.rim.start), rim = download(device_, tiles.rim.fit);
  std::size_t steeply = 0;
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const int tile = j / 16 * tiles.nx + i / 16;
      const auto in = [&](const std::vector<cl_int>& start, const std::vector<cl_int>& list,
                          std::size_t k) {
        return std::binary_search(list.begin() + start[tile], list.begin() + start[tile + 1],
                                  static_cast<cl_int>(k));
      };
      const Vec3d from = point_at(view, i + 0.5, j + 0.5, 0);
      const Vec3d d = ray_direction(view, i + 0.5, j + 0.5);
      for (std::size_t k = 0; k < scene.fits.size(); ++k) {
        const double reach = reference::reach(scene.fits, k, kFit, kBlend);
        const double nearest = dot(scene.fits.foot[k] - from, d) / dot(d, d);
        bool reached = false, steep = false;
        double before = NAN;  // the quadric's value
        for (double t = nearest - reach; t < nearest + reach; t += reach / 20) {
          if (length(from + d * t - scene.fits.foot[k]) >= reach) continue;
          Vec3d g;
          const double value = reference::value(scene.fits, k, from + d * t, &g);
          reached |= before * value < 0;
          before = value;
          steep |= dot(g, d) > -0.5 * length(g) * length(d) && std::abs(value) < 2 * length(g);
        }
        const std::string where =
            std::to_string(k) + " at " + std::to_string(i) + "," + std::to_string(j);
        EXPECT_TRUE(!reached || in(met_start, met, k) == (k % 3 != 0)) << where;
        EXPECT_TRUE(!steep || in(rim_start, rim, k)) << where;
        steeply += steep;
      }
    }
  EXPECT_GT(steeply, 1000u);
  EXPECT_LT(rim.size(), static_cast<std::size_t>(0.9 * tiles.nx * tiles.ny * 80)) << "all listed";
}

MENISCUS_ON_EVERY_DEVICE(Blend);

}  // namespace
}  // namespace meniscus
