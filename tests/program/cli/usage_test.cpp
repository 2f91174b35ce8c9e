// What the program says of itself, and how it answers a wrong command line.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>

#include "api/parameter_list.hpp"
#include "meniscus/extract.hpp"
#include "program/cli/program.hpp"

namespace meniscus::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

using ProgramUsage = Program;

TEST_F(ProgramUsage, SaysItsVersion) {
  const Outcome outcome = run({"--version"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.out, "meniscus " + version() + "\n");
  EXPECT_EQ(run({"-V"}).out, outcome.out);
}

TEST_F(ProgramUsage, HelpIsACommandToo) {
  EXPECT_EQ(run({"help"}).out, run({"--help"}).out);
  EXPECT_EQ(run({"help", "extract"}).out, run({"extract", "--help"}).out);
  EXPECT_EQ(run({"mesh", "--help-all"}).out, run({"mesh", "--help"}).out);
  EXPECT_EQ(run({"--help-all"}).out, run({"--help"}).out);
  EXPECT_THAT(run({"--help"}).out, HasSubstr("&& meniscus extract dam.ply -o a.png"));
}

TEST_F(ProgramUsage, RefusesAWordThatNobodyAskedFor) {
  expect_error(run({"verify", "all"}), 2, {"all: no word is wanted here (options begin with -"});
  expect_error(run({"devices", "a", "b"}), 2, {": no word is wanted here"});
  expect_error(run({"verify", "old.json", "new.json"}), 2, {"did you mean --compare old.json?"});
  expect_error(run({"bench", "old.json"}), 2, {"did you mean --compare old.json?"});
  expect_error(run({"bench", "--compare", "a", "b", "c"}), 2,
               {"--compare is given 3 names, must be at most 2"});
  expect_error(run({"extract"}), 2, {"INPUT is required, e.g. meniscus extract frame.ply -o "});
}

// A variable that a script has not set: a batch with a camera that nobody chose, or without a log.
TEST_F(ProgramUsage, RefusesEmptyNames) {
  write_particles("in.ply", block(3));
  for (const char* option : {"--camera", "--log", "--report", "--write-camera", "--output"})
    expect_error(run({"extract", "in.ply", "-o", "a.png", option, ""}), 2,
                 {std::string(option) + " is empty, must be a name"});
  expect_error(run({"extract", "", "-o", "a.png"}), 2, {"INPUT is empty, must be a name"});
  for (const char* option : {"--json", "--junit", "--html", "--repro"})
    expect_error(run({"verify", option, ""}), 2, {std::string(option) + " is empty, must be a"});
  expect_error(run({"bench", "frame", "--json", ""}), 2, {"--json is empty, must be a name"});
  expect_error(run({"report", "", "-o", "a.html"}), 2, {"LOG is empty, must be a name"});
  EXPECT_THAT(files(), testing::ElementsAre("in.ply"));
}

TEST_F(ProgramUsage, HelpHasWhatMostNeedOnOneScreen) {
  const Outcome outcome = run({"extract", "--help"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_LT(std::count(outcome.out.begin(), outcome.out.end(), '\n'), 48);
  for (const char* part : {"INPUT", "--output", "--particle-radius", "--camera", "--frames",
                           "--method", "--help-all explains all "})
    EXPECT_THAT(outcome.out, HasSubstr(part));
  EXPECT_THAT(outcome.out, testing::Not(HasSubstr("--ssm-sigma")));
}

TEST_F(ProgramUsage, ListsDevicesAsJson) {
  const Outcome outcome = run_well({"devices", "--json"});
  const nlohmann::json all = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(all["meniscus"], version());
  ASSERT_FALSE(all["devices"].empty());
  EXPECT_EQ(all["devices"][all["default"].get<std::size_t>()]["usable"], true);
}

TEST_F(ProgramUsage, HelpNamesEveryParameterWithUnitDefaultAndHeading) {
  const Outcome outcome = run({"extract", "--help-all"});
  EXPECT_EQ(outcome.exit_code, 0);
  Parameters parameters;
  for (const ParameterEntry& entry : parameter_list(parameters)) {
    EXPECT_THAT(outcome.out, HasSubstr("\n" + entry.group + ":\n"));
    const std::size_t at = outcome.out.find("  --" + entry.name + " ");
    ASSERT_NE(at, std::string::npos) << entry.name;
    const std::size_t next = outcome.out.find("\n  --", at);
    std::istringstream words(outcome.out.substr(at, next - at));
    std::string text;  // without the wrapping
    for (std::string word; words >> word;) text += word + " ";
    EXPECT_THAT(text, HasSubstr(entry.effect));
    if (!entry.unit.empty()) {
      EXPECT_THAT(text, HasSubstr("(" + entry.unit + ", default "));
    }
    char value[32];
    std::snprintf(value, sizeof value, "default %g)", entry.get());
    EXPECT_THAT(text, HasSubstr(value));
  }
}

TEST_F(ProgramUsage, HelpFitsATerminal) {
  for (const std::vector<std::string>& words : {std::vector<std::string>{"--help"},
                                                {"extract", "--help"},
                                                {"extract", "--help-all"},
                                                {"devices", "--help"},
                                                {"bench", "--help"},
                                                {"bench", "frame", "--help"},
                                                {"verify", "--help"},
                                                {"tune", "--help"},
                                                {"generate", "--help"},
                                                {"mesh", "--help"}}) {
    std::istringstream lines(run(words).out);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100u) << line;
  }
}

TEST_F(ProgramUsage, ListsDevicesAndSaysWhyOneIsTheDefault) {
  const Outcome outcome = run_well({"devices"});
  EXPECT_THAT(outcome.out, HasSubstr("* "));
  EXPECT_THAT(outcome.out, HasSubstr("The default is "));
  EXPECT_THAT(outcome.out, HasSubstr("fastest kind found"));
}

TEST_F(ProgramUsage, DevicesSaysWhereBuiltKernelsAreKeptAndWhereTheyAreNot) {
  std::filesystem::create_directory(path("cache"));
  const Conditions there{{{"MENISCUS_CACHE_DIR", path("cache")}}};
  EXPECT_THAT(run({"devices"}, there).out, HasSubstr("kept in " + path("cache") + "; remove it"));
  std::filesystem::permissions(path("cache"), std::filesystem::perms::all);  // others may write
  EXPECT_THAT(run({"devices"}, there).out, HasSubstr("not kept: " + path("cache") + " must be"));
  write("file", "");  // no folder can be made below it
  const Conditions nowhere{{{"MENISCUS_CACHE_DIR", path("file/cache")}}};
  EXPECT_THAT(run({"devices"}, nowhere).out, HasSubstr("not kept: " + path("file/cache")));
  const Conditions not_yet{{{"MENISCUS_CACHE_DIR", path("a/b/cache")}}};
  EXPECT_THAT(run({"devices"}, not_yet).out, HasSubstr("kept in " + path("a/b/cache")));
}

TEST_F(ProgramUsage, FullStandardOutputIsAnError) {
  for (const char* what : {" devices", " --help"}) {
    const std::string command =
        MENISCUS_PROGRAM + std::string(what) + " >/dev/full 2>" + path("error");
    EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 1);
    EXPECT_THAT(read("error"), StartsWith("meniscus: error: standard output"));
  }
}

// Files that the program opens got the numbers of closed streams, and its messages.
TEST_F(ProgramUsage, NoMessagesGoIntoFilesWhereStreamsAreClosed) {
  for (const char* name : {"d.1.ply", "d.2.ply"}) write_particles(name, block(3));
  const std::string command = "cd " + path("") +
                              " && " MENISCUS_PROGRAM
                              " extract 'd.#.ply' --size 64x48 -o 'o.#.ply' --report page.html"
                              " --log log.jsonl <&- >&- 2>&-";
  EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 0);
  EXPECT_THAT(read("page.html"), StartsWith("<!DOCTYPE html>"));
  EXPECT_THAT(read("log.jsonl"), StartsWith("{"));
  EXPECT_THAT(read("o.1.ply"), StartsWith("ply\n"));
}

struct WrongUsage {
  const char* name;
  std::vector<std::string> arguments;
  std::vector<std::string> message;
};

void PrintTo(const WrongUsage& usage, std::ostream* out) { *out << usage.name; }

class ProgramWrongUsage : public Program, public testing::WithParamInterface<WrongUsage> {};

TEST_P(ProgramWrongUsage, IsOneLineAndExitCodeTwo) {
  write_particles("in.ply", block(3));
  const Outcome outcome = run(GetParam().arguments);
  expect_error(outcome, 2, GetParam().message);
  EXPECT_THAT(outcome.err, StartsWith("meniscus: error: "));  // nothing was begun
  EXPECT_THAT(outcome.out, IsEmpty());
  EXPECT_THAT(files(), testing::ElementsAre("in.ply"));
}

std::vector<std::string> extract_with(std::vector<std::string> more) {
  return Words{"extract", "in.ply", "-o", "a.png"} + more;
}

INSTANTIATE_TEST_SUITE_P(
    All, ProgramWrongUsage,
    testing::Values(
        WrongUsage{"NoCommand", {}, {"no command is given, e.g. meniscus extract"}},
        WrongUsage{"UnknownCommand", {"polish"}, {"polish", "--help"}},
        WrongUsage{"NoInput", {"extract", "-o", "a.png"}, {"INPUT"}},
        WrongUsage{"NoOutput", {"extract", "in.ply"}, {"--output"}},
        WrongUsage{"NoOutputAndADash", {"extract", "--", "-in.ply"}, {"--output is required"}},
        WrongUsage{"UnknownOption",
                   extract_with({"--polish", "3"}),
                   {"meniscus extract has no option --polish (see"}},
        WrongUsage{"HelpOfAnUnknownCommand",
                   {"help", "exract"},
                   {"no command exract, did you mean extract? (see meniscus --help)"}},
        WrongUsage{"AFileForACommand",
                   {"in.ply"},
                   {"no command in.ply", "meniscus extract in.ply -o surface.png"}},
        WrongUsage{"OptionOfAnotherCommand",
                   {"mesh", "in.ply", "-o", "a.ply", "--eye", "1,2,3"},
                   {"meniscus mesh has no option --eye, which is of meniscus extract (see"}},
        WrongUsage{"FirstUnknownOption",
                   {"extract", "--sizes", "3x3", "--polish"},
                   {"no option --sizes, did you mean --size?"}},
        WrongUsage{"TheLastWordOfAnOption",
                   {"extract", "in.ply", "-o", "a.png", "--radius", "0.1"},
                   {"no option --radius, did you mean --particle-radius?"}},
        WrongUsage{"AnOptionOfThreeOthers",
                   {"mesh", "in.ply", "-o", "a.ply", "--size", "8x8"},
                   {"no option --size, which is of meniscus extract, bench and verify (see"}},
        WrongUsage{"OutputsInAList",
                   {"extract", "in.ply", "-o", "a.####.png,a.####.exr"},
                   {"is a list, give each file an -o of its own: -o a.####.png -o a.####.exr"}},
        WrongUsage{"AnOutputWithoutItsDash",
                   {"extract", "in.ply", "a.png"},
                   {"found 1 more, e.g. a.png (each output wants an -o before it"}},
        WrongUsage{
            "NoOutputOfAMesh", {"mesh", "in.ply"}, {"--output is required, e.g. -o surface.ply"}},
        WrongUsage{
            "NearlyACommand", {"exract", "in.ply"}, {"no command exract, did you mean extract?"}},
        WrongUsage{"Jpeg", {"extract", "in.ply", "-o", "a.jpg"}, {"written as .png", "a.png"}},
        WrongUsage{
            "Usd", {"extract", "in.ply", "-o", "a.usdc"}, {"USD", "a.ply", "usd_sequence.py"}},
        WrongUsage{"MeshAsUsd", {"mesh", "in.ply", "-o", "a.usdz"}, {"USD", "a.ply"}},
        WrongUsage{"Alembic", {"mesh", "in.ply", "-o", "a.abc"}, {"a.ply", ".glb"}},
        WrongUsage{"StandardOutput", {"extract", "in.ply", "-o", "-"}, {"standard output"}},
        WrongUsage{"FovOfNoCamera", extract_with({"--fov", "200"}), {"field of view is 200"}},
        WrongUsage{"UpOfNoAxis", extract_with({"--up", "xz"}), {"--up is xz, must be x, y, z or"}},
        WrongUsage{"EyeIsNoAxis", extract_with({"--eye", "z"}), {"--eye is z, must be three num"}},
        WrongUsage{"UpOfNoCamera", extract_with({"--up", "0,0,0"}), {"up must be"}},
        WrongUsage{"SecondInput",
                   extract_with({"b.ply", "c.ply"}),
                   {"wanted one INPUT, found 2 more, e.g. b.ply", "one name in quotes"}},
        WrongUsage{"OutputWithoutItsO",
                   extract_with({"b.exr"}),
                   {"found 1 more, e.g. b.exr (each output wants an -o before it"}},
        WrongUsage{"FolderForAnOutput",
                   {"extract", "in.ply", "-o", "./"},
                   {"output ./: is a folder, wanted a file in it, e.g. ./surface.exr, or of a "
                    "sequence ./surface.####.exr (see meniscus extract --help)"}},
        WrongUsage{"OptionWithoutItsValue",
                   extract_with({"--aov"}),
                   {"--aov is given without its value (see"}},
        WrongUsage{"UnknownEnding",
                   {"extract", "in.ply", "-o", "a.sgi"},
                   {"a.sgi", ".exr", ".ply", ".obj", ".png"}},
        WrongUsage{"NoEnding", {"extract", "in.ply", "-o", "a"}, {".exr", ".ply", ".obj", ".png"}},
        WrongUsage{"StarInOutput",
                   {"extract", "in.ply", "-o", "a.*.png"},
                   {"a.*.png: has a *", "e.g. name.####.png"}},
        WrongUsage{
            "NoFrameRate", extract_with({"--fps", "0"}), {"--fps is 0, must be a number > 0"}},
        WrongUsage{"SameOutputTwice", extract_with({"-o", "./a.png"}), {"./a.png", "twice"}},
        WrongUsage{"OutputIsInput", {"extract", "in.ply", "-o", "./in.ply"}, {"input"}},
        WrongUsage{"Method",
                   extract_with({"--method", "magic"}),
                   {"--method is magic",
                    "fit, groups, stable, paper, ssm, spheres, bilateral, "
                    "narrow-range, curvature-flow, anisotropic"}},
        WrongUsage{"Preview",
                   extract_with({"--preview", "x"}),
                   {"--preview is x", "lit, normal, depth, groups, glass"}},
        WrongUsage{"TooManyLayers", extract_with({"--layers", "9"}), {"--layers", "1 to 8"}},
        WrongUsage{"NoLayers", extract_with({"--layers", "0"}), {"--layers", "1 to 8"}},
        WrongUsage{"Compression",
                   extract_with({"--compression", "x"}),
                   {"--compression is x", "none, rle, zips, zip, piz, pxr24"}},
        WrongUsage{"Dwaa", extract_with({"--compression", "dwaa"}), {"dwaa", "N.Y"}},
        WrongUsage{"Dwab", extract_with({"--compression", "dwab"}), {"dwab", "N.Y"}},
        WrongUsage{"ZeroRadius", extract_with({"--particle-radius", "0"}), {"--particle-radius"}},
        WrongUsage{"NegativeRadius",
                   extract_with({"--particle-radius", "-0.1"}),
                   {"--particle-radius is -0.1"}},
        WrongUsage{"WordForRadius",
                   extract_with({"-r", "abc"}),
                   {"--particle-radius is abc, must be a number (see"}},
        WrongUsage{"TwoRadii",
                   extract_with({"-r", ".025", "-r", ".03"}),
                   {"--particle-radius is given 2 times, must be given once"}},
        WrongUsage{"DeviceAllOfOneFrame",
                   extract_with({"--device", "all"}),
                   {"--device all is for sequences, but in.ply has no place"}},
        WrongUsage{"CameraAndSize",
                   extract_with({"--camera", "c.json", "--size", "640x480"}),
                   {"--camera", "--size", "the camera's file has the size"}},
        WrongUsage{"NanRadius", extract_with({"--particle-radius", "nan"}), {"--particle-radius"}},
        WrongUsage{"WordForNumber", extract_with({"--footprint", "big"}), {"--footprint", "big"}},
        WrongUsage{"OutOfRange", extract_with({"--footprint", "99"}), {"--footprint is 99"}},
        WrongUsage{"NanParameter", extract_with({"--offset", "nan"}), {"--offset is nan"}},
        WrongUsage{"FractionForCount",
                   extract_with({"--passes", "1.5"}),
                   {"--passes is 1.5, must be a whole number"}},
        WrongUsage{"EyeWithoutTarget", extract_with({"--eye", "1,2,3"}), {"--eye", "--target"}},
        WrongUsage{"TwoNumbers",
                   extract_with({"--eye", "1,2", "--target", "0,0,0"}),
                   {"--eye is 1,2", "three numbers"}},
        WrongUsage{"Size", extract_with({"--size", "640"}), {"--size is 640", "WIDTHxHEIGHT"}},
        WrongUsage{"ZeroSize", extract_with({"--size", "0x480"}), {"--size is 0x480"}},
        WrongUsage{"CameraAndEye",
                   extract_with({"--camera", "c.json", "--eye", "1,2,3", "--target", "0,0,0"}),
                   {"--camera", "--eye"}},
        WrongUsage{"Threads", extract_with({"--threads", "0"}), {"--threads", "1 to 1024"}},
        WrongUsage{"BenchMethod",
                   {"bench", "frame", "--method", "fit,magic"},
                   {"--method", "magic", "fit, groups, stable"}},
        WrongUsage{"BenchParticles",
                   {"bench", "frame", "--particles", "1e4,9"},
                   {"--particles is 9", "from 10"}},
        WrongUsage{"BenchSize", {"bench", "frame", "--size", "640x480,9"}, {"--size is 9"}},
        WrongUsage{
            "BenchInputAndSweep", {"bench", "frame", "in.ply", "--sweep"}, {"--sweep", "INPUT"}},
        WrongUsage{"BenchInFlight",
                   {"bench", "frame", "--in-flight", "0"},
                   {"--in-flight is 0, must be 1 to 64", "(see meniscus bench frame --help)"}},
        WrongUsage{"BenchSeconds",
                   {"bench", "frame", "--seconds", "nan"},
                   {"--seconds is nan, must be 0 to 1000000"}},
        WrongUsage{"BenchRadius",
                   {"bench", "frame", "in.ply", "--particle-radius", "inf"},
                   {"--particle-radius is inf, must be a number > 0"}},
        WrongUsage{
            "VerifySize", {"verify", "--size", "huge"}, {"--size is huge, must be small or full"}},
        WrongUsage{"VerifyCompareRuns",
                   {"verify", "--compare", "a.json", "b.json", "--kernel", "fit"},
                   {"--kernel", "--compare"}},
        WrongUsage{"QuietAndVerbose", extract_with({"-q", "-v"}), {"--quiet", "--verbose"}}),
    [](const auto& info) { return std::string(info.param.name); });

TEST_F(ProgramUsage, RefusesMemoryThatIsNone) {
  write_particles("block.ply", block(3));
  for (const char* memory : {"0", "-1", "1Q", "M", "12MBs", "12BM", "many", "nan", "1e99"})
    expect_error(run({"extract", "block.ply", "-o", "out.png", "--memory", memory}), 2,
                 {"--memory is", memory, "e.g. 512M"});
  for (const char* memory : {"1G", "0.5G", "1000000", "64K", "128MB", "128MiB"})
    run_well({"extract", "block.ply", "-o", "out.png", "--memory", memory});
}

}  // namespace
}  // namespace meniscus::test
