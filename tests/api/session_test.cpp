// A device and what goes with it: the same surface, progress, cancelling.
#include "meniscus/session.hpp"

#include <gmock/gmock.h>

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "same_bits.hpp"
#include "stages/vec.hpp"

namespace meniscus {
namespace {

Particles cube(int side) {
  Particles particles;
  particles.particle_radius = 0.5;
  for (int k = 0; k < side * side * side; ++k)
    add_position(particles, Vec3d(k % side, k / side % side, k / side / side));
  return particles;
}

class ASession : public testing::Test {
 protected:
  Session session_;
  const Particles particles_ = cube(12);
  const Camera camera_ = frame_particles(particles_, {.width = 96, .height = 72});
};

TEST_F(ASession, GivesWhatExtractGivesAndTellsOfEachStage) {
  Device device;
  std::vector<StageTime> timings;
  const Surface expected = extract(device, particles_, camera_, {}, &timings);
  std::vector<std::string> stages, timed;
  Session::Settings settings;
  settings.progress = [&](const std::string& stage) { stages.push_back(stage); };
  EXPECT_TRUE(same_bits(session_.extract(particles_, camera_, {}, settings), expected));
  EXPECT_TRUE(same_bits(session_.extract(*source_of(particles_), camera_), expected));
  for (const StageTime& time : timings)
    if (time.stage != "build kernels") timed.push_back(time.stage);
  EXPECT_EQ(stages, timed);
  EXPECT_EQ(session_.device().name, device.info().name);
}

TEST_F(ASession, EndsWhenItIsCancelledAndGoesOnAfterwards) {
  const Surface expected = session_.extract(particles_, camera_);
  session_.cancel();  // nothing is under way: this is for nobody
  EXPECT_TRUE(same_bits(session_.extract(particles_, camera_), expected));

  std::vector<std::string> stages;
  Session::Settings settings;
  settings.progress = [&](const std::string& stage) {
    stages.push_back(stage);
    if (stages.size() == 3) std::thread([&] { session_.cancel(); }).join();
  };
  EXPECT_THROW(session_.extract(particles_, camera_, {}, settings), Cancelled);
  EXPECT_EQ(stages.size(), 3u);
  EXPECT_TRUE(same_bits(session_.extract(particles_, camera_), expected));
}

TEST_F(ASession, PassesOnWhatProgressThrows) {
  Session::Settings settings;
  settings.progress = [](const std::string&) { throw 7; };
  EXPECT_THROW(session_.extract(particles_, camera_, {}, settings), int);
  EXPECT_NO_THROW(session_.extract(particles_, camera_));
}

// It waited for its own turn to end.
TEST_F(ASession, RefusesToExtractWithinProgress) {
  Session::Settings settings;
  settings.progress = [&](const std::string&) { session_.extract(particles_, camera_); };
  EXPECT_THROW(session_.extract(particles_, camera_, {}, settings), InvalidArgument);
  EXPECT_NO_THROW(session_.extract(particles_, camera_));
}

TEST_F(ASession, ServesThreadsInTurn) {
  const Surface expected = session_.extract(particles_, camera_);
  std::atomic<int> same{0};
  std::vector<std::thread> threads;
  for (int k = 0; k < 3; ++k)
    threads.emplace_back(
        [&] { same += same_bits(session_.extract(particles_, camera_), expected); });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(same, 3);
}

TEST_F(ASession, RefusesWhatExtractRefuses) {
  EXPECT_THROW(session_.extract(particles_, Camera{}), InvalidArgument);
  Parameters wrong;
  wrong.fit.support = -1;
  EXPECT_THROW(session_.extract(particles_, camera_, wrong), InvalidArgument);
  Session::Settings settings;
  settings.memory = 10;
  EXPECT_THROW(session_.extract(cube(65), camera_, {}, settings), InvalidArgument);
  EXPECT_THROW(Session("no such device"), DeviceError);
}

}  // namespace
}  // namespace meniscus
