// Anisotropic kernels and the rays that meet their field, against double precision, on every
// device.
#include "stages/other_methods/anisotropic.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "stages/other_methods/anisotropic_reference.hpp"
#include "stages/stage_test_support.hpp"

namespace meniscus {
namespace {

/// A jittered block of particles 2 radii apart in front of the camera of view(), whose upper right
/// corner is missing, and two particles away from it.
Projected block(unsigned seed) {
  Random random(seed);
  Projected particles;
  const auto add = [&](double x, double y, double z) {
    add_position(particles, {x, y, z});
    particles.scale.push_back(1);
  };
  for (int k = 0; k < 4; ++k)
    for (int j = 0; j < 7; ++j)
      for (int i = 0; i < 8; ++i)
        if (i < 5 || j < 3 || k > 1)
          add(2 * i - 7 + random(-.3, .3), 2 * j - 6 + random(-.3, .3),
              -30 - 2 * k + random(-.3, .3));
  add(-9, 9, -28);
  add(12, 2, -33);
  return particles;
}

/// A camera at the origin of eye space, one world unit a particle radius.
View view(int width, int height) {
  return make_view(look_at({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 50, width, height), 1, {0, 0, 0});
}

/// The kernels as the device has them, in double precision.
std::vector<reference::Kernel> read(const AnisotropicKernels& kernels) {
  std::vector<reference::Kernel> result;
  const std::size_t n = static_cast<std::size_t>(kernels.count);
  for (std::size_t p = 0; p < n; ++p) {
    const auto row = [&](std::size_t r) -> double { return kernels.host_shapes[r * n + p]; };
    reference::Kernel kernel;
    kernel.centre = {row(0), row(1), row(2)};
    kernel.shape << row(3), row(6), row(7), row(6), row(4), row(8), row(7), row(8), row(5);
    kernel.volume = row(9) * std::numbers::pi / kernel.shape.determinant();
    result.push_back(kernel);
  }
  return result;
}

class Anisotropic : public OnDevice {};

TEST_P(Anisotropic, KernelsMatchTheReference) {
  const Projected particles = block(3);
  AnisotropicParams params;
  for (const double h : {1.7, 2.4}) {
    SCOPED_TRACE(h);
    params.h = h;
    const AnisotropicKernels kernels = shape_kernels(device_, particles, params);
    const auto actual = read(kernels);
    ASSERT_EQ(actual.size(), particles.size());
    int alone = 0;
    std::vector<bool> found(actual.size(), false);
    for (std::size_t i = 0; i < particles.size(); ++i) {
      const auto expected = reference::shape_kernel(particles, i, params);
      ASSERT_GT(expected.margin, 1e-6);  // rounding decides about no neighbour
      // The kernels come in another order: the nearest centre.
      std::size_t k = 0;
      for (std::size_t p = 0; p < actual.size(); ++p)
        if ((actual[p].centre - expected.centre).norm() <
            (actual[k].centre - expected.centre).norm())
          k = p;
      EXPECT_FALSE(found[k]);
      found[k] = true;
      // Sums of n terms of at most R, or R^2 twice, over a sum of at least 1; a term rounds ten
      // times. Positions of up to 64 round once more, and their differences are exact enough.
      const double radius = 2 * h, rounding = (expected.neighbours + 12) * kEpsilon;
      EXPECT_LT((actual[k].centre - expected.centre).norm(),
                2 * (2 * rounding * radius + 64 * kEpsilon));
      EXPECT_NEAR(actual[k].volume / expected.volume, 1, 200 * kEpsilon + rounding);
      // G = 1 / (h s): a function of the covariance, whose change in the Frobenius norm is at most
      // the steepest slope times the covariance's, and as much for the largest variance's over k_r.
      // The five sweeps' own roundings are some fifty of the largest entry.
      const double covariance = (2 * rounding + 50 * kEpsilon) * 3 * radius * radius;
      const double slope =
          params.k_s / (0.15 * radius * radius) / (h * std::pow(expected.least, 2));
      const double largest = 1 / (h * expected.least);
      const double tolerance = 2 * slope * covariance + 20 * kEpsilon * largest;
      ASSERT_LT(tolerance, 0.02 * largest);
      EXPECT_LT((actual[k].shape - expected.shape).norm(), tolerance) << i;
      alone += expected.neighbours <= params.n_eps;
    }
    EXPECT_GE(alone, 2);
    EXPECT_LT(alone, static_cast<int>(particles.size()) / 4);
  }
}

TEST_P(Anisotropic, RaysMeetTheLevel) {
  const Projected particles = block(5);
  const AnisotropicParams params;
  const View camera = view(41, 37);
  const AnisotropicKernels kernels = shape_kernels(device_, particles, params);
  const auto exact = read(kernels);
  FieldRays rays;
  for (const bool vertical : {false, true})
    for (int k = 0; k < 41 * 37; ++k)
      rays.points.push_back(0.5f + static_cast<float>(vertical ? k / 41 : k % 41));
  const std::size_t n = rays.points.size() / 2;
  std::vector<float> from(n, 20), to(n, 45);
  from[5] = kNoSurface;
  rays.from = upload(device_, from);
  rays.to = upload(device_, to);
  const auto samples = cast_field(device_, camera, kernels, rays, params.level);
  ASSERT_EQ(samples.size(), n);
  EXPECT_EQ(samples[5].depth, kNoSurface);

  int hits = 0, thin = 0;
  for (std::size_t k = 0; k < n; ++k) {
    if (k == 5) continue;
    const auto at = [&](double t) {
      const Vec3d x = point_at(camera, rays.points[k], rays.points[n + k], t);
      return reference::field_at(exact, {x.x, x.y, x.z});
    };
    // The first crossing, and for how long the field stays above the level.
    constexpr double kStep = 0.02;
    double expected = kNoSurface;
    int above = 0;
    for (double t = 20; t <= 45 && above < 20; t += kStep) {
      if (at(t).value < params.level) {
        if (above > 0) break;
        continue;
      }
      if (above++ == 0) {
        double low = t - kStep, high = t;
        for (int round = 0; round < 40; ++round) {
          const double middle = (low + high) / 2;
          (at(middle).value < params.level ? low : high) = middle;
        }
        expected = high;
      }
    }
    if (above > 0 && above * kStep < 0.3) {  // thinner than what is promised
      ++thin;
      continue;
    }
    if (above == 0) {
      EXPECT_EQ(samples[k].depth, kNoSurface) << k;
      continue;
    }
    ++hits;
    ASSERT_NEAR(samples[k].depth, expected, 0.01) << k;  // as promised
    // The gradient at the depth that was found: n terms with some thirty roundings each, and the
    // position's, which is off by 50 roundings of 1 in kernels that change over half a radius.
    const auto there = at(samples[k].depth);
    const double tolerance =
        there.terms / there.gradient.norm() * ((there.count + 30) * kEpsilon + 4 * 50 * kEpsilon);
    ASSERT_LT(tolerance, 0.01);
    const Eigen::Vector3d normal(samples[k].normal.x, samples[k].normal.y, samples[k].normal.z);
    EXPECT_LT((normal + there.gradient.normalized()).norm(), 2 * tolerance) << k;
  }
  EXPECT_GT(hits, static_cast<int>(n) / 4);
  EXPECT_LT(thin, static_cast<int>(n) / 50);
}

// A lone particle is a sphere: W(0) = 1 / (pi h^3), so that V det G / pi = 1 / k_n^3, and the level
// is reached at (2 - q)^3 / 4 = level k_n^3, at the radius q h k_n.
TEST_P(Anisotropic, LoneParticlesAreSpheres) {
  Projected one;
  one.x = one.y = {0};
  one.z = {-25};
  one.scale = {1};
  AnisotropicParams params;
  params.level = 0.3;
  const double q = 2 - std::cbrt(4 * params.level * std::pow(params.k_n, 3));
  ASSERT_GT(q, 1);
  const AnisotropicKernels kernels = shape_kernels(device_, one, params);
  const View camera = view(16, 16);
  FieldRays rays{
      {8, 8}, upload(device_, std::vector<float>{20}), upload(device_, std::vector<float>{30})};
  const auto samples = cast_field(device_, camera, kernels, rays, params.level);
  EXPECT_NEAR(samples[0].depth, 25 - q * params.h * params.k_n, 0.01);
  EXPECT_NEAR(samples[0].normal.z, 1, 1e-6);
}

TEST_P(Anisotropic, NamesArraysOfDifferentSizes) {
  const AnisotropicKernels kernels = shape_kernels(device_, block(1), {});
  const FieldRays rays{
      {1, 2, 3}, upload(device_, std::vector<float>{20}), upload(device_, std::vector<float>{30})};
  EXPECT_THROW(cast_field(device_, view(8, 8), kernels, rays, 0.3), InvalidArgument);
}

MENISCUS_ON_EVERY_DEVICE(Anisotropic);

}  // namespace
}  // namespace meniscus
