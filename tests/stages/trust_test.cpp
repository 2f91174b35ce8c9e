// Which groups are trusted, against a loop over all particles, on every device.
#include "stages/trust.hpp"

#include <algorithm>

#include "reference/settle.hpp"
#include "stages/mesh_by_hand.hpp"

namespace meniscus {
namespace {

using Trust = OnDevice;

struct Trusted {
  Projected particles;
  Triangulation mesh;
  Groups groups;
  std::vector<FitProblem> problems;
  Quadrics quadrics;
};

// Groups of `seen`, with `rest` behind it.
Trusted fitted(Device& device, const Projected& seen, const Projected& rest) {
  Trusted all{seen, triangulated(seen), {}, {}, {}};
  all.particles.x.insert(all.particles.x.end(), rest.x.begin(), rest.x.end());
  all.particles.y.insert(all.particles.y.end(), rest.y.begin(), rest.y.end());
  all.particles.z.insert(all.particles.z.end(), rest.z.begin(), rest.z.end());
  all.groups = merge_groups(all.mesh, smooth_normals(all.mesh, 4), {}, {});
  all.problems = group_problems(all.mesh, all.groups, vertex_normals(all.mesh));
  all.quadrics = fit_quadrics(device, all.problems, {});
  return all;
}

std::vector<double> trust_of(Device& device, const Trusted& all) {
  const Projected& p = all.particles;
  return measure_trust(device, all.mesh, all.groups, all.problems, all.quadrics,
                       upload_cells(device, make_cells(p.x, p.y, p.z, kDensitySupport)),
                       FitParams{}.offset);
}

// A slab of three layers whose face is moved by up to `rough` along the depth.
Trusted slab(Device& device, double rough = 0) {
  Random random(4);
  Projected below = field(16, 2, [](double, double) { return 22.0; });
  const Projected bottom = field(16, 3, [](double, double) { return 24.0; });
  below.x.insert(below.x.end(), bottom.x.begin(), bottom.x.end());
  below.y.insert(below.y.end(), bottom.y.begin(), bottom.y.end());
  below.z.insert(below.z.end(), bottom.z.begin(), bottom.z.end());
  return fitted(device, field(16, 1, [&](double, double) { return 20 + random(-1, 1) * rough; }),
                below);
}

// Particles four radii apart and up to three before or behind their plane.
Trusted spray(Device& device) {
  Random random(5);
  std::vector<Vec3d> uvt;
  for (int j = 0; j < 12; ++j)
    for (int i = 0; i < 12; ++i)
      uvt.push_back(
          {20 + 4 * i + random(-0.5, 0.5), 20 + 4 * j + random(-0.5, 0.5), 20 + random(-3, 3)});
  return fitted(device, place(uvt), {});
}

TEST_P(Trust, MatchesItsDefinition) {
  std::size_t between = 0;
  for (const Trusted& all : {slab(device_), slab(device_, 1.2), spray(device_)}) {
    const std::vector<double> actual = trust_of(device_, all);
    ASSERT_EQ(actual.size(), all.groups.size());
    for (std::size_t g = 0; g < all.groups.size(); ++g) {
      if (all.quadrics.residual[g] < 0) {
        EXPECT_EQ(actual[g], 0);
        continue;
      }
      const auto& c = all.quadrics.coefficient[g];
      const auto f = [&](const Vec3d& x) {
        return c[0] + c[1] * x.x + c[2] * x.y + c[3] * x.z + c[4] * x.x * x.x + c[5] * x.y * x.y +
               c[6] * x.z * x.z + c[7] * x.x * x.y + c[8] * x.y * x.z + c[9] * x.z * x.x;
      };
      double density = 0, off = 0;
      for (int k = 0; k < all.groups.members[g]; ++k) {
        const Vec3d at = all.mesh.position[all.groups.point[all.groups.start[g] + k]];
        const Vec3d x = at - all.groups.centre[g];
        // Central differences are a quadric's gradient but for rounding: 1e-16 / 1e-3.
        const double h = 1e-3;
        const Vec3d slope = Vec3d{f(x + Vec3d{h, 0, 0}) - f(x - Vec3d{h, 0, 0}),
                                  f(x + Vec3d{0, h, 0}) - f(x - Vec3d{0, h, 0}),
                                  f(x + Vec3d{0, 0, h}) - f(x - Vec3d{0, 0, h})} /
                            (2 * h);
        const Vec3d foot = at - slope * (f(x) / std::max(dot(slope, slope), 1e-6));
        const double there = reference::density(all.particles, foot);
        density += there;
        double near = 0;
        for (std::size_t i = 0; i < all.particles.size(); ++i)
          near += length(foot - all.particles.eye(i)) < 4.001;
        // density_test.cpp, and the foot's rounding by the slope, 1 / (2 pi) at most a particle.
        off += kEpsilon * (16 / std::numbers::pi * near + (near + 2) * there +
                           near * length(foot) / (2 * std::numbers::pi));
      }
      double sum = 0, weight = 0;
      for (const FitPoint& point : all.problems[g].points) {
        const double away =
            std::clamp(f(point.position - all.problems[g].centre) + FitParams{}.offset, -2.0, 2.0);
        sum += point.weight * away * away;
        weight += point.weight;
      }
      const double points = static_cast<double>(all.problems[g].points.size());
      const double expected = reference::smooth_step(0.24, 0.33, density / all.groups.members[g]) *
                              (1 - reference::smooth_step(0.45, 0.75, std::sqrt(sum / weight))) *
                              reference::smooth_step(5, 12, points);
      between += expected > 0.01 && expected < 0.99;
      // Smoothstep's slope is 1.5 over the width of its ramp; all but the density is double.
      EXPECT_NEAR(actual[g], expected, 1.5 / 0.09 * off / all.groups.members[g] + 1e-9);
    }
  }
  EXPECT_GT(between, 0u);
}

TEST_P(Trust, TheFaceOfASlabIsTrusted) {
  const Trusted all = slab(device_);
  const std::vector<double> trust = trust_of(device_, all);
  std::size_t inner = 0;
  for (std::size_t g = 0; g < all.groups.size(); ++g) {
    const Vec3d& centre = all.groups.centre[g];
    // The field covers u and v from 10 to 40, x from -40 to -10 and y from 10 to 40; the density of
    // what lies farther than the support from the rim is that of an endless face, 1/2.
    const double rim = 15 - std::max(std::abs(centre.x + 25), std::abs(centre.y - 25));
    if (rim < kDensitySupport + all.groups.radius[g] || all.problems[g].points.size() < 12)
      continue;
    ++inner;
    EXPECT_EQ(trust[g], 1) << "group " << g;
  }
  EXPECT_GT(inner, 3u);
}

TEST_P(Trust, ASprayIsNot) {
  const Trusted all = spray(device_);
  const std::vector<double> trust = trust_of(device_, all);
  ASSERT_GT(trust.size(), 10u);
  // At half trust and below, the field is what a sample shows.
  for (const double t : trust) EXPECT_LE(t, 0.5);
}

TEST_P(Trust, AGroupWithoutAFitHasNone) {
  Trusted all = slab(device_);
  const std::vector<double> before = trust_of(device_, all);
  const std::size_t g =
      static_cast<std::size_t>(std::max_element(before.begin(), before.end()) - before.begin());
  ASSERT_EQ(before[g], 1);
  all.quadrics.residual[g] = -1;
  std::vector<double> expected = before;
  expected[g] = 0;
  EXPECT_EQ(trust_of(device_, all), expected);
}

MENISCUS_ON_EVERY_DEVICE(Trust);

}  // namespace
}  // namespace meniscus
