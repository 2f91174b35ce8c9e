// Every kernel, measured for a moment on a tiny frame.
#include "kernels/measure.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "bench/made_up.hpp"
#include "kernels/workers.hpp"
#include "stages/stage_test_support.hpp"

namespace meniscus::bench {
namespace {

MeasureOptions tiny() {
  MeasureOptions options;
  options.particles = {700};  // no multiple of any work-group
  options.width = 91;
  options.height = 67;
  options.repetitions = 2;
  options.seconds = 0;
  options.probes = {{1 << 14}, 1 << 10, 1, 1, 0};
  return options;
}

using Measure = OnDevice;

TEST_P(Measure, EveryKernelHasATimeAndItsNativeVersionAgreesBitForBit) {
  const bool cpu = device_.info().kind == DeviceKind::cpu;
  std::vector<std::string> said;
  const Session session =
      measure(device_, cpu ? 2 : 0, tiny(), [&](const std::string& what) { said.push_back(what); });
  const std::vector<std::string> names = kernel_names();
  EXPECT_EQ(said.size(), 2 + names.size());
  EXPECT_EQ(said.back(), "the roofline again");
  EXPECT_GT(session.processors, 0);
  EXPECT_GT(session.roofline.empty_kernel_us, 0);
  for (const std::string& name : names) {
    const Result* const result = session.find(name, kDevice, 700, 91, 67);
    ASSERT_NE(result, nullptr) << name;
    EXPECT_EQ(result->note, "") << name;
    ASSERT_GE(result->ms.size(), 2u) << name;
    EXPECT_GT(result->best_ms(), 0) << name;
    EXPECT_GT(result->items, 0) << name;
    EXPECT_GT(result->bytes, 0) << name;
    EXPECT_FALSE(result->unit.empty()) << name;
    const Share share = share_of_roofline(*result, session.roofline);
    EXPECT_EQ(share.counted(), result->operations > 0 && !result->whole_stage) << name;
    EXPECT_EQ(share.value > 0, share.counted()) << name;
    EXPECT_TRUE(std::isfinite(share.value)) << name;
    EXPECT_EQ(result->whole_stage, name.find("_by_") != std::string::npos) << name;
  }
  for (const char* hot : {"fit_particles", "blend_groups", "follow_field"})
    EXPECT_EQ(session.find(hot, kNative, 700, 91, 67) != nullptr, cpu) << hot;
}

TEST_P(Measure, KernelsAreChosenByPartsOfTheirNames) {
  MeasureOptions options = tiny();
  options.kernels = {"fit_par", "gradients"};
  options.particles = {300, 700};
  const Session session = measure(device_, 0, options, [](const std::string&) {});
  ASSERT_EQ(session.results.size(), 4u);
  EXPECT_EQ(session.results[0].kernel, "measure_gradients");
  EXPECT_EQ(session.results[3].kernel, "fit_particles");
  options.kernels = {"polish"};
  EXPECT_THROW(measure(device_, 0, options, [](const std::string&) {}), InvalidArgument);
}

MENISCUS_ON_EVERY_DEVICE(Measure);

TEST(Workers, DoEveryItemOnceRoundAfterRound) {
  for (const int threads : {1, 2, 5}) {
    Workers workers(threads);
    for (const std::size_t count : {0u, 1u, 63u, 1000u}) {
      std::vector<int> times(count, 0);
      workers.run(count, 7, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) ++times[k];
      });
      EXPECT_THAT(times, testing::Each(1)) << threads << " threads, " << count << " items";
    }
  }
}

}  // namespace
}  // namespace meniscus::bench
