// Which fits are trusted, against loops over all of them, on every device.
#include "stages/trust.hpp"

#include <algorithm>
#include <numbers>

#include "stages/surface_by_hand.hpp"
#include "verify/reference/density.hpp"

namespace meniscus {
namespace {

using Trust = OnDevice;

DeviceCells cells_of(Device& device, const Projected& p) {
  return upload_cells(device, make_cells(p.x, p.y, p.z, kDensitySupport));
}

// Fits on the face of a rough block, whose normals face one of two ways, and what decides about
// them at random.
ParticleFits at_random(const Projected& p, std::size_t n, unsigned seed) {
  Random random(seed);
  ParticleFits fits;
  for (std::size_t i = 0; i < n; ++i) {
    fits.position.push_back(p.eye(i));
    const double side = i % 3 == 0 ? 2 : 0;
    fits.normal.push_back(normalized({side + random(-0.4, 0.4), random(-0.4, 0.4), 1}));
    fits.firmness.push_back(random(0.005, 1));
    // Rougher and rougher along one side of the block.
    fits.spread.push_back(0.05 * static_cast<double>(i % 14) + random(0.05, 0.35));
    fits.supporters.push_back(i % 2 == 0 ? random(4, 25) : random(25, 100));
    fits.roundness.push_back(i % 5 == 0 ? random(0, 1) : 0);
    fits.residual.push_back(i % 7 == 6 ? -1 : 0.1f);
    // Feet are rounded to float on their way to the device; here they are floats.
    // Farther and farther out along its other side, from within the second layer.
    const double out = -1.5 + 0.36 * static_cast<double>(i / 14) + random(-0.5, 0.5);
    fits.foot.push_back(Vec3d(Vec3(fits.position[i] + fits.normal[i] * out)));
  }
  return fits;
}

TEST_P(Trust, MatchesItsDefinition) {
  const Projected p = block(14, 12, 2, 0.3);
  const ParticleFits fits = at_random(p, 14 * 12, 2);
  const std::vector<double> actual = measure_trust(device_, fits, cells_of(device_, p));
  ASSERT_EQ(actual.size(), fits.size());
  std::vector<double> density, off, behind, behind_off;
  for (std::size_t k = 0; k < fits.size(); ++k) {
    const Vec3d foot = fits.foot[k], deep(Vec3(foot - fits.normal[k] * 3));
    density.push_back(reference::density(p, foot));
    off.push_back(reference::density_error(p, foot, density.back()));
    behind.push_back(reference::density(p, deep));
    behind_off.push_back(reference::density_error(p, deep, behind.back()));
  }
  std::size_t between = 0, thin = 0, sheets = 0;
  for (std::size_t k = 0; k < fits.size(); ++k) {
    if (fits.residual[k] < 0) {
      EXPECT_EQ(actual[k], 0);
      continue;
    }
    double weight = 0, dense = 0, apart = 0, deep = 0, doubt = 0, deep_doubt = 0;
    for (std::size_t j = 0; j < fits.size(); ++j) {
      const double l = length(fits.position[j] - fits.position[k]);
      if (l >= 5 || fits.residual[j] < 0) continue;
      const double w = (1 - l / 5) * fits.firmness[j] *
                       smooth_step(0.4, 0.6, dot(fits.normal[j], fits.normal[k]));
      weight += w;
      dense += w * density[j];
      doubt += w * off[j];
      apart += w * fits.spread[j];
      deep += w * behind[j];
      deep_doubt += w * behind_off[j];
    }
    const double sheet = (1 - fits.roundness[k]) * smooth_step(40, 80, fits.supporters[k]) *
                         (1 - smooth_step(0.25, 0.4, apart / weight));
    const double thick = smooth_step(0.5, 0.8, deep / weight);
    thin += thick < 0.9;
    sheets += thick < 0.9 && sheet > 0.1;
    const double expected =
        (1 - (1 - thick) * (1 - sheet)) * smooth_step(0.24, 0.33, dense / weight) *
        (1 - smooth_step(0.45, 0.75, apart / weight)) *
        (1 - 0.01 * smooth_step(0.3, 0.4, apart / weight)) * smooth_step(5, 12, fits.supporters[k]);
    between += expected > 0.01 && expected < 0.99;
    // A weight is off by 50 epsilon at most: n.n' by four, which a slope of 7.5 passes on, and the
    // distance; sums round once a fit. Smoothstep's slope is 1.5 over the width of its ramp.
    double dense_off = doubt, apart_off = 0, deep_off = deep_doubt;
    for (std::size_t j = 0; j < fits.size(); ++j) {
      if (length(fits.position[j] - fits.position[k]) >= 5.001 || fits.residual[j] < 0) continue;
      dense_off += kEpsilon * 50 * std::abs(density[j] - dense / weight);
      apart_off += kEpsilon * 50 * std::abs(fits.spread[j] - apart / weight);
      deep_off += kEpsilon * 50 * std::abs(behind[j] - deep / weight);
    }
    const double sums = static_cast<double>(fits.size()) * kEpsilon;
    EXPECT_NEAR(actual[k], expected,
                1.5 / 0.09 * (dense_off + sums * dense) / weight +
                    (1.5 / 0.3 + 1.5 / 0.15) * (apart_off + sums * apart) / weight +
                    1.5 / 0.3 * (deep_off + sums * deep) / weight)
        << k;
  }
  EXPECT_GT(between, fits.size() / 4);
  EXPECT_GT(thin, fits.size() / 8);
  EXPECT_GT(sheets, fits.size() / 32);
}

struct Trusted {
  ParticleFits fits;
  std::vector<double> trust;
};

// The first `seen` particles are seen; their fits and those of the rim.
Trusted trust_of(Device& device, const Projected& p, std::size_t seen) {
  const FoundSurface found = surface_of(device, p, seen);
  Trusted result;
  result.fits = fit_particles(device, p, with_rim(p, found.seen, found.field), found.surface, {});
  result.trust = measure_trust(device, result.fits, cells_of(device, p));
  return result;
}

// Distance of a fit from the rim of the face of block(nu, nv, .), particle radii.
double rim_distance(const Vec3d& p, int nu, int nv) {
  const double u = p.x + 50 - 10, v = 50 - p.y - 10;
  return std::min({u, 2.0 * (nu - 1) - u, v, 2.0 * (nv - 1) - v});
}

TEST_P(Trust, ABlockIsTrustedOnItsFaceAndAlongItsEdges) {
  for (const double rough : {0.0, 0.3}) {
    const Trusted block_fits = trust_of(device_, block(20, 20, 8, rough), 20 * 20);
    std::size_t face = 0, edge = 0;
    for (std::size_t k = 0; k < block_fits.fits.size(); ++k) {
      if (!(block_fits.fits.visible[k] == 1)) continue;
      const Vec3d& p = block_fits.fits.position[k];
      const double u = p.x + 40, v = 40 - p.y;
      const bool corner = std::min(u, 38 - u) < 8 && std::min(v, 38 - v) < 8;
      if (corner) continue;
      if (rim_distance(p, 20, 20) > 8) {
        ++face;
        EXPECT_EQ(block_fits.trust[k], 1) << u << " " << v;
      } else if (rim_distance(p, 20, 20) < 1) {
        ++edge;
        // More than half: a sample shows the fits.
        EXPECT_GT(block_fits.trust[k], 0.5) << u << " " << v;
      }
    }
    EXPECT_GT(face, 50u);
    EXPECT_GT(edge, 20u);
  }
}

TEST_P(Trust, ASprayIsNot) {
  // Particles four radii apart and up to three before or behind their plane.
  Random random(5);
  std::vector<Vec3d> uvt;
  for (int j = 0; j < 12; ++j)
    for (int i = 0; i < 12; ++i)
      uvt.push_back(
          {20 + 4 * i + random(-0.5, 0.5), 20 + 4 * j + random(-0.5, 0.5), 20 + random(-3, 3)});
  const Trusted spray = trust_of(device_, place(uvt), uvt.size());
  ASSERT_EQ(spray.trust.size(), uvt.size());
  // At half trust and below, the field is what a sample shows.
  for (const double t : spray.trust) EXPECT_LE(t, 0.5);
}

TEST_P(Trust, NoFitsHaveNone) {
  EXPECT_TRUE(measure_trust(device_, {}, cells_of(device_, block(3, 3, 3))).empty());
}

MENISCUS_ON_EVERY_DEVICE(Trust);

}  // namespace
}  // namespace meniscus
