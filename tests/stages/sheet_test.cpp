// Means over sheets against a loop over all fits, on every device.
#include "stages/sheet.hpp"

#include <cmath>

#include "stages/stage_test_support.hpp"
#include "verify/reference/settle.hpp"

namespace meniscus {
namespace {

using Sheets = OnDevice;

constexpr SheetWeights kWeights{5, 0.4f, 0.6f};

struct SomeFits {
  std::vector<Vec3d> position, normal;
  std::vector<float> share;
  std::array<std::vector<float>, 2> values;
};

// Two sheets at a right angle; every fifth fit counts for nothing.
SomeFits at_random(std::size_t n) {
  Random random(7);
  const auto rounded = [](const Vec3d& v) { return Vec3d(Vec3(v)); };
  SomeFits fits;
  for (std::size_t i = 0; i < n; ++i) {
    fits.position.push_back(rounded({random(-9, 9), random(-9, 9), random(-31, -29)}));
    fits.normal.push_back(
        rounded(normalized({i % 2 ? 1.0 : 0.0, random(-0.3, 0.3), i % 2 ? 0.0 : 1.0})));
    fits.share.push_back(i % 5 == 4 ? 0 : static_cast<float>(random(0.1, 1)));
    for (std::vector<float>& value : fits.values)
      value.push_back(static_cast<float>(random(0.5, 2)));
  }
  return fits;
}

TEST_P(Sheets, MeansMatchTheReference) {
  for (const std::size_t n : {1, 63, 400}) {
    const SomeFits fits = at_random(n);
    const auto actual =
        average_on_sheets(device_, fits.position, fits.normal, fits.share, fits.values, kWeights);
    for (std::size_t k = 0; k < n; ++k)
      for (std::size_t v = 0; v < 2; ++v) {
        double sum = 0, weight = 0, off = 0;
        for (std::size_t j = 0; j < n; ++j) {
          const double l = length(fits.position[j] - fits.position[k]);
          if (l >= 5.001) continue;
          // n.n' is good to four epsilon, which a slope of 7.5 passes on, and l to as many.
          off += 50 * kEpsilon * fits.values[v][j];
          const double w = fits.share[j] * std::max(0.0, 1 - l / 5) *
                           reference::smooth_step(0.4, 0.6, dot(fits.normal[j], fits.normal[k]));
          sum += w * fits.values[v][j];
          weight += w;
        }
        if (weight < 1e-3) continue;
        const double mean = sum / weight;
        const double rounding = static_cast<double>(n + 4) * kEpsilon * mean;
        EXPECT_NEAR(actual[v][k], mean, 2 * off / weight + 2 * rounding);
      }
  }
}

TEST_P(Sheets, WhereNothingCountsTheMeanIsZero) {
  SomeFits fits = at_random(50);
  fits.share.assign(50, 0);
  for (const std::vector<float>& mean :
       average_on_sheets(device_, fits.position, fits.normal, fits.share, fits.values, kWeights))
    EXPECT_EQ(mean, std::vector<float>(50, 0));
  EXPECT_TRUE(average_on_sheets(device_, {}, {}, {}, {}, kWeights)[0].empty());
}

MENISCUS_ON_EVERY_DEVICE(Sheets);

}  // namespace
}  // namespace meniscus
