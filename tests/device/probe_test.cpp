// The roofline probes.
#include "device/probe.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "stages/stage_test_support.hpp"

namespace meniscus {
namespace {

ProbeEffort little() { return {{1 << 14, 1 << 16}, 1 << 10, 1, 2, 0}; }

using Probe = OnDevice;

TEST_P(Probe, EveryFigureIsPositiveAndFinite) {
  const Roofline roofline = measure_roofline(device_, little());
  // And one that no cache holds, where the device has memory of its own.
  ASSERT_EQ(roofline.copy.size(), device_.state().is_in_place() ? 2u : 3u);
  EXPECT_EQ(roofline.copy[0].bytes, 1 << 14);  // as asked: whole work-groups
  EXPECT_EQ(roofline.copy[1].bytes, 1 << 16);
  for (const double figure :
       {roofline.copy[0].gb_per_s, roofline.copy[1].gb_per_s, roofline.fused_gflops,
        roofline.plain_gflops, roofline.launch_us, roofline.batched_launch_us,
        roofline.empty_kernel_us, roofline.spread_atomics, roofline.contended_atomics}) {
    EXPECT_GT(figure, 0);
    EXPECT_TRUE(std::isfinite(figure));
  }
  EXPECT_TRUE(device_.state().events.empty());  // what it launched is not left for others to count
}

TEST_P(Probe, CopiesAndLowersWhatItSays) {
  for (const int width : {1, 8}) {
    std::vector<float> values(1024);
    for (std::size_t k = 0; k < values.size(); ++k) values[k] = static_cast<float>(k);
    const auto from = upload(device_, values), to = filled<float>(device_, values.size(), 0.0f);
    launch(device_, "probe.cl", "copy_values", {1024u / static_cast<unsigned>(std::max(width, 4))},
           width_option(width), from, to);
    EXPECT_EQ(download(device_, to), values) << width;

    // a -> a/2 + 1 leaves 2 as it is and brings k to 2 + (k - 2) / 2^16 in a round.
    const auto sums = filled<float>(device_, 1024, 0.0f);
    launch(device_, "probe.cl", "fuse_multiply_add", {1024u / static_cast<unsigned>(width)},
           width_option(width), sums, cl_int{8}, 0.5f, 1.0f);
    EXPECT_THAT(download(device_, sums), testing::Each(16.0f)) << width;
    // Products with 1 and sums with 0 leave 2 (0 + 1 + ... + 5).
    launch(device_, "probe.cl", "multiply_and_add", {1024u / static_cast<unsigned>(width)},
           width_option(width), sums, cl_int{8}, 1.0f, 0.0f);
    EXPECT_THAT(download(device_, sums), testing::Each(30.0f)) << width;
  }
  const auto words = filled<cl_uint>(device_, 128, 0xffffffffu);
  launch(device_, "probe.cl", "lower_words", {128}, "", words, cl_uint{0});
  const std::vector<cl_uint> lowered = download(device_, words);
  EXPECT_EQ(lowered[0], 0x7fffffffu - 127);
  EXPECT_EQ(lowered[1], 0xffffffffu);
}

TEST(Roofline, BandwidthLiesBetweenTheSizesMeasured) {
  Roofline roofline;
  EXPECT_EQ(roofline.bandwidth(1), 0);
  roofline.copy = {{1024, 80}, {4096, 40}, {65536, 20}};
  EXPECT_EQ(roofline.bandwidth(1), 80);
  EXPECT_EQ(roofline.bandwidth(1024), 80);
  EXPECT_DOUBLE_EQ(roofline.bandwidth(2048), 60);  // half way on a logarithmic scale
  EXPECT_DOUBLE_EQ(roofline.bandwidth(16384), 30);
  EXPECT_EQ(roofline.bandwidth(1e9), 20);
}

MENISCUS_ON_EVERY_DEVICE(Probe);

}  // namespace
}  // namespace meniscus
