// The figures of whole frames: what is summed, and what is written.
#include "frame/measure.hpp"

#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <thread>

#include "device/device.hpp"
#include "device/memory_left.hpp"
#include "frame/process.hpp"
#include "frame/report.hpp"

namespace meniscus {
namespace {

using testing::HasSubstr;

TEST(Quantile, LiesBetweenTheTwoNearestValues) {
  EXPECT_EQ(quantile({3, 1, 2}, 0.5), 2);
  EXPECT_EQ(quantile({3, 1, 2, 4}, 0.5), 2.5);
  EXPECT_EQ(quantile({3, 1, 2}, 0), 1);
  EXPECT_EQ(quantile({3, 1, 2}, 1), 3);
  EXPECT_EQ(quantile({7}, 0.9), 7);
  EXPECT_EQ(quantile({0, 10}, 0.25), 2.5);
}

TEST(Stages, ThatRunSeveralTimesAreSummed) {
  const auto stages = sum_stages({{"blend", 2, 1, {{"a", 0.5}, {"b", 0.5}}},
                                  {"settle", 7, 0, {}},
                                  {"blend", 3, 2, {{"b", 1.5}, {"b", 0.5}}}});
  ASSERT_EQ(stages.size(), 2u);
  EXPECT_EQ(stages[0].stage, "blend");
  EXPECT_EQ(stages[0].host_ms, 5);
  EXPECT_EQ(stages[0].device_ms, 3);
  EXPECT_EQ(stages[0].kernels,
            (std::vector<std::pair<std::string, double>>{{"a", 0.5}, {"b", 2.5}}));
  EXPECT_EQ(stages[1].host_ms, 7);
}

TEST(Stages, HaveTheMedianOverFramesEachByItself) {
  const auto medians = median_stages({{{"a", 1, 9, {{"k", 3}}}, {"b", 5, 0, {}}},
                                      {{"a", 2, 8, {{"k", 1}}}, {"b", 6, 0, {}}},
                                      {{"a", 9, 1, {}}, {"c", 4, 0, {}}}});
  ASSERT_EQ(medians.size(), 3u);
  EXPECT_EQ(medians[0].host_ms, 2);
  EXPECT_EQ(medians[0].device_ms, 8);
  EXPECT_EQ(medians[0].kernels[0].second, 1);  // of 3, 1 and none
  EXPECT_EQ(medians[1].host_ms, 5);            // of 5, 6 and none
  EXPECT_EQ(medians[2].host_ms, 0);            // of 4 and twice none
}

TEST(Report, WritesWhatWasMeasured) {
  FrameFigures f;
  f.frame = "dam 015";
  f.method = "fit";
  f.particles = 35937;
  f.width = 1024;
  f.height = 768;
  f.median_ms = 123.456;
  f.frames_per_second = 9.5;
  f.stages = {{"project", 1.5, 1.25, {{"project_particles", 1.25}}}, {"split", 100, 0, {}}};
  f.device_bytes = 3 << 20;
  f.host_bytes = 1ull << 40;
  DeviceInfo device;
  device.name = "Portable \"GPU\"";
  const auto root = nlohmann::json::parse(frames_json(device, {f, f}));
  EXPECT_EQ(root["device"], device.name);
  ASSERT_EQ(root["results"].size(), 2u);
  const auto& result = root["results"][1];
  EXPECT_EQ(result["method"], "fit");
  EXPECT_EQ(result["median_ms"], 123.456);
  EXPECT_EQ(result["frames_per_second"], 9.5);
  EXPECT_EQ(result["stages"], (nlohmann::json{{"project", 1.5}, {"split", 100}}));
  EXPECT_EQ(result["device_stages"]["project"], 1.25);
  EXPECT_EQ(result["kernels"]["project"]["project_particles"], 1.25);
  EXPECT_EQ(result["device_bytes"], 3 << 20);
  EXPECT_EQ(result["host_bytes"], 1ull << 40);

  const std::string table = frames_table({f});
  EXPECT_THAT(table, HasSubstr("dam 015: 35,937 particles, 1024x768\n"));
  EXPECT_THAT(table, HasSubstr("\nfit           123"));
  EXPECT_THAT(table, HasSubstr("\nproject         1.50\n"));
  EXPECT_THAT(table, HasSubstr("\nsplit            100\n"));
  EXPECT_THAT(table, HasSubstr("\noutside stages  22.0\n"));  // 123.456 - 101.5
  f.median_ms = 80;
  EXPECT_THAT(frames_table({f}), HasSubstr("\noutside stages     -\n"))
      << "stages are measured in other frames than the median";
  EXPECT_THAT(table, HasSubstr("frames/s  cpu ms, in flight  first ms"));
}

TEST(Process, CountsTheProcessorTimeOfAllThreads) {
  const double before = processor_ms();
  std::jthread other([] {
    const double start = processor_ms();
    while (processor_ms() < start + 20) {
    }
  });
  other.join();
  EXPECT_GE(processor_ms() - before, 20);
}

TEST(Process, OtherWorkIsThatOfOthers) {
  const OtherWork other_work;
  const double start = processor_ms();
  while (processor_ms() < start + 200) {
  }
  const pid_t child = fork();
  if (child == 0)
    for (;;) {
    }
  EXPECT_GE(other_work.processors(), 0);
  const OtherWork beside_child;
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const double busy = beside_child.processors();
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_GT(busy, 0.1) << "the child, as far as it got a processor";
  EXPECT_EQ(other_work_warning(1, "times"),
            "other programs kept 1.0 processors busy: times may be off");
}

TEST(Process, PeakMemoryCountsWhatWasTouched) {
  forget_peak_memory();
  const std::uint64_t before = peak_memory();
  constexpr std::size_t kBytes = 256 << 20;
  { std::vector<char> touched(kBytes, 1); }
  EXPECT_GE(peak_memory(), before + kBytes / 2);  // half of it may have been there, and free
}

TEST(DeviceMemoryCount, FollowsBuffersAndKeepsThePeak) {
  Device device;
  const auto& memory = device.state().memory;
  EXPECT_EQ(memory->now(), 0u);
  constexpr std::size_t kMany = 1 << 20;
  {
    const Buffer<float> one = allocate<float>(device, kMany);
    const Buffer<float> same = one;  // another handle, no more memory
    EXPECT_GE(memory->now(), 4 * kMany);
    EXPECT_LT(memory->now(), 5 * kMany);
    const Buffer<float> two = allocate<float>(device, kMany);
    EXPECT_GE(memory->now(), 8 * kMany);
  }
  device.state().pool->reuse(false);
  device.state().take_times();  // waits: buffers live as long as commands use them
  EXPECT_EQ(memory_left(*memory), 0u);
  EXPECT_GE(memory->peak(), 8 * kMany);
  EXPECT_LT(memory->peak(), 9 * kMany);
}

TEST(MeasureFrame, FailsAsExtractDoes) {
  FrameInput input = synthetic_frame(1000, 64, 48);
  input.camera.width = 0;
  EXPECT_THROW(measure_frame(select_device(), input, {}, {}), InvalidArgument);
}

}  // namespace
}  // namespace meniscus
