// `report`, and `extract --report`.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>

#include "meniscus/io.hpp"
#include "program/cli/program.hpp"
#include "program/page/tags.hpp"

namespace meniscus::test {
namespace {

using testing::HasSubstr;
using testing::Not;

class ProgramReport : public Program {
 protected:
  ProgramReport() {
    for (int frame = 1; frame <= 4; ++frame)
      write_particles("f." + std::to_string(frame) + ".ply", block(3));
  }
  // Extracts frames 1 to 4 or a part of them.
  Outcome extract(std::vector<std::string> more) const {
    return run(Words{"extract", "f.#.ply", "-o", "o.#.png", "--size", "64x48", "--method",
                     "spheres", "-q"} +
               more);
  }
};

std::size_t occurrences(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; ++at) ++count;
  return count;
}

TEST_F(ProgramReport, MergesTheLogsOfShards) {
  for (const std::string shard : {"1/2", "2/2"})
    ASSERT_EQ(extract({"--shard", shard, "--log", shard.substr(0, 1) + ".jsonl"}).exit_code, 0);
  const Outcome outcome = run_well({"report", "1.jsonl", "2.jsonl", "-o", "page.html"});
  EXPECT_THAT(outcome.err, HasSubstr("4 in 2 logs: 4 done, 0 there already, 0 failed; 0 missing"));
  const std::string page = read("page.html");
  expect_whole_page(page);
  EXPECT_THAT(page, HasSubstr("All 4 frames are done"));
  EXPECT_EQ(occurrences(page, "<img "), 4u);
}

TEST_F(ProgramReport, OfABatchIsTheSameAsThatOfItsLog) {
  write("f.3.ply", "");
  EXPECT_EQ(extract({"--log", "a.jsonl", "--report", "a.html"}).exit_code, 3);
  run_well({"report", "a.jsonl", "-o", "b.html", "-q"});
  EXPECT_EQ(read("a.html"), read("b.html"));
  EXPECT_THAT(read("a.html"), HasSubstr("3 of 4 frames are done"));
  EXPECT_THAT(read("a.html"), HasSubstr("f.3.ply: is empty"));
}

TEST_F(ProgramReport, OfAResumedBatchKnowsTheEarlierRuns) {
  write("f.3.ply", "");
  EXPECT_EQ(extract({"--log", "a.jsonl"}).exit_code, 3);
  write_particles("f.3.ply", block(3));
  ASSERT_EQ(extract({"--log", "a.jsonl", "--resume", "--report", "a.html"}).exit_code, 0);
  const std::string page = read("a.html");
  EXPECT_THAT(page, HasSubstr("All 4 frames are done"));
  EXPECT_THAT(page, HasSubstr("<b>4</b><span>done"));
  EXPECT_THAT(page, HasSubstr("<b>1</b><span>further attempts"));
}

TEST_F(ProgramReport, SaysWhichFramesAreMissing) {
  ASSERT_EQ(extract({"--frames", "1,3", "--log", "a.jsonl"}).exit_code, 0);
  run_well({"report", "a.jsonl", "-o", "a.html", "--frames", "1-5"});
  EXPECT_THAT(read("a.html"), HasSubstr("2 of 5 frames are done"));
  EXPECT_THAT(read("a.html"), HasSubstr("<td>2,4,5</td>"));
}

TEST_F(ProgramReport, NamesWithMarkupStayNames) {
  std::filesystem::create_directory(path("<b>&"));
  write("<b>&/f.1.ply", "");
  write_particles("<b>&/f.2.ply", block(3));
  EXPECT_EQ(run({"extract", "<b>&/f.#.ply", "-o", "<b>&/o.#.png", "--size", "64x48", "--eye",
                 "0,0,5", "--target", "0,0,0", "-q", "--report", "a.html"})
                .exit_code,
            3);
  const std::string page = read("a.html");
  expect_whole_page(page);
  EXPECT_THAT(page, HasSubstr("&lt;b&gt;&amp;/f.1.ply: is empty"));
  EXPECT_THAT(page, Not(HasSubstr("<b>&/f")));
}

TEST_F(ProgramReport, ACutOffLineIsANote) {
  ASSERT_EQ(extract({"--log", "a.jsonl"}).exit_code, 0);
  const std::string log = read("a.jsonl");
  write("a.jsonl", log.substr(0, log.size() - 9));
  const Outcome outcome = run_well({"report", "a.jsonl", "-o", "a.html"});
  EXPECT_THAT(outcome.err, HasSubstr("meniscus: warning: a.jsonl: line 4 is cut off"));
  EXPECT_THAT(read("a.html"), HasSubstr("a.jsonl: line 4 is cut off"));
}

TEST_F(ProgramReport, NobodyWaitsForAPipeInALog) {
  ASSERT_EQ(mkfifo(path("o.png").c_str(), 0600), 0);
  ASSERT_EQ(mkfifo(path("o.exr").c_str(), 0600), 0);
  for (const char* const output : {"o.png", "o.exr"}) {
    write("a.jsonl",
          "{\"frame\": 1, \"status\": \"done\", \"outputs\": [\"" + std::string(output) + "\"]}\n");
    run_well({"report", "a.jsonl", "-o", "a.html"}, in_time(20));
    EXPECT_THAT(read("a.html"), HasSubstr("is a pipe or a device, wanted a file"));
  }
}

// Numbers whose differences do not fit, and a gap that no memory holds.
TEST_F(ProgramReport, AFrameOfNineteenDigitsIsABadLine) {
  write("a.jsonl",
        "{\"frame\": 9223372036854775807, \"status\": \"done\"}\n"
        "{\"frame\": 9223372036854775806, \"status\": \"done\"}\n");
  const Conditions bounded{
      {}, 0, {"/bin/sh", "-c", "ulimit -v 4000000; exec timeout 20 \"$@\"", "sh"}};
  expect_error(run({"report", "a.jsonl", "-o", "a.html"}, bounded), 1,
               {"a.jsonl: line 1", "\"frame\" is \"9223372036854775807\""});
  expect_error(run({"extract", "f.#.ply", "-o", "o.#.png", "--frames",
                    "9223372036854775806-9223372036854775807"},
                   bounded),
               2, {"goes beyond frame 999999999999999999"});
}

TEST_F(ProgramReport, BadUseIsAnErrorAndLeavesNoPage) {
  write("a.jsonl", "{\"frame\": 1, \"status\": \"done\"}\nnonsense\n");
  write("empty.jsonl", "");
  expect_error(run({"report", "a.jsonl", "-o", "a.html"}), 1, {"a.jsonl: line 2", "not JSON"});
  expect_error(run({"report", "none.jsonl", "-o", "a.html"}), 1, {"none.jsonl: cannot be opened"});
  expect_error(run({"report", "empty.jsonl", "-o", "./empty.jsonl"}), 2, {"is the input"});
  expect_error(run({"report", "empty.jsonl", "-o", "no/a.html"}), 1, {"no/a.html", "folder"});
  expect_error(run({"report", "empty.jsonl", "-o", "a.html", "--frames", "x"}), 2, {"frames x"});
  expect_error(run({"report", "a.jsonl"}), 2, {"--output"});
  expect_error(run({"report", "-o", "a.html"}), 2, {"LOG"});
  EXPECT_FALSE(exists("a.html"));
  EXPECT_EQ(run({"report", "empty.jsonl", "-o", "a.html"}).exit_code, 0) << "no frame is over";
}

TEST_F(ProgramReport, NothingButAPageIsReplacedByAPage) {
  write("a.jsonl", "");
  write("b.jsonl", "another log");
  write("f.1.ply", "");
  expect_error(run({"report", "a.jsonl", "-o", "b.jsonl"}), 2,
               {"--output is b.jsonl, must end in .html"});
  EXPECT_EQ(read("b.jsonl"), "another log");
  for (const char* name : {"page", "camera.json"})
    expect_error(run({"extract", "f.#.ply", "-o", "o.#.png", "--report", name}), 2,
                 {"--report is ", name, "must end in .html"});
  run_well({"report", "a.jsonl", "-o", "page.HTML"});
}

TEST_F(ProgramReport, DamagedPicturesDoNotLoseThePage) {
  ASSERT_EQ(extract({"--log", "a.jsonl"}).exit_code, 0);
  const std::string whole = read("o.1.png");
  write("o.1.png", "");
  write("o.2.png", whole.substr(0, whole.size() / 2));
  write("o.3.png", "no picture");
  run_well({"report", "a.jsonl", "-o", "a.html"});
  const std::string page = read("a.html");
  expect_whole_page(page);
  EXPECT_EQ(occurrences(page, "<img "), 1u);
  EXPECT_EQ(occurrences(page, "cannot be read"), 3u);
}

TEST_F(ProgramReport, NormalsThatAreNoNumbersDoNotLoseThePage) {
  ASSERT_EQ(run({"extract", "f.#.ply", "-o", "e.#.exr", "--size", "64x48", "--method", "spheres",
                 "-q", "--log", "a.jsonl"})
                .exit_code,
            0);
  Surface surface = read_exr(path("e.1.exr"));
  std::fill(surface.normal.begin(), surface.normal.end(), Vec3{NAN, NAN, NAN});
  write_exr(path("e.1.exr"), surface, {});
  run_well({"report", "a.jsonl", "-o", "a.html"});
  EXPECT_EQ(occurrences(read("a.html"), "<img "), 4u);
}

}  // namespace
}  // namespace meniscus::test
