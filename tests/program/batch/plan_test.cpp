#include "program/batch/plan.hpp"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "io/temporary_folder.hpp"
#include "meniscus/camera.hpp"
#include "meniscus/error.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A folder with d.0001.ply to d.0010.ply, without frame 4.
class PlanTest : public testing::Test {
 protected:
  PlanTest() {
    for (const int frame : {1, 2, 3, 5, 6, 7, 8, 9, 10}) {
      char file[32];
      std::snprintf(file, sizeof file, "d.%04d.ply", frame);
      std::ofstream(folder_ / file) << frame;
    }
  }

  std::string path(const std::string& name) const { return folder_ / name; }

  SequenceRequest request(const std::string& frames = "") const {
    return {*FramePattern::in(path("d.####.ply")), {path("o.####.exr")}, frames, false, {}};
  }

  template <class Thrown>
  static std::string error_of(const SequenceRequest& request,
                              const CameraTrack* cameras = nullptr) {
    return text_of_thrown<Thrown>([&] { plan_sequence(request, cameras); });
  }

 private:
  TemporaryFolder folder_;
};

TEST_F(PlanTest, AllThatExistWithoutAList) {
  const Plan plan = plan_sequence(request());
  EXPECT_THAT(plan.frames(), ElementsAre(1, 2, 3, 5, 6, 7, 8, 9, 10));
  EXPECT_EQ(plan.jobs[3].input, path("d.0005.ply"));
  EXPECT_THAT(plan.jobs[3].outputs, ElementsAre(path("o.0005.exr")));
  EXPECT_THAT(plan.missing, ElementsAre(4));
  EXPECT_THAT(plan.warnings, ElementsAre(path("d.####.ply: frame 4 is missing")));
}

TEST_F(PlanTest, GapsAreNamedByTheStepOfTheSequence) {
  const auto plan_of = [&](const std::string& stem, std::initializer_list<int> frames) {
    for (const int frame : frames) std::ofstream(path(stem + std::to_string(frame) + ".ply"));
    return plan_sequence(
        {*FramePattern::in(path(stem + "#.ply")), {path("o#.exr")}, "", false, {}});
  };
  EXPECT_THAT(plan_of("a.", {1, 2, 5, 8}).warnings,
              ElementsAre(path("a.#.ply: 4 frames 3,4,6,7 are missing")));
  EXPECT_THAT(plan_of("b.", {0, 10, 20}).warnings, IsEmpty());
  EXPECT_THAT(plan_of("c.", {0, 10, 20, 40}).missing, ElementsAre(30));
  EXPECT_THAT(plan_of("d.", {7}).warnings, IsEmpty());
}

// They were left out without a word.
TEST_F(PlanTest, FilesWithNumbersBelowZeroAreNamed) {
  for (const char* name : {"e.-2.ply", "e.-01.ply", "e.0.ply", "e.1.ply"})
    std::ofstream(path(name));
  for (const char* pattern : {"e.#.ply", "e.{}.ply"}) {
    const Plan plan =
        plan_sequence({*FramePattern::in(path(pattern)), {path("o.####.exr")}, "", false, {}});
    EXPECT_THAT(plan.frames(), ElementsAre(0, 1));
    EXPECT_THAT(plan.warnings,
                ElementsAre(path(pattern) + ": 2 files with a number below 0 left out, such as " +
                            path("e.-01.ply") + " (frames count from 0)"));
  }
}

TEST_F(PlanTest, TheListsOrderIsKept) {
  EXPECT_THAT(plan_sequence(request("10-6x-2,2")).frames(), ElementsAre(10, 8, 6, 2));
}

TEST_F(PlanTest, MissingFramesAreNamedOrSkipped) {
  SequenceRequest asked = request("1-6");
  EXPECT_THAT(error_of<InputError>(asked), HasSubstr("d.####.ply: frame 4 missing"));
  EXPECT_THAT(error_of<InputError>(asked), HasSubstr("--missing skip"));
  asked.skip_missing = true;
  const Plan plan = plan_sequence(asked);
  EXPECT_THAT(plan.frames(), ElementsAre(1, 2, 3, 5, 6));
  EXPECT_THAT(plan.missing, ElementsAre(4));
  ASSERT_EQ(plan.warnings.size(), 1u);
  EXPECT_THAT(plan.warnings[0], HasSubstr("frame 4 missing and skipped"));
}

TEST_F(PlanTest, ChunksPastTheEndAreClipped) {
  const Plan plan = plan_sequence(request("9-14"));
  EXPECT_THAT(plan.frames(), ElementsAre(9, 10));
  ASSERT_EQ(plan.warnings.size(), 1u);
  EXPECT_THAT(plan.warnings[0],
              HasSubstr("4 frames 11-14 left out: the sequence ends with frame 10"));
  SequenceRequest past = request("100-110");
  EXPECT_EQ(error_of<InputError>(past),
            path("d.####.ply: none of 11 frames 100-110 is there, the sequence ends with frame 10 "
                 "(give --missing skip to do nothing then)"));
  past.skip_missing = true;
  EXPECT_THAT(plan_sequence(past).frames(), IsEmpty());
  EXPECT_THAT(plan_sequence(past).warnings.at(0), HasSubstr("11 frames 100-110 left out"));
}

TEST_F(PlanTest, NoFilesAtAll) {
  SequenceRequest asked = request();
  asked.input = *FramePattern::in(path("e.####.ply"));
  EXPECT_THAT(error_of<InputError>(asked), HasSubstr("e.####.ply: no file matches"));
  asked.input = *FramePattern::in(path("nowhere/d.####.ply"));
  EXPECT_THAT(error_of<InputError>(asked), HasSubstr("there is no folder " + path("nowhere/")));
}

TEST_F(PlanTest, EveryOutputHasAPlaceForTheNumber) {
  SequenceRequest asked = request();
  asked.outputs = {path("o.####.exr"), path("o.png")};
  for (const char* frames : {"", "7"}) {  // of one frame, too: others do the next
    asked.frames = frames;
    EXPECT_EQ(error_of<InvalidArgument>(asked),
              "output " + path("o.png") +
                  " has no place for the frame's number, but the input is a sequence: name it " +
                  path("o.####.png"));
  }
}

TEST_F(PlanTest, TwoOutputsOfOneName) {
  SequenceRequest asked = request("8");
  asked.outputs = {path("o.####.exr"), path("o.%04d.exr")};
  EXPECT_EQ(error_of<InvalidArgument>(asked),
            "outputs " + path("o.####.exr") + " and " + path("o.%04d.exr") + " both name " +
                path("o.0008.exr") + ", give each output its own name");
  asked.frames = "1,2,10";
  asked.outputs = {path("o#.exr"), path("o#0.exr")};  // frame 10 of the first, 1 of the second
  EXPECT_THAT(error_of<InvalidArgument>(asked), HasSubstr("both name " + path("o10.exr")));
}

TEST_F(PlanTest, ShardsTakeEveryNth) {
  SequenceRequest asked = request();
  asked.shard = {2, 3};
  const Plan plan = plan_sequence(asked);
  EXPECT_THAT(plan.frames(), ElementsAre(2, 6, 9));
  EXPECT_EQ(plan.all_shards, 9u);
}

TEST_F(PlanTest, EveryFrameNeedsACamera) {
  const Camera camera = look_at({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 40, 64, 48);
  const CameraTrack fixed(camera);
  EXPECT_EQ(plan_sequence(request(), &fixed).jobs.size(), 9u);

  std::ofstream list(path("c.json"));
  const char* const matrices =
      "\"width\":64,\"height\":48,\"view\":[[1,0,0,0],[0,1,0,0],[0,0,1,-5],[0,0,0,1]],"
      "\"projection\":[[2,0,0,0],[0,2,0,0],[0,0,-1,-0.5],[0,0,-1,0]]}";
  for (const int frame : {1, 2, 3, 5, 6, 7, 8, 10})
    list << (frame == 1 ? "[" : ",") << "{\"frame\":" << frame << "," << matrices;
  list << "]";
  list.close();
  const CameraTrack listed(path("c.json"));
  EXPECT_TRUE(listed.moves());
  EXPECT_THAT(error_of<InputError>(request(), &listed), HasSubstr("c.json: frame 9 missing"));
  SequenceRequest asked = request();
  asked.skip_missing = true;
  EXPECT_THAT(plan_sequence(asked, &listed).frames(), ElementsAre(1, 2, 3, 5, 6, 7, 8, 10));
}

TEST_F(PlanTest, TracksAreAListAPatternOrOneCamera) {
  const auto camera = [](const char* extra, int width) {
    return std::string("{") + extra + "\"width\":" + std::to_string(width) +
           ",\"height\":48,\"view\":[[1,0,0,0],[0,1,0,0],[0,0,1,-5],[0,0,0,1]],"
           "\"projection\":[[2,0,0,0],[0,2,0,0],[0,0,-1,-0.5],[0,0,-1,0]]}";
  };
  std::ofstream(path("one.json")) << camera("", 64);
  std::ofstream(path("c.3.json")) << camera("", 65);
  std::ofstream(path("c.4.json")) << camera("", 66);
  const CameraTrack one(path("one.json")), files(path("c.#.json"));
  EXPECT_FALSE(one.moves());
  EXPECT_EQ(one.at(1234).width, 64);
  EXPECT_EQ(one.after(1234).width, 64);
  EXPECT_TRUE(files.moves());
  EXPECT_EQ(files.at(3).width, 65);
  EXPECT_EQ(files.after(3).width, 66);
  EXPECT_EQ(files.after(4).width, 66);  // the track ends
  EXPECT_FALSE(files.has(5));
  EXPECT_THROW(files.at(5), InputError);
  for (const auto& [name, text, wanted] : std::vector<std::array<std::string, 3>>{
           {"empty.json", "[]", "the list of cameras is empty"},
           {"no_frame.json", "[" + camera("", 64) + "]", "camera 0: has no key \"frame\""},
           {"minus.json", "[" + camera("\"frame\":-1,", 64) + "]",
            "camera 0: has no key \"frame\""},
           {"twice.json", "[" + camera("\"frame\":1,", 64) + "," + camera("\"frame\":1,", 64) + "]",
            "camera 1: is the second one of frame 1"},
           {"large.json", "[" + camera("\"frame\":18446744073709551615,", 64) + "]",
            "camera 0: frame is 18446744073709551615, must be a whole number from 0 to "},
           {"number.json", "[1]", "camera 0: has no key \"frame\""}}) {
    const std::string file = path(name);
    std::ofstream(file) << text;
    const std::string said = text_of_thrown<InputError>([&] { const CameraTrack track(file); });
    EXPECT_THAT(said, HasSubstr(wanted));
    EXPECT_THAT(said, HasSubstr(name));
  }
}

}  // namespace
}  // namespace meniscus
