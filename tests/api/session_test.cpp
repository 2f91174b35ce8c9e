// A device and what goes with it: the same surface, progress, cancelling.
#include "meniscus/session.hpp"

#include <gmock/gmock.h>

#include <atomic>
#include <cmath>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "prepare/fill.hpp"
#include "same_bits.hpp"
#include "stages/vec.hpp"
#include "texts.hpp"

namespace meniscus {
namespace {

Particles block(int nx, int ny, int nz) {
  Particles particles;
  particles.particle_radius = 0.5;
  for (int k = 0; k < nx * ny * nz; ++k)
    add_position(particles, Vec3d(k % nx, k / nx % ny, k / nx / ny));
  return particles;
}
Particles cube(int side) { return block(side, side, side); }

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

// All ways in: in memory, streamed, streamed and thinned, and without a camera in memory, in one
// part and in many.
struct WayIn {
  const char* name;
  Particles particles;
  const char* stage;  // that tells it from the others
  std::function<Surface(Session&, const Particles&, const Camera&, const Parameters&,
                        const Session::Settings&)>
      extract;
};

std::vector<WayIn> ways_in() {
  const auto seen = [](Session& session, const Particles& particles, const Camera& camera,
                       const Parameters& parameters, const Session::Settings& settings) {
    return session.extract(particles, camera, parameters, settings);
  };
  const auto closed_in = [](std::size_t memory) {
    return [memory](Session& session, const Particles& particles, const Camera&,
                    const Parameters& parameters, const Session::Settings& settings) {
      return session.extract_closed(particles, {.cell = 4, .memory = memory}, parameters, settings);
    };
  };
  constexpr std::size_t kAll = std::size_t{1} << 30, kSome = std::size_t{1} << 26;
  const Particles large = block(400, 26, 26);
  return {{"in memory", cube(12), "order", seen},
          {"streamed", large, "select", seen},
          {"thinned", large, "thin", seen},
          {"closed in memory", cube(12), "order", closed_in(kAll)},
          {"closed", large, "survey", closed_in(kAll)},
          {"closed in parts", large, "survey", closed_in(kSome)}};
}

Camera camera_for(const WayIn& way) {
  return frame_particles(way.particles, {.width = 96, .height = 72});
}

Parameters of_radius(const WayIn& way, double radius) {
  Parameters parameters;
  parameters.particle_radius = radius;
  parameters.mesh = false;
  if (std::string(way.name) == "streamed") parameters.thin = 0;
  return parameters;
}

TEST_F(ASession, TellsThatTheRadiusDoesNotFitBeforeAllOtherWork) {
  struct Enough {};
  for (const WayIn& way : ways_in())
    for (const double radius : {0.05, 5.0}) {
      SCOPED_TRACE(testing::Message() << way.name << ", radius " << radius);
      std::vector<std::string> stages;
      std::vector<Notice> told;
      Session::Settings settings;
      settings.progress = [&](const std::string& stage) { stages.push_back(stage); };
      settings.on_notice = [&](const Notice& notice) {
        told.push_back(notice);
        throw Enough();
      };
      EXPECT_THROW(
          way.extract(session_, way.particles, camera_for(way), of_radius(way, radius), settings),
          Enough);
      ASSERT_EQ(told.size(), 1u);
      EXPECT_EQ(told[0].code, radius < 1 ? Code::radius_too_small : Code::radius_too_large);
      const bool streams = static_cast<std::int64_t>(way.particles.size()) >= kStreamed;
      EXPECT_THAT(stages, testing::ElementsAre(streams ? "survey" : "order"));
    }
  EXPECT_NO_THROW(session_.extract(particles_, camera_));
}

TEST_F(ASession, TellsOfEachNoticeOnceWithTheThreadThatExtracts) {
  for (const WayIn& way : ways_in()) {
    SCOPED_TRACE(way.name);
    Particles particles = way.particles;
    particles.x[7] = NAN;
    particles.vx.assign(particles.size(), 1);
    particles.vy = particles.vz = particles.vx;
    particles.vx[9] = INFINITY;
    for (int k = 0; k < 40; ++k) {  // a crowd
      add_position(particles, {1.25f, 1.25f, 1.25f});
      for (std::vector<float>* v : {&particles.vx, &particles.vy, &particles.vz}) v->push_back(1);
    }
    const Camera camera = camera_for(way);
    std::vector<Notice> told;
    std::multiset<std::string> stages;
    Session::Settings settings;
    settings.on_notice = [&](const Notice& notice) { told.push_back(notice); };
    settings.progress = [&](const std::string& stage) { stages.insert(stage); };
    const Surface surface = way.extract(session_, particles, camera, of_radius(way, 1), settings);
    EXPECT_GT(stages.count(way.stage), 0u);
    EXPECT_EQ(stages.count("order") > 1, std::string(way.name) == "closed in parts");
    std::set<Code> codes;
    for (const Notice& notice : surface.notices) codes.insert(notice.code);
    EXPECT_EQ(texts(told), texts(surface.notices));
    EXPECT_EQ(codes.size(), told.size());
    EXPECT_TRUE(codes.contains(Code::not_finite) && codes.contains(Code::radius_too_large));
    if (way.particles.size() > 5000) continue;
    way.extract(session_, particles, camera, of_radius(way, 1), {});  // nobody listens any more
    EXPECT_EQ(told.size(), surface.notices.size());
  }
}

TEST_F(ASession, TellsOfWhatWasKnownOfAFrameThatThenFails) {
  Particles particles = particles_;
  particles.x[7] = NAN;
  std::vector<Notice> told;
  Session::Settings settings;
  settings.on_notice = [&](const Notice& notice) { told.push_back(notice); };
  settings.progress = [](const std::string& stage) {
    if (stage != "order") throw 7;
  };
  EXPECT_THROW(session_.extract(particles, camera_, {}, settings), int);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].code, Code::not_finite);
  EXPECT_THROW(session_.extract(particles, camera_, {}, settings), int);
  EXPECT_EQ(told.size(), 2u);  // of another frame
}

TEST_F(ASession, TellsOfWhitewater) {
  Surface surface = session_.extract(particles_, camera_);
  Particles foam = cube(3);
  foam.y[5] = NAN;
  std::vector<Notice> told;
  Session::Settings settings;
  settings.on_notice = [&](const Notice& notice) { told.push_back(notice); };
  const auto source = source_of(foam);
  session_.draw_whitewater({{.type = WhitewaterType::foam, .particles = source.get()}}, {}, surface,
                           settings);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_THAT(to_string(told[0]), testing::StartsWith("foam: 1 of 27 particles have NaN"));
  EXPECT_EQ(texts(told), texts(surface.notices));
}

// It waited for its own turn to end.
TEST_F(ASession, RefusesToExtractWithinProgress) {
  Session::Settings settings;
  settings.progress = [&](const std::string&) { session_.extract(particles_, camera_); };
  EXPECT_THROW(session_.extract(particles_, camera_, {}, settings), InvalidArgument);
  EXPECT_NO_THROW(session_.extract(particles_, camera_));
}

TEST_F(ASession, RefusesToExtractWithinOnNotice) {
  Session::Settings settings;
  settings.on_notice = [&](const Notice&) { session_.extract(particles_, camera_); };
  try {
    session_.extract(particles_, camera_, of_radius(ways_in()[0], 2), settings);
    ADD_FAILURE() << "nothing was thrown";
  } catch (const InvalidArgument& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("on_notice calls extract"));
  }
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
