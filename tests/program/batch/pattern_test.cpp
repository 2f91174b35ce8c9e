#include "program/batch/pattern.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "cost.hpp"
#include "io/temporary_folder.hpp"
#include "meniscus/error.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

/// Tests run in an empty folder of their own.
class Pattern : public testing::Test {
 protected:
  Pattern() : before_(fs::current_path()) { fs::current_path(folder_.path()); }
  ~Pattern() override { fs::current_path(before_); }

  static void touch(const std::vector<std::string>& paths) {
    for (const std::string& path : paths) {
      if (fs::path(path).has_parent_path()) fs::create_directories(fs::path(path).parent_path());
      std::ofstream file(path);
    }
  }

  static std::vector<std::pair<std::int64_t, std::string>> existing(const std::string& pattern) {
    std::vector<std::pair<std::int64_t, std::string>> found;
    const auto parsed = FramePattern::in(pattern);
    if (!parsed) throw std::runtime_error(pattern + " is no pattern");
    for (const auto& [frame, file] : parsed->existing()) found.emplace_back(frame, file.path);
    return found;
  }

 private:
  fs::path before_;
  TemporaryFolder folder_;
};

TEST_F(Pattern, EverySpellingOfAPlace) {
  for (const char* text :
       {"dam.####.ply", "dam.%04d.ply", "dam.$F4.ply", "dam.{:04d}.ply", "dam.{:04}.ply"}) {
    const auto pattern = FramePattern::in(text);
    ASSERT_TRUE(pattern) << text;
    EXPECT_EQ(pattern->name(7), "dam.0007.ply") << text;
    EXPECT_EQ(pattern->name(12345), "dam.12345.ply") << text;
  }
  for (const char* text : {"dam.%d.ply", "dam.$F.ply", "dam.#.ply", "dam.{}.ply"})
    EXPECT_EQ(FramePattern::in(text)->name(7), "dam.7.ply") << text;
  EXPECT_EQ(FramePattern::in("{}.ply")->name(7, "007"), "007.ply");
  EXPECT_EQ(FramePattern::in("s##/d_##_$F3.exr")->name(5), "s05/d_05_005.exr");
}

TEST_F(Pattern, OtherNamesAreNone) {
  for (const char* text :
       {"dam.ply", "100%.ply", "a%5d.ply", "$HOME.ply", "a{b}.ply", "{:x}", "{:4}"})
    EXPECT_FALSE(FramePattern::in(text)) << text;
}

TEST_F(Pattern, AFileOfThatVeryNameIsMeant) {
  touch({"take#2.ply"});
  EXPECT_FALSE(FramePattern::in("take#2.ply"));
}

TEST_F(Pattern, FindsFramesInNaturalOrder) {
  touch({"d.0002.ply", "d.0010.ply", "d.0001.ply", "d.12345.ply", "d.1.ply", "d.00001.ply",
         "d.x.ply", "d.0003.vtk", "e.0004.ply"});
  EXPECT_THAT(existing("d.####.ply"),
              ElementsAre(Pair(1, "d.0001.ply"), Pair(2, "d.0002.ply"), Pair(10, "d.0010.ply"),
                          Pair(12345, "d.12345.ply")));
  EXPECT_THAT(existing("./d.%d.ply"),
              ElementsAre(Pair(1, "./d.1.ply"), Pair(12345, "./d.12345.ply")));
  EXPECT_THAT(existing("f.####.ply"), IsEmpty());
  EXPECT_THAT(existing("nowhere/f.####.ply"), IsEmpty());
}

TEST_F(Pattern, AbsolutePathsAndFolders) {
  touch(
      {"shot_01/cache/d.1.ply", "shot_02/cache/d.2.ply", "shot_03/cache/d.4.ply", "shot_05/none"});
  EXPECT_THAT(existing("shot_##/cache/d.#.ply"),
              ElementsAre(Pair(1, "shot_01/cache/d.1.ply"), Pair(2, "shot_02/cache/d.2.ply")));
  EXPECT_THAT(
      existing("shot_##/cache"),
      ElementsAre(Pair(1, "shot_01/cache"), Pair(2, "shot_02/cache"), Pair(3, "shot_03/cache")));
  const std::string here = fs::current_path().string();
  EXPECT_THAT(existing(here + "/shot_##/cache/d.$F.ply"),
              ElementsAre(Pair(1, here + "/shot_01/cache/d.1.ply"),
                          Pair(2, here + "/shot_02/cache/d.2.ply")));
}

TEST_F(Pattern, BracesTakeAnyPaddingAndKeepIt) {
  touch({"d.007.ply", "d.8.ply"});
  const auto found = FramePattern::in("d.{}.ply")->existing();
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found.at(7).path, "d.007.ply");
  EXPECT_EQ(FramePattern::in("out{}.exr")->name(7, found.at(7).digits), "out007.exr");
  // An output does so whatever the input's place is.
  for (const char* const input : {"d.###.ply", "d.%03d.ply"})
    EXPECT_EQ(
        FramePattern::in("out{}.exr")->name(7, FramePattern::in(input)->existing().at(7).digits),
        "out007.exr");
  touch({"d.7.ply"});
  const std::string text =
      text_of_thrown<InputError>([&] { FramePattern::in("d.{}.ply")->existing(); });
  EXPECT_THAT(text, HasSubstr("are both frame 7"));
  EXPECT_THAT(text, HasSubstr("d.007.ply"));
  EXPECT_THAT(text, HasSubstr("d.7.ply"));
}

TEST_F(Pattern, AFolderThatCannotBeListedIsNotTakenForAnEmptyOne) {
  fs::create_directory_symlink("loop", "loop");
  EXPECT_EQ(text_of_thrown<InputError>([] { existing("loop/d.#.ply"); }),
            "loop/: cannot be listed: Too many levels of symbolic links");
  EXPECT_THAT(existing("gone/d.#.ply"), IsEmpty());
}

TEST_F(Pattern, DigitsBesideThePlace) {
  touch({"2d.0012.ply", "2d.0013.5.ply", "run2_0042"});
  EXPECT_THAT(existing("2d.####.ply"), ElementsAre(Pair(12, "2d.0012.ply")));
  EXPECT_THAT(existing("run2_{}"), ElementsAre(Pair(42, "run2_0042")));
  touch({"a105.ply"});
  EXPECT_THAT(existing("a##5.ply"), ElementsAre(Pair(10, "a105.ply")));
}

TEST_F(Pattern, AStarStandsForTheParts) {
  touch({"d.0001.rank0.ply", "d.0001.rank1.ply", "d.0002.rank0.ply", "d.0003.ply"});
  EXPECT_THAT(existing("d.####.rank*.ply"),
              ElementsAre(Pair(1, "d.0001.rank*.ply"), Pair(2, "d.0002.rank*.ply")));
}

TEST_F(Pattern, ManyStarsAreNotTriedInEveryWay) {
  touch({std::string(200, 'a') + ".0001.ply", std::string(100, '1') + "x"});
  const Cost cost = cost_of([] {
    if (!existing("*a*a*a*a*a*a*a*a*a*a*b.####.ply").empty()) _exit(1);
    if (existing("*a*a*a*a*a*a*a*a*a*a*.####.ply").size() != 1) _exit(1);
    if (!existing("*{}*{}*{}*{}*{}*y").empty()) _exit(1);
  });
  EXPECT_LT(cost.seconds, 5);
}

}  // namespace
}  // namespace meniscus
