// How irregularly particles lie, and what evening them out does: on lattices and on particles at
// random, whose answers are known.
#include "stages/frame/relax.hpp"

#include <algorithm>
#include <cmath>

#include "meniscus/extract.hpp"
#include "stages/sheet/surface_by_hand.hpp"
#include "stages/stage_test_support.hpp"

namespace meniscus {
namespace {

Cells cells_of_all(const Projected& p) {
  return make_cells(p.x, p.y, p.z, static_cast<float>(kRelaxReach));
}

ParticleOrder order_of(const Projected& p) { return measure_order(p, cells_of_all(p)); }

// One particle anywhere in each cube of a lattice, particle radii.
Projected irregular_block() { return block(16, 16, 16, 1.0, 7); }

Vec3d middle_of(const Projected& p) {
  Vec3d sum;
  for (std::size_t i = 0; i < p.size(); ++i) sum += p.eye(i);
  return sum * (1.0 / static_cast<double>(p.size()));
}

// Where the field falls to 1/2 before the middle of a block's front face, which lies at depth 29
// (surface_by_hand.hpp), in the mean over some places.
double depth_of_front(const Projected& p) {
  const Cells cells = cells_of_all(p);
  const auto density = [&](const Vec3d& at) {
    double sum = 0;
    visit_near(cells, static_cast<float>(at.x), static_cast<float>(at.y), static_cast<float>(at.z),
               [&](std::int32_t k) {
                 const double d = length(at - Vec3d{cells.x[k], cells.y[k], cells.z[k]}) / 2;
                 if (d < 1) sum += 1 - 1.5 * d * d * (1 - d / 2);
                 if (d >= 1 && d < 2) sum += std::pow(2 - d, 3) / 4;
                 return true;
               });
    return sum / std::numbers::pi;
  };
  const Vec3d middle = middle_of(p);
  double sum = 0;
  int count = 0;
  for (int i = -4; i <= 4; ++i)
    for (int j = -4; j <= 4; ++j) {
      double low = 25, high = 35;
      while (high - low > 1e-4) {
        const double depth = (low + high) / 2;
        (density({middle.x + 2.1 * i, middle.y + 1.9 * j, -depth}) < 0.5 ? low : high) = depth;
      }
      sum += low;
      ++count;
    }
  return sum / count;
}

// A block with noise of so many spacings in each coordinate (RMS).
Projected noisy_block(double sigma) { return block(16, 16, 16, 2 * sigma * std::sqrt(3.0), 5); }

TEST(Relax, TellsLatticesFromParticlesAtRandom) {
  const ParticleOrder lattice = order_of(block(12, 12, 12));
  EXPECT_NEAR(lattice.distances, 0, 1e-5);
  // Six others lie just at the reach, which noise counts half of the time.
  EXPECT_NEAR(lattice.spacing, 2, 0.2);
  EXPECT_EQ(disorder_of(lattice), 0);

  double last = 0;
  for (const double sigma : {0.05, 0.1, 0.15, 0.2}) {
    const ParticleOrder noisy = order_of(noisy_block(sigma));
    EXPECT_NEAR(noisy.distances, sigma, 0.015);
    EXPECT_GT(noisy.density, last);
    last = noisy.density;
  }
  EXPECT_EQ(disorder_of(order_of(noisy_block(0.05))), 0);
  EXPECT_NEAR(disorder_of(order_of(noisy_block(0.15))), 0.4, 0.1);

  const ParticleOrder flip = order_of(irregular_block());
  EXPECT_NEAR(flip.distances, 0.28, 0.03);
  EXPECT_NEAR(flip.spacing, 2, 0.1);
  EXPECT_NEAR(disorder_of(flip), 1, 0.1);

  // Anywhere, as dense: for a Poisson process sqrt(Gamma(5/3) / Gamma(4/3)^2 - 1) = .363, a little
  // less where those with the most others are looked at.
  Random random(3);
  std::vector<Vec3d> uvt;
  for (int k = 0; k < 8000; ++k) uvt.push_back({random(0, 40), random(0, 40), random(30, 70)});
  const ParticleOrder anywhere = order_of(place(uvt));
  EXPECT_NEAR(anywhere.distances, 0.36, 0.03);
  EXPECT_EQ(disorder_of(anywhere), 2);
}

TEST(Relax, TakesUnevenDistancesOrAnUnevenDensityAloneForOrder) {
  EXPECT_EQ(disorder_of({.distances = 0.12, .density = 0.03}), 0) << "frames of SPH";
  EXPECT_EQ(disorder_of({.distances = 0.06, .density = 0.12}), 0) << "thin water";
  EXPECT_NEAR(disorder_of({.distances = 0.165, .density = 0.3}), 0.5, 1e-9);
  EXPECT_NEAR(disorder_of({.distances = 0.3, .density = 0.14}), 0.5, 1e-9);
  EXPECT_EQ(disorder_of({.distances = 0.27, .density = 0.2}), 1);
  EXPECT_NEAR(disorder_of({.distances = 0.3, .density = 0.3}), 1.5, 1e-9);
  EXPECT_NEAR(disorder_of({.distances = 0.4, .density = 0.225}), 1.25, 1e-9);
  EXPECT_EQ(disorder_of({.distances = 0.4, .density = 0.3}), 2);
}

TEST(Relax, TakesFramesOfSphForOrder) {
  for (const char* name : {"dam/frame_015.ply", "dam_sequence/dam.0010.ply",
                           "cube_drop/frame_007.ply", "cube_drop/frame_012.ply"}) {
    const Particles particles = read_particles(std::string(MENISCUS_EXAMPLE_DATA) + "/" + name);
    std::vector<Vec3d> uvt;
    for (std::size_t i = 0; i < particles.x.size(); ++i)
      uvt.push_back(Vec3d{particles.x[i], particles.y[i], 3 + particles.z[i]} *
                    (1 / particles.particle_radius));
    const ParticleOrder order = order_of(place(uvt));
    EXPECT_GT(order.distances, 0.065) << name;
    EXPECT_LT(order.density, 0.06) << name;
    EXPECT_EQ(disorder_of(order), 0) << name;
  }
}

TEST(Relax, KnowsWhenThereAreTooFewToTell) {
  for (const Projected& p : {place({}), place({{1, 1, 30}}), block(4, 4, 4, 0.9)}) {
    const ParticleOrder order = order_of(p);
    EXPECT_EQ(order.distances, 0);
    EXPECT_EQ(disorder_of(order), 0);
  }
}

TEST(Relax, BringsOrderAndKeepsTheFluidWhereItIs) {
  const Projected before = irregular_block();
  Projected after = before;
  relax(after, 2, 1);
  EXPECT_LT(order_of(after).distances, 0.15);
  EXPECT_LE(length(middle_of(after) - middle_of(before)), 1e-3) << "forces come in pairs";
  // Lone faces move by less than a tenth of the spacing.
  EXPECT_NEAR(depth_of_front(before), 29, 0.15);
  EXPECT_NEAR(depth_of_front(after), depth_of_front(before), 0.2);
  double farthest = 0;
  for (std::size_t i = 0; i < before.size(); ++i)
    farthest = std::max(farthest, length(after.eye(i) - before.eye(i)));
  EXPECT_GT(farthest, 0.5);
  EXPECT_LT(farthest, 3);
}

// Forces alone press both together: the drop by .21 radii, the sheet by .13.
TEST(Relax, KeepsDropsAndThinSheetsAsLargeAsTheyAre) {
  const Projected cube = irregular_block();
  const Vec3d middle = middle_of(cube);
  std::vector<Vec3d> drop;
  for (std::size_t i = 0; i < cube.size(); ++i)
    if (const Vec3d at = cube.eye(i); length(at - middle) < 10) drop.push_back({at.x, at.y, -at.z});
  const Projected drop_before = place(drop);
  Projected drop_after = drop_before;
  relax(drop_after, 2, 1);
  const auto size = [](const Projected& p) {
    const Vec3d centre = middle_of(p);
    double sum = 0;
    for (std::size_t i = 0; i < p.size(); ++i) sum += length(p.eye(i) - centre);
    return sum / static_cast<double>(p.size());
  };
  EXPECT_NEAR(size(drop_after), size(drop_before), 0.08);

  const Projected sheet_before = block(30, 30, 3, 1.0, 4);
  Projected sheet_after = sheet_before;
  relax(sheet_after, 2, 1);
  // How far the outer layers lie from the middle one, away from the sheet's edges.
  const auto half_thickness = [](const Projected& p) {
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < p.size(); ++i) {
      const int column = static_cast<int>(i % 30), row = static_cast<int>(i / 30 % 30);
      if (i / 900 == 1 || std::min(column, row) < 6 || std::max(column, row) > 23) continue;
      sum += std::abs(-p.z[i] - 32.0);
      ++count;
    }
    return sum / count;
  };
  EXPECT_NEAR(half_thickness(sheet_after), half_thickness(sheet_before), 0.1);
}

TEST(Relax, MovesParticlesAsFarAsTheirDisorderSays) {
  const Projected before = irregular_block();
  double last = 0;
  for (const double disorder : {0.0, 0.25, 1.0}) {
    Projected after = before;
    relax(after, 2, disorder);
    double sum = 0;
    for (std::size_t i = 0; i < before.size(); ++i) sum += length(after.eye(i) - before.eye(i));
    if (disorder == 0) {
      EXPECT_EQ(sum, 0);
    } else {
      EXPECT_GT(sum, last);
    }
    last = sum;
  }
}

TEST(Relax, PutsThoseInAPlaceWhereTheyGoAmongAll) {
  Projected all = block(60, 12, 12, 1.0, 7), some = all;
  const Projected before = all;
  SpaceBox wanted;
  wanted.low[0] = before.x[5];
  wanted.high[0] = before.x[15];
  relax(all, 2, 1);
  relax(some, 2, 1, wanted);
  int left = 0, inside = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    left += some.x[i] == before.x[i];
    if (!wanted.holds(before.eye(i))) continue;
    ++inside;
    ASSERT_EQ(some.eye(i), all.eye(i));
  }
  EXPECT_GT(inside, 500);
  EXPECT_GT(left, 1000);
}

TEST(Relax, DoesNotKnowUnits) {
  Projected one = irregular_block(), two = one;
  for (std::vector<float>* values : {&two.x, &two.y, &two.z})
    for (float& value : *values) value *= 0.5f;
  relax(one, 2, 1);
  relax(two, 1, 1);
  for (std::size_t i = 0; i < one.size(); ++i) EXPECT_LE(length(one.eye(i) - two.eye(i) * 2), 1e-3);
}

TEST(Relax, LeavesWhatIsRegularOrWhoSaysSo) {
  const auto unmoved = [](const Projected& from, double asked) {
    Projected p = from;
    const Cells cells = cells_of_all(p);
    Parameters params;
    params.disorder = asked;
    const Disorder disorder = find_disorder(p, cells, params);
    even_out(p, disorder);
    return disorder.amount == 0 && p.x == from.x && p.y == from.y && p.z == from.z;
  };
  EXPECT_TRUE(unmoved(block(12, 12, 12, 0.3), -1));
  EXPECT_FALSE(unmoved(irregular_block(), -1));
  EXPECT_TRUE(unmoved(irregular_block(), 0));
  EXPECT_FALSE(unmoved(block(12, 12, 12, 0.3), 0.5));
}

TEST(Relax, ParametersBelongToTheDisorder) {
  const Parameters given, regular = for_disorder(given, Disorder{}),
                          irregular = for_disorder(given, Disorder{.amount = 1});
  EXPECT_EQ(regular.fit.tau, given.fit.tau);
  EXPECT_EQ(regular.fit.normal_sigma, given.fit.normal_sigma);
  EXPECT_EQ(regular.fit.least_support, given.fit.least_support);
  EXPECT_EQ(regular.fit.round_support, given.fit.round_support);
  EXPECT_EQ(regular.fairing, given.fairing);
  EXPECT_EQ(regular.disorder, 0);
  EXPECT_GT(irregular.fit.tau, given.fit.tau);
  EXPECT_GT(irregular.fit.normal_sigma, given.fit.normal_sigma);
  EXPECT_GT(irregular.fit.least_support, given.fit.least_support);
  EXPECT_GT(irregular.fit.round_support, given.fit.round_support);
  EXPECT_GT(irregular.fairing, given.fairing);
  EXPECT_EQ(irregular.disorder, 1);
  EXPECT_EQ(regular.fit.offset, given.fit.offset);
  EXPECT_LT(irregular.fit.offset, given.fit.offset);
  EXPECT_EQ(regular.region.blob_density, given.region.blob_density);
  EXPECT_GT(irregular.region.blob_density, given.region.blob_density);
}

TEST(Relax, LengthensTheUnitForParticlesAnywhere) {
  for (const double amount : {0.0, 0.5, 1.0}) {
    const Disorder disorder{.amount = amount};
    EXPECT_EQ(disorder.unit(), 1);
    EXPECT_EQ(disorder.mass(), 1);
    EXPECT_EQ(disorder.within_cubes(), amount);
  }
  const Disorder between{.amount = 1.5}, most{.amount = 2};
  EXPECT_NEAR(between.unit(), 1.2, 1e-12);
  EXPECT_NEAR(most.unit(), 1.4, 1e-12);
  EXPECT_NEAR(most.mass() * std::pow(most.unit(), 3), 1, 1e-6);
  EXPECT_EQ(most.within_cubes(), 1);
  // The surface stays where it is among the particles, which lie nearer to each other in this unit.
  const Parameters given, at_one = for_disorder(given, Disorder{.amount = 1}),
                          at_two = for_disorder(given, most);
  EXPECT_EQ(at_two.fit.tau, at_one.fit.tau);
  EXPECT_LT(at_two.fit.offset, at_one.fit.offset);
  EXPECT_GT(at_two.fit.offset * most.unit(), at_one.fit.offset);
}

// Whatever the unit, particles of the same spacing go the same way.
TEST(Relax, EvensOutAlikeInAnyUnit) {
  const Disorder anywhere{.amount = 2, .spacing = 2};
  Projected one = irregular_block(), coarse = one;
  for (std::vector<float>* const values : {&coarse.x, &coarse.y, &coarse.z})
    for (float& value : *values) value /= static_cast<float>(anywhere.unit());
  even_out(coarse, anywhere);
  relax(one, 2, 1);
  double farthest = 0;
  for (std::size_t i = 0; i < one.size(); ++i)
    farthest = std::max(farthest, length(coarse.eye(i) * anywhere.unit() - one.eye(i)));
  EXPECT_LT(farthest, 1e-3);
}

using ProjectAgain = OnDevice;

TEST_P(ProjectAgain, HasThePixelsOfWhereParticlesWent) {
  const View view = make_view(perspective_camera(101, 77), 0.15, {0, 0, 0});
  WorldParticles particles;
  Random random(2);
  for (int k = 0; k < 500; ++k) {
    add_position(particles, {random(-1, 1), random(-1, 1), random(-1, 1)});
    particles.scale.push_back(static_cast<float>(random(0.5, 2)));
  }
  const Projected expected = project_particles(view, particles, 3);
  ASSERT_GT(expected.size(), 100u);
  Projected again = expected;
  std::fill(again.u.begin(), again.u.end(), 0.0f);
  std::fill(again.ku.begin(), again.ku.end(), 0.0f);
  project_again(view, again);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(again.u[i], expected.u[i], 1e-3);
    EXPECT_NEAR(again.v[i], expected.v[i], 1e-3);
    EXPECT_NEAR(again.ku[i], expected.ku[i], 1e-5 * expected.ku[i]);
    EXPECT_NEAR(again.kv[i], expected.kv[i], 1e-5 * expected.kv[i]);
  }
}

MENISCUS_ON_EVERY_DEVICE(ProjectAgain);

}  // namespace
}  // namespace meniscus
