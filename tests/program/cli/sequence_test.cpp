// Sequences: which frames come out, with which camera and particle radius, and what is said of
// them.
#include <gmock/gmock.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "meniscus/camera.hpp"
#include "meniscus/io.hpp"
#include "meniscus/motion.hpp"
#include "program/cli/sequence_frames.hpp"

namespace meniscus::test {
namespace {

namespace fs = std::filesystem;
using testing::ContainsRegex;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

TEST_F(Sequence, ExtractsEveryFrameAsByItself) {
  write_sequence(4);
  const Outcome outcome = run_well(words({"--eye", "1,1,3", "--target", "0,0,0"}));
  EXPECT_EQ(outputs().size(), 12u);
  EXPECT_THAT(outcome.err, HasSubstr("4 frames 0-3"));
  EXPECT_THAT(outcome.err, HasSubstr("frame 3 done"));
  EXPECT_THAT(outcome.err, ContainsRegex("done .3 of 4.: .* write; [0-9:]+( s)? left\n"));
  EXPECT_THAT(outcome.err, ContainsRegex("done .4 of 4.: .* write\n"));  // none is left
  for (int frame = 0; frame < 4; ++frame) {
    ASSERT_EQ(run({"extract", name("d.", frame, ".ply"), "--size", "64x48", "--eye", "1,1,3",
                   "--target", "0,0,0", "-o", "single.exr"})
                  .exit_code,
              0);
    const Surface one = read_exr(path("single.exr")),
                  many = read_exr(path(name("o.", frame, ".exr")));
    EXPECT_EQ(one.depth, many.depth);
    EXPECT_EQ(one.normal, many.normal);
    EXPECT_EQ(one.group, many.group);
  }
}

TEST_F(Sequence, FramesAndCamerasAreChosen) {
  write_sequence(6);
  run_well(words({"--frames", "1-5x2,0", "-q"}));
  std::vector<std::string> pictures;
  for (const auto& [file, bytes] : outputs())
    if (file.ends_with(".png")) pictures.push_back(file);
  EXPECT_THAT(pictures, ElementsAre("o.0000.png", "o.0001.png", "o.0003.png", "o.0005.png"));

  expect_error(run({"extract", "d.####.ply", "-o", "o.####.exr", "--camera", "c.{}.json"}), 1,
               {"c.{}.json: no file matches"});
  expect_error(run({"extract", "d.###.ply", "-o", "o.####.exr"}), 1,
               {"d.###.ply: no file matches; the nearest is d.0000.ply (write {} "});
  for (const char* option : {"--log", "--report"}) {
    const Outcome refused = run(words({option, "nowhere/page.html"}));
    expect_error(refused, 1,
                 {"nowhere/page.html: cannot be written", "make the folder nowhere first"});
    EXPECT_THAT(refused.err, testing::Not(testing::HasSubstr("device"))) << "after work had begun";
  }
  fs::remove(path("d.0004.ply"));
  expect_error(run(words({"--frames", "3-5"})), 1,
               {"d.####.ply: frame 4 missing", "--missing skip"});
  const Outcome skipped = run_well(words({"--frames", "3-9", "--missing", "skip"}));
  EXPECT_THAT(skipped.err, HasSubstr("frame 4 missing and skipped"));
  EXPECT_THAT(skipped.err, HasSubstr("4 frames 6-9 left out: the sequence ends with frame 5"));
  EXPECT_THAT(run(words({"-q"})).err, HasSubstr("d.####.ply: frame 4 is missing"));
  expect_error(run(words({"--frames", "100-110"})), 1,
               {"d.####.ply: none of 11 frames 100-110 is there", "--missing skip"});
  const Outcome beyond = run_well(words({"--frames", "100-110", "--missing", "skip"}));
  EXPECT_THAT(beyond.err, HasSubstr("11 frames 100-110 left out"));
}

TEST_F(Sequence, MotionOnTheScreenIsTowardsTheNextFramesCamera) {
  for (int frame = 0; frame < 3; ++frame)
    write_particles(name("d.", frame, ".ply"), block(4), 0.1, "0 1 0");
  nlohmann::json list;
  std::vector<Camera> cameras;
  for (int frame = 0; frame < 3; ++frame) {
    const Camera camera =
        look_at({1 + 0.1 * frame, 1, 3}, {0, 0.1 * frame, 0}, {0, 1, 0}, 40, 64, 48);
    const auto rows = [](const std::array<double, 16>& m) {
      nlohmann::json matrix;
      for (int r = 0; r < 4; ++r)
        matrix.push_back({m[4 * r], m[4 * r + 1], m[4 * r + 2], m[4 * r + 3]});
      return matrix;
    };
    list.push_back({{"frame", frame},
                    {"width", 64},
                    {"height", 48},
                    {"view", rows(camera.view)},
                    {"projection", rows(camera.projection)}});
    cameras.push_back(camera);
  }
  write("c.json", list.dump());
  const std::vector<std::string> all{"extract",    "d.####.ply", "--camera", "c.json",  "-o",
                                     "o.####.exr", "--fps",      "25",       "--resume"};
  run_well(all);
  for (int frame = 0; frame < 3; ++frame) {
    const Surface surface = read_exr(path(name("o.", frame, ".exr")));
    const ScreenMotion expected =
        screen_motion(surface, cameras[static_cast<std::size_t>(std::min(frame + 1, 2))], 25);
    EXPECT_EQ(surface.forward.pixels, expected.pixels) << frame;
    EXPECT_EQ(surface.forward.frames_per_second, 25);
  }
  // What the next frame's camera is, and the rate, are part of what a frame was made with.
  EXPECT_THAT(run(all).err, HasSubstr("3 were there already"));
  list[2]["view"][0][3] = 0.5;
  write("c.json", list.dump());
  const Outcome moved = run(all);
  EXPECT_THAT(moved.err, HasSubstr("1 was there already"));
  EXPECT_THAT(moved.err, HasSubstr("; again, since o.0001.exr was made with another camera\n"));
  std::vector<std::string> other = all;
  other[7] = "24";
  EXPECT_THAT(run(other).err, HasSubstr("3 frames"));
  EXPECT_EQ(read_exr(path("o.0000.exr")).forward.frames_per_second, 24);
}

TEST_F(Sequence, SaysWhichFramesHaveNoVelocities) {
  std::string declared = "ply\nformat binary_little_endian 1.0\nelement vertex 0\n";
  for (const char* property : {"x", "y", "z", "vx", "vy", "vz"})
    declared.append("property float ").append(property).append("\n");
  write("d.0000.ply", declared + "end_header\n");
  write_particles("d.0001.ply", block(4), 0.1, "0 1 0");
  const std::string what = "the particles carry no velocities";
  const Outcome same = run_well(words());
  EXPECT_THAT(same.err, Not(HasSubstr(what)));
  const Surface empty = read_exr(path("o.0000.exr"));
  EXPECT_EQ(empty.velocity, std::vector<Vec3>(64 * 48));
  EXPECT_EQ(empty.forward.pixels.size(), 64u * 48u);

  write_particles("d.0002.ply", block(4));
  write_particles("d.0003.ply", block(4));
  const Outcome mixed = run(words({"--log", "log.jsonl"}));
  EXPECT_THAT(mixed.err, HasSubstr("meniscus: warning: 2 frames 2,3: " + what));
  EXPECT_THAT(mixed.err, HasSubstr("which other frames have"));
  for (const nlohmann::json& record : log("log.jsonl"))
    EXPECT_EQ(record["velocities"], record["frame"] < 2) << record;
  EXPECT_THAT(run(words({"--frames", "2-3"})).err, Not(HasSubstr(what)));
  EXPECT_THAT(run(words({"--frames", "2-3", "--aov", "V"})).err,
              HasSubstr("--aov V: 2 frames 2,3: " + what));
  EXPECT_THAT(run({"extract", "d.0002.ply", "--size", "64x48", "-o", "a.exr", "--aov", "V"}).err,
              HasSubstr("meniscus: warning: d.0002.ply: --aov V: " + what));
}

TEST_F(Sequence, OneFrameWithFluidSettlesCameraAndRadius) {
  write_particles("d.0000.ply", {}, 0);  // an emitter has not begun
  const double nan = std::nan("");
  write_particles("d.0001.ply", {{0, 0, 0}, {nan, 0, 0}, {3, 0, 0}, {0, 3, 0}}, 0);  // drops
  write_particles("d.0002.ply", block(7), 0);
  write_particles("d.0003.ply", block(8), 0);
  const Outcome outcome = run_well(words());
  EXPECT_THAT(outcome.err, HasSubstr("framed around the particles of d.0002.ply, d.0003.ply,"));
  EXPECT_THAT(outcome.err, HasSubstr("d.0002.ply, for all frames: no particle radius"));
  // A small block has much surface, which the estimate takes for thinner fluid.
  EXPECT_NEAR(read_exr(path("o.0003.exr")).particle_radius, 0.1, 0.02);
}

// A simulation still writes the last frame, and the last fluid has flown far.
TEST_F(Sequence, ACameraShowsTheLastFrameThatCanBeRead) {
  write_sequence(5);
  auto flown = block(4);
  for (auto& position : flown) position[0] += 20;
  write_particles("d.0004.ply", flown);
  write_particles("d.0005.ply", {});
  write("d.0006.ply", read("d.0004.ply").substr(0, 300));
  const Outcome outcome = run(words());
  EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("framed around the particles of d.0002.ply, d.0000.ply, "
                                     "d.0003.ply, d.0004.ply, 64x48"));
  EXPECT_THAT(outcome.err, Not(HasSubstr("outside the image")));
}

TEST_F(Sequence, AFrameWithoutARadiusHasThatOfTheOthers) {
  write_sequence(3);
  write_particles("d.0003.ply", {{0, 0, 0}}, 0);  // a drop
  const std::vector<std::string> all = words({"--resume"});
  const Outcome outcome = run_well(all);
  EXPECT_THAT(outcome.err, HasSubstr("frame 3: d.0003.ply: no particle radius in the file: 0.1 of "
                                     "d.0002.ply is used"));
  EXPECT_EQ(read_exr(path("o.0003.exr")).particle_radius,
            read_exr(path("o.0002.exr")).particle_radius);
  EXPECT_THAT(run(all).err, HasSubstr("4 were there already"));
  for (int frame = 0; frame < 3; ++frame)
    write_particles(name("d.", frame, ".ply"), block(3 + frame % 3), 0.2);
  run_well(all);
  EXPECT_NEAR(read_exr(path("o.0003.exr")).particle_radius, 0.2, 1e-6);
}

TEST_F(Sequence, SaysWhenTheFluidLeavesTheFramedImage) {
  write_sequence(2);
  EXPECT_THAT(run(words()).err, Not(HasSubstr("outside the image")));
  write_sequence(5);
  auto gone = block(4);
  for (std::size_t k = 0; k < 10; ++k) gone[k][0] -= 100;
  write_particles("d.0001.ply", gone);  // neither the first nor the middle nor the last
  const Outcome outcome = run(words({"--log", "log.jsonl", "--report", "page.html"}));
  const std::string what = "more than 5 % of the particles are outside the image";
  EXPECT_THAT(outcome.err, HasSubstr("frame 1: d.0001.ply: " + what));
  EXPECT_THAT(read("page.html"), HasSubstr(what));
  for (const nlohmann::json& record : log("log.jsonl"))
    EXPECT_EQ(record.dump().find(what) != std::string::npos, record["frame"] == 1) << record;
  // A camera that was given is looked at, too.
  const std::vector<std::string> eye = {"--eye", "1.5,1.5,30", "--target", "1.5,1.5,0"};
  const Outcome given = run_well(words(eye));
  EXPECT_THAT(given.err, HasSubstr("frame 1: d.0001.ply: " + what + " (expected for a close-up)"));
  // Where it sees nothing one warning is enough.
  const Outcome away = run_well(words({"--eye", "1.5,1.5,30", "--target", "1.5,1.5,60"}));
  EXPECT_THAT(away.err, HasSubstr("5 frames 0-4: no particle is in view"));
  EXPECT_THAT(away.err, Not(HasSubstr(what)));
  const Outcome others = run_well(words({eye[0], eye[1], eye[2], eye[3], "--frames", "2-4"}));
  EXPECT_THAT(others.err, Not(HasSubstr("outside the image")));
}

TEST_F(Sequence, APartWarnsOfACameraThatOtherPartsMayNotHave) {
  write_sequence(3);
  const std::string what =
      "the camera was chosen from the frames that are there now (d.0002.ply, d.0000.ply, "
      "d.0001.ply): keep it with --write-camera FILE";
  EXPECT_THAT(run(words()).err, Not(HasSubstr("chosen from the frames")));
  EXPECT_THAT(run(words({"--frames", "0-1"})).err, HasSubstr(what));
  EXPECT_THAT(run(words({"--shard", "1/2"})).err, HasSubstr(what));
  EXPECT_THAT(run(words({"--frames", "0-1", "--write-camera", "c.json"})).err,
              Not(HasSubstr("chosen from the frames")));
}

TEST_F(Sequence, LargeFramesHaveOneRadius) {
  for (const auto& [frame, scale] : {std::pair{0, 1.0f}, std::pair{1, 1.5f}}) {
    std::string bytes =
        "ply\nformat binary_little_endian 1.0\nelement vertex 262144\nproperty float x\n"
        "property float y\nproperty float z\nend_header\n";
    for (int k = 0; k < 64 * 64 * 64; ++k)
      for (const int x : {k % 64, k / 64 % 64, k / 4096}) {
        const float value = scale * static_cast<float>(x);
        bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
      }
    write(name("d.", frame, ".ply"), bytes);
  }
  const Outcome outcome = run_well(words());
  EXPECT_THAT(outcome.err, HasSubstr("d.0000.ply, for all frames: no particle radius"));
  EXPECT_EQ(read_exr(path("o.0000.exr")).particle_radius,
            read_exr(path("o.0001.exr")).particle_radius);
  // Such a frame keeps what its front is made of.
  const Outcome one = run({"extract", "d.0000.ply", "--size", "64x48", "-o", "a.png", "--timings"});
  EXPECT_THAT(one.err, HasSubstr("262,144 particles, "));
  for (const std::string& counts : {one.err, one.out}) {
    EXPECT_THAT(counts, HasSubstr("used"));
    EXPECT_THAT(counts, Not(HasSubstr("in view")));
  }
}

TEST_F(Sequence, TheBarFitsTheTerminal) {
  write_sequence(3);
  const Outcome outcome = run_on_terminal(50, words());
  EXPECT_EQ(outcome.exit_code, 0);
  const std::vector<std::string> bars = bars_in(outcome.err);
  EXPECT_GE(bars.size(), 2u) << outcome.err;
  // The first start says that it builds kernels.
  EXPECT_THAT(bars, testing::Each(testing::AllOf(
                        testing::AnyOf(testing::StartsWith("["),
                                       testing::StartsWith("building kernels, once per device")),
                        testing::SizeIs(testing::Lt(50)))));
}

}  // namespace
}  // namespace meniscus::test
