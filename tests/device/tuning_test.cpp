// What was measured to be fastest is what devices are opened with, and changes no bit.
#include "device/tuning.hpp"

#include <gmock/gmock.h>

#include <cstdlib>

#include "base/content_hash.hpp"
#include "device/device.hpp"
#include "frame/tune.hpp"
#include "io/temporary_folder.hpp"
#include "meniscus/extract.hpp"
#include "verify/scenes.hpp"

namespace meniscus {
namespace {

class Tunings : public testing::Test {
 protected:
  Tunings() { setenv("MENISCUS_CACHE_DIR", (folder_ / "cache").c_str(), 1); }
  ~Tunings() override { unsetenv("MENISCUS_CACHE_DIR"); }

  DeviceInfo info_ = select_device("");

 private:
  TemporaryFolder folder_;
};

TEST_F(Tunings, AreKeptForADeviceAndItsDriver) {
  EXPECT_EQ(tuning_of(info_), default_tuning(info_));
  const Tuning chosen{1, 16, DiscForm::minima};
  ASSERT_TRUE(keep_tuning(info_, chosen));
  EXPECT_EQ(tuning_of(info_), chosen);
  DeviceInfo updated = info_;
  updated.driver += ".1";
  EXPECT_EQ(tuning_of(updated), default_tuning(updated));
  forget_tuning(info_);
  EXPECT_EQ(tuning_of(info_), default_tuning(info_));
}

TEST_F(Tunings, AreWhatADeviceIsOpenedWith) {
  const verify::Scene& scene = verify::kernel_scenes().front();
  const auto extracted = [&] {
    Device device(info_);
    return content_hash(extract(device, scene.particles, scene.camera));
  };
  const std::uint64_t usual = extracted();
  for (const Tuning& tuning : {Tuning{1, 16}, Tuning{8, 256}, Tuning{8, 64, DiscForm::minima}}) {
    ASSERT_TRUE(keep_tuning(info_, tuning));
    Device device(info_);
    EXPECT_EQ(device.state().vector_width, tuning.vector_width);
    EXPECT_EQ(device.state().row_group, tuning.group);
    EXPECT_EQ(device.state().discs, tuning.discs);
    EXPECT_EQ(extracted(), usual) << to_string(tuning);
  }
}

TEST_F(Tunings, ThatCannotBeUsedAreNot) {
  for (const Tuning& wrong : {Tuning{3, 64}, Tuning{8, 48}, Tuning{8, 0}, Tuning{8, 4096}}) {
    ASSERT_TRUE(keep_tuning(info_, wrong));
    EXPECT_EQ(tuning_of(info_), default_tuning(info_)) << to_string(wrong);
  }
}

TEST_F(Tunings, AreMeasured) {
  const verify::Scene& scene = verify::kernel_scenes().front();
  FrameInput frame;
  frame.particles = scene.particles;
  frame.camera = scene.camera;
  const TuningRun run = tune(info_, frame, 2, [](const std::string&) {});
  ASSERT_GE(run.trials.size(), 4u);
  EXPECT_NE(run.trials[2].tuning.discs, run.trials[0].tuning.discs);
  EXPECT_EQ(run.trials[0].tuning, default_tuning(info_));
  bool found = false;
  for (const Trial& trial : run.trials) {
    EXPECT_EQ(trial.error, "");
    EXPECT_TRUE(trial.same_bits) << to_string(trial.tuning);
    EXPECT_GT(trial.ms, 0);
    found = found || trial.tuning == run.best;
  }
  EXPECT_TRUE(found);
}

}  // namespace
}  // namespace meniscus
