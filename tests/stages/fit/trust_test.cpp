// Which fits are trusted, against loops over all of them, on every device.
#include "stages/fit/trust.hpp"

#include <algorithm>
#include <utility>

#include "stages/sheet/surface_by_hand.hpp"
#include "verify/reference/trust.hpp"

namespace meniscus {
namespace {

using Trust = OnDevice;

DeviceCells cells_of(Device& device, const Projected& p) {
  return upload_cells(device, make_cells(p.x, p.y, p.z, kDensitySupport));
}

// Fits that nothing but their trust is asked of, and what decides about them at random.
ParticleFits at_random(std::size_t n, unsigned seed) {
  Random random(seed);
  ParticleFits fits;
  fits.position.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    fits.supporters.push_back(i % 2 == 0 ? random(4, 25) : random(25, 100));
    fits.roundness.push_back(i % 5 == 0 ? random(0, 1) : 0);
    fits.residual.push_back(i % 7 == 6 ? -1 : 0.1f);
    fits.dense.push_back(static_cast<float>(random(0.22, 0.5)));
    fits.deep.push_back(static_cast<float>(random(0.4, 1)));
    fits.apart.push_back(static_cast<float>(random(0.1, 0.8)));
    fits.spread.push_back(random(0.5, 1));
    fits.firmness.push_back(i % 3 == 0 ? random(0, 1) : 1);
  }
  return fits;
}

TEST(TrustOfFits, MatchesItsDefinition) {
  const ParticleFits fits = at_random(400, 2);
  const std::vector<double> actual = trust_of(fits);
  ASSERT_EQ(actual.size(), fits.size());
  std::size_t between = 0, thin = 0, sheets = 0, bevels = 0;
  for (std::size_t k = 0; k < fits.size(); ++k) {
    if (fits.residual[k] < 0) {
      EXPECT_EQ(actual[k], 0);
      continue;
    }
    const double apart = fits.apart[k];
    const double sheet = (1 - fits.roundness[k]) * smooth_step(40, 80, fits.supporters[k]) *
                         (1 - smooth_step(0.25, 0.4, apart));
    const double thick = smooth_step(0.5, 0.8, fits.deep[k]);
    thin += thick < 0.9;
    sheets += thick < 0.9 && sheet > 0.1;
    const double bevel = (1 - fits.firmness[k]) * smooth_step(0.75, 0.85, fits.spread[k]);
    bevels += bevel > 0.1;
    const double expected =
        (1 - (1 - thick) * (1 - sheet)) * smooth_step(0.24, 0.33, fits.dense[k]) *
        (1 - smooth_step(0.45, 0.75, apart)) * (1 - 0.01 * smooth_step(0.3, 0.4, apart)) *
        smooth_step(5, 12, fits.supporters[k]) * (1 - bevel);
    between += expected > 0.01 && expected < 0.99;
    EXPECT_NEAR(actual[k], expected, 1e-14) << k;  // products of a few numbers up to 1
  }
  EXPECT_GT(between, fits.size() / 4);
  EXPECT_GT(thin, fits.size() / 8);
  EXPECT_GT(sheets, fits.size() / 32);
  EXPECT_GT(bevels, fits.size() / 16);
}

// What is known of the fits of the first `seen` particles and of the rim.
ParticleFits measured(Device& device, const Projected& p, std::size_t seen) {
  const FoundSurface found = surface_of(device, p, seen);
  const Visible rim = with_rim(p, found.seen, found.field);
  const FitNeighbours neighbours =
      find_neighbours(device, p, rim, found.surface.index, fit_reach({}));
  DeviceFits fits = make_fits(device, upload_surface(device, p, found.surface), p, rim,
                              found.surface, neighbours, {});
  measure_surroundings(device, cells_of(device, p), fits);
  return download(device, std::move(fits));
}

TEST_P(Trust, SurroundingsAreMeansOverSheets) {
  for (const int width : {1, 8}) {
    use_width(width);
    const Projected p = block(14, 12, 3, 0.3);
    const ParticleFits fits = measured(device_, p, 14 * 12);
    const auto expected = reference::surroundings_of(p, fits);
    ASSERT_EQ(fits.dense.size(), fits.size());
    for (std::size_t k = 0; k < fits.size(); ++k) {
      const auto& [dense, deep, apart] = expected[k];
      if (dense.weight < 1e-3) continue;  // next to nothing may be nothing in floats
      EXPECT_NEAR(fits.dense[k], dense.mean, dense.error) << k;
      EXPECT_NEAR(fits.deep[k], deep.mean, deep.error) << k;
      EXPECT_NEAR(fits.apart[k], apart.mean, apart.error) << k;
    }
  }
}

struct Trusted {
  ParticleFits fits;
  std::vector<double> trust;
};

Trusted trusted(Device& device, const Projected& p, std::size_t seen) {
  Trusted result{measured(device, p, seen), {}};
  result.trust = trust_of(result.fits);
  return result;
}

// Distance of a fit from the rim of the face of block(nu, nv, .), particle radii.
double rim_distance(const Vec3d& p, int nu, int nv) {
  const double u = p.x + 50 - 10, v = 50 - p.y - 10;
  return std::min({u, 2.0 * (nu - 1) - u, v, 2.0 * (nv - 1) - v});
}

TEST_P(Trust, ABlockIsTrustedOnItsFaceAndAlongItsEdges) {
  for (const double rough : {0.0, 0.3}) {
    const Trusted block_fits = trusted(device_, block(20, 20, 8, rough), 20 * 20);
    std::size_t face = 0, edge = 0;
    for (std::size_t k = 0; k < block_fits.fits.size(); ++k) {
      if (!(block_fits.fits.visible[k] == 1)) continue;
      const Vec3d& p = block_fits.fits.position[k];
      const double u = p.x + 40, v = 40 - p.y;
      const bool corner = std::min(u, 38 - u) < 8 && std::min(v, 38 - v) < 8;
      // Bevels of its edges are not.
      const bool bevel = block_fits.fits.firmness[k] < 0.1 && block_fits.fits.spread[k] > 0.75;
      if (corner || bevel) continue;
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
  const Trusted spray = trusted(device_, place(uvt), uvt.size());
  ASSERT_EQ(spray.trust.size(), uvt.size());
  // At half trust and below, the field is what a sample shows.
  for (const double t : spray.trust) EXPECT_LE(t, 0.5);
}

TEST_P(Trust, NoFitsHaveNone) {
  const Projected p = block(3, 3, 3);
  const FitNeighbours none = find_neighbours(device_, p, {}, {}, 5);
  DeviceFits fits = make_fits(device_, {}, p, {}, {}, none, {});
  measure_surroundings(device_, cells_of(device_, p), fits);
  EXPECT_TRUE(trust_of(download(device_, std::move(fits))).empty());
}

// Fits whose feet lie at random around a face, so that before them there is air, fluid or some of
// it.
TEST_P(Trust, FitsBeforeFluidHaveNone) {
  const Projected p = block(14, 12, 4, 0.3);
  Random random(3);
  ParticleFits fits;
  std::vector<Vec3d> before;
  std::vector<std::uint32_t> asked;
  for (std::uint32_t k = 0; k < 300; ++k) {
    const Vec3d inside = p.eye(static_cast<std::size_t>(random(0, 14 * 12)));
    fits.foot.push_back(inside + Vec3d{0, 0, random(-4, 4)});
    fits.normal.push_back(normalized({random(-1, 1), random(-1, 1), random(-1, 1)}));
    if (k % 4 == 0) continue;
    asked.push_back(k);
    before.push_back(fits.foot[k] + fits.normal[k] * 1.5);
  }
  const DeviceCells cells = cells_of(device_, p);
  const std::vector<float> density = measure_density(device_, cells, before);
  for (const double disorder : {0.0, 1.0, 2.0}) {
    std::vector<double> trust(300, 0.8), expected = trust;
    distrust_gaps(device_, cells, fits, asked, disorder, trust);
    const double low = disorder == 0 ? 0.55 : disorder == 1 ? 0.375 : 0.2;
    std::size_t between = 0;
    for (std::size_t a = 0; a < asked.size(); ++a) {
      expected[asked[a]] *= 1 - smooth_step(low, low + 0.2, density[a]);
      between += expected[asked[a]] > 0.01 && expected[asked[a]] < 0.79;
    }
    EXPECT_GT(between, 10u);
    for (std::size_t k = 0; k < trust.size(); ++k) EXPECT_NEAR(trust[k], expected[k], 1e-14) << k;
  }
}

MENISCUS_ON_EVERY_DEVICE(Trust);

}  // namespace
}  // namespace meniscus
