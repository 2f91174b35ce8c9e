// Programs are built once, and ahead of whoever needs them.
#include "device/building.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <thread>
#include <vector>

#include "device/device.hpp"
#include "io/temporary_folder.hpp"

namespace meniscus {
namespace {

const ProgramName kProgram{"probe.cl", "-D WIDTH=1"};

class Building : public testing::Test {
 protected:
  Building() { setenv("MENISCUS_CACHE_DIR", (folder_ / "cache").c_str(), 1); }
  ~Building() override { unsetenv("MENISCUS_CACHE_DIR"); }

  static bool is_copied(Device& device) {
    const auto from = filled<float>(device, 512, 3.0f), to = filled<float>(device, 512, 0.0f);
    launch(device, kProgram.file, "copy_values", {128}, kProgram.options, from, to);
    return download(device, to) == std::vector<float>(512, 3.0f);
  }

 private:
  TemporaryFolder folder_;
};

TEST(BuildTurn, IsOneThreadsAtATime) {
  std::atomic<int> inside = 0, most = 0;
  {
    std::vector<std::jthread> threads;
    for (int k = 0; k < 4; ++k)
      threads.emplace_back([&] {
        for (int round = 0; round < 200; ++round) {
          BuildTurn turn("key");
          const int now = ++inside;
          if (now > most) most = now;
          std::this_thread::yield();
          --inside;
        }
      });
  }
  EXPECT_EQ(most, 1);
  EXPECT_FALSE(was_built_here("key"));
  BuildTurn("key").built();
  EXPECT_TRUE(was_built_here("key"));
}

TEST_F(Building, IsToldUnlessACacheHasTheProgram) {
  Device device;
  if (device.state().keeps == Keeps::nothing) GTEST_SKIP() << "keeps no programs";
  int told = 0;
  device.state().on_building = [&](int programs) { told = programs; };
  EXPECT_FALSE(device.state().is_kept(kProgram.file, kProgram.options));
  device.state().program(kProgram.file, kProgram.options);
  device.state().program(kProgram.file, kProgram.options);
  EXPECT_EQ(told, 1);
  EXPECT_TRUE(device.state().is_kept(kProgram.file, kProgram.options));
  device.state().program("specks.cl", "-D WIDTH=8");
  EXPECT_EQ(told, 2);
}

TEST_F(Building, TakesTimeThatIsNoStages) {
  Device device;
  EXPECT_TRUE(is_copied(device));
  EXPECT_GT(device.state().take_building_ms(), 0);
  EXPECT_EQ(device.state().take_building_ms(), 0);
  EXPECT_TRUE(is_copied(device));
  EXPECT_EQ(device.state().take_building_ms(), 0);  // built once
}

TEST_F(Building, AheadLeavesProgramsInTheCache) {
  Device device;
  if (!device.state().compiles_at_launch) GTEST_SKIP() << "builds nothing ahead on this platform";
  const std::vector<ProgramName> programs{
      kProgram, {"visible.cl", "-D WIDTH=8"}, {"specks.cl", "-D WIDTH=8"}};
  { BuildAhead ahead(device, {programs[0]}); }
  // A destructor begins no other build, so look until the first one is there.
  {
    BuildAhead ahead(device, programs);
    while (!device.state().is_kept(kProgram.file, kProgram.options))
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(is_copied(device));
}

}  // namespace
}  // namespace meniscus
