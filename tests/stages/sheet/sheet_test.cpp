// Means over sheets where nothing counts, on every device; others are compared with a loop over all
// fits in References.EveryStageIsWithinItsBounds.
#include "verify/stage_cases/sheet.hpp"

#include "stages/stage_test_support.hpp"

namespace meniscus {
namespace {

using Sheets = OnDevice;

constexpr SheetWeights kWeights{5, 0.4f, 0.6f};

TEST_P(Sheets, WhereNothingCountsTheMeanIsZero) {
  const std::vector<Vec3d> position(50, Vec3d{1, 2, -30}), normal(50, Vec3d{0, 0, 1});
  const std::vector<float> value(50, 1);
  for (const std::vector<float>& mean : average_on_sheets(
           device_, position, normal, std::vector<float>(50, 0), {value, value, value}, kWeights))
    EXPECT_EQ(mean, std::vector<float>(50, 0));
  EXPECT_TRUE(average_on_sheets(device_, {}, {}, {}, {{}}, kWeights).at(0).empty());
}

MENISCUS_ON_EVERY_DEVICE(Sheets);

}  // namespace
}  // namespace meniscus
