// Which frames of a sequence --resume makes again.
#include <gmock/gmock.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "program/cli/sequence_frames.hpp"

namespace meniscus::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

TEST_F(Sequence, ResumeRedoesWhatIsNotWhole) {
  write_sequence(6);
  run_well(words({"-q", "--log", "log.jsonl"}));
  const auto before = outputs();
  fs::remove(path("o.0001.png"));                                // missing
  write("o.0002.exr", before.at("o.0002.exr").substr(0, 2000));  // cut off
  std::string flipped = before.at("o.0003.ply");
  flipped[flipped.size() - 5] ^= 1;
  write("o.0003.ply", flipped);
  write("o.0004.png", before.at("o.0005.png"));  // whole, but another frame's
  const Outcome outcome = run_well(words({"--resume", "--log", "log.jsonl"}));
  EXPECT_THAT(outcome.err, HasSubstr("4 frames in"));
  EXPECT_THAT(outcome.err, HasSubstr("2 were there already"));
  EXPECT_EQ(outputs(), before);
  EXPECT_EQ(log("log.jsonl").size(), 12u);
  for (const char* why :
       {"; again, since o.0001.png is missing", "; again, since o.0002.exr is cut off or damaged",
        "; again, since o.0003.ply is cut off or damaged",
        "; again, since o.0004.png was made from another input\n"})
    EXPECT_THAT(outcome.err, HasSubstr(why));
  for (const nlohmann::json& record : log("log.jsonl")) {
    if (!record.contains("again")) continue;
    EXPECT_THAT(record["again"].get<std::string>(), HasSubstr("o.000"));
  }

  const Outcome again = run(words({"--resume"}));
  EXPECT_THAT(again.err, HasSubstr("6 were there already"));
  const Outcome other = run(words({"--resume", "--support", "9"}));  // other parameters
  EXPECT_THAT(other.err, HasSubstr("6 frames in")) << other.err;
  EXPECT_THAT(other.err, HasSubstr("; again, since o.0000.exr was made with other parameters\n"));
  run_well(words({"--resume", "-q"}));
  EXPECT_EQ(outputs(), before);

  // A newer input.
  fs::last_write_time(path("d.0002.ply"), fs::file_time_type::clock::now() + std::chrono::hours(1));
  EXPECT_THAT(run(words({"--resume"})).err, HasSubstr("5 were there already"));
}

TEST_F(Sequence, ResumeRedoesWhatWasMadeFromAnotherInput) {
  write_sequence(3);
  run_well(words({"-q"}));
  EXPECT_THAT(run(words({"--resume"})).err, HasSubstr("3 were there already"));
  // As rsync -t and cp -p leave it: of another time, older than the outputs.
  const std::string input = path("d.0001.ply");
  const auto time = fs::last_write_time(input);
  fs::last_write_time(input, time - std::chrono::hours(1));
  EXPECT_THAT(run(words({"--resume"})).err, HasSubstr("2 were there already"));
  // Of the same time and size, but with another content.
  std::string text = read("d.0001.ply");
  text.replace(text.rfind("0.2"), 3, "0.3");
  write("d.0001.ply", text);
  fs::last_write_time(input, time - std::chrono::hours(1));
  EXPECT_THAT(run(words({"--resume"})).err, HasSubstr("2 were there already"));
  EXPECT_THAT(run(words({"--resume"})).err, HasSubstr("3 were there already"));
}

TEST_F(Sequence, ResumeRedoesWhatAnotherProgramMade) {
  write_sequence(2);
  run_well(words({"-q"}));
  Conditions other;
  other.program = path("meniscus");
  fs::copy_file(MENISCUS_PROGRAM, other.program);
  EXPECT_THAT(run(words({"--resume"}), other).err, HasSubstr("2 were there already"));
  std::ofstream(other.program, std::ios::binary | std::ios::app) << "another build";
  const Outcome redone = run(words({"--resume"}), other);
  EXPECT_THAT(redone.err, HasSubstr("2 frames in"));
  EXPECT_THAT(redone.err, HasSubstr("; again, since o.0000.exr was made by another program\n"));
}

TEST_F(Sequence, ResumeSkipsFramesInParts) {
  for (int frame = 0; frame < 2; ++frame)
    for (const char* const rank : {"rank0.ply", "rank1.ply"})
      write_particles(name("d.", frame, std::string(".") + rank), block(3));
  const std::vector<std::string> all{"extract", "d.####.rank*.ply", "--size",  "64x48",
                                     "-o",      "o.####.exr",       "--resume"};
  run_well(all);
  EXPECT_THAT(run(all).err, HasSubstr("2 were there already"));
  const std::string part = path("d.0001.rank1.ply");
  fs::last_write_time(part, fs::last_write_time(part) - std::chrono::hours(1));
  EXPECT_THAT(run(all).err, HasSubstr("1 was there already"));
  write_particles("d.0000.rank2.ply", block(2));
  EXPECT_THAT(run(all).err, HasSubstr("1 was there already"));
}

}  // namespace
}  // namespace meniscus::test
