// Bad input, one clear line each: files, cameras, folders, disks, devices.
#include <gmock/gmock.h>
#include <sys/mount.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <filesystem>

#include "program/cli/program.hpp"

namespace meniscus::test {
namespace {

namespace fs = std::filesystem;

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

std::string camera_json(const std::string& view_00, const std::string& projection_00) {
  return R"({"width": 64, "height": 48, "view": [[)" + view_00 +
         R"(,0,0,0],[0,1,0,0],[0,0,1,-4],[0,0,0,1]], "projection": [[)" + projection_00 +
         R"(,0,0,0],[0,2,0,0],[0,0,-1.02,-0.2],[0,0,-1,0]]})";
}

// --- files that are missing, empty, truncated or something else ---------------------------------

struct BadFile {
  const char* name;
  std::string file, bytes;
  std::vector<std::string> message;
};

void PrintTo(const BadFile& file, std::ostream* out) { *out << file.name; }

class ProgramBadFile : public Program, public testing::WithParamInterface<BadFile> {};

TEST_P(ProgramBadFile, IsOneLineAndNoOutput) {
  const BadFile& bad = GetParam();
  write(bad.file, bad.bytes);
  std::vector<std::string> message = bad.message;
  message.push_back(bad.file);
  expect_error(run({"extract", bad.file, "-o", "a.png", "-o", "a.exr", "-o", "a.obj"}), 1, message);
  EXPECT_THAT(files(), ElementsAre(bad.file));
}

const std::string kPlyHeader =
    "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\n"
    "property float y\nproperty float z\nend_header\n";

INSTANTIATE_TEST_SUITE_P(
    All, ProgramBadFile,
    testing::Values(
        BadFile{"EmptyPly", "in.ply", "", {}}, BadFile{"EmptyVtk", "in.vtk", "", {}},
        BadFile{"EmptyBgeo", "in.bgeo", "", {}}, BadFile{"EmptyXyz", "in.xyz", "", {}},
        BadFile{"EmptyCsv", "in.csv", "", {}},
        BadFile{"TruncatedPly", "in.ply", kPlyHeader + std::string(20, '\0'), {}},
        BadFile{"PlyHeaderOnly", "in.ply", kPlyHeader.substr(0, 60), {}},
        BadFile{"PictureAsPly", "in.ply", "\x89PNG\r\n\x1a\n", {}},
        BadFile{"WordsAsXyz", "in.xyz", "not a number\n", {}},
        BadFile{"TwoColumnsXyz", "in.xyz", "1 2\n", {}},
        BadFile{"WordsAsCsv", "in.csv", "a,b\n1,2\n", {}},
        BadFile{"WordsAsVtk", "in.vtk", "hello\n", {}},
        BadFile{"WordsAsBgeo", "in.bgeo", "hello\n", {}},
        BadFile{"UnknownEnding", "in.abc", "abc", {".ply"}},
        BadFile{"NegativeRadius",
                "in.ply",
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                "property float z\nproperty float radius\nend_header\n0 0 0 -0.01\n",
                {"-0.01"}}),
    [](const auto& info) { return std::string(info.param.name); });

using ProgramBadInput = Program;

TEST_F(ProgramBadInput, MissingFile) {
  expect_error(run({"extract", "gone.ply", "-o", "a.png"}), 1, {"gone.ply"});
  EXPECT_THAT(files(), ElementsAre());
}

TEST_F(ProgramBadInput, FolderAsInput) {
  std::filesystem::create_directory(path("folder.ply"));
  expect_error(run({"extract", "folder.ply", "-o", "a.png"}), 1, {"folder.ply"});
}

// --- particles that are not numbers --------------------------------------------------------------

TEST_F(ProgramBadInput, NanAndInfiniteCoordinatesAreCountedAndDropped) {
  write_particles("clean.ply", block(4));
  std::string text = read("clean.ply");
  const std::string count = "element vertex 64";
  text.replace(text.find(count), count.size(), "element vertex 67");
  write("in.ply", text + "nan 0 0\n0 inf 0\n0 0 -inf\n");

  const std::vector<std::string> rest{"-q",    "--eye",  "1,1,3", "--target",
                                      "0,0,0", "--size", "64x48", "-o"};
  std::vector<std::string> clean{"extract", "clean.ply"}, dirty{"extract", "in.ply"};
  clean.insert(clean.end(), rest.begin(), rest.end());
  dirty.insert(dirty.end(), rest.begin(), rest.end());
  clean.push_back("clean.png");
  dirty.push_back("dirty.png");
  run_well(clean);
  const Outcome outcome = run(dirty);
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.err, HasSubstr("meniscus: warning: "));
  EXPECT_THAT(outcome.err, HasSubstr("3"));
  EXPECT_EQ(read("dirty.png"), read("clean.png"));

  dirty.back() = "strict.png";
  dirty.push_back("--strict");
  expect_error(run(dirty), 1, {"3"});
  EXPECT_FALSE(exists("strict.png"));
}

TEST_F(ProgramBadInput, NoParticleWithCoordinatesIsAnError) {
  write_particles("in.ply", {{std::nan(""), 0, 0}, {0, INFINITY, 0}});
  expect_error(run({"extract", "in.ply", "-q", "-o", "a.png", "--size", "64x48"}), 1,
               {"in.ply: 2 of 2 particles have NaN or infinite coordinates", "none is left"});
  EXPECT_THAT(files(), ElementsAre("in.ply"));
  write_particles("in.ply", {});  // an emitter that has not begun
  run_well({"extract", "in.ply", "-q", "-o", "a.png", "--size", "64x48"});
}

// --- cameras
// --------------------------------------------------------------------------------------

struct BadCamera {
  const char* name;
  std::string json;
};

void PrintTo(const BadCamera& camera, std::ostream* out) { *out << camera.name; }

class ProgramBadCamera : public Program, public testing::WithParamInterface<BadCamera> {};

TEST_P(ProgramBadCamera, IsOneLineThatNamesTheFile) {
  write_particles("in.ply", block(3));
  write("camera.json", GetParam().json);
  expect_error(run({"extract", "in.ply", "-o", "a.png", "--camera", "camera.json"}), 1,
               {"camera.json"});
  EXPECT_THAT(files(), ElementsAre("camera.json", "in.ply"));
}

INSTANTIATE_TEST_SUITE_P(All, ProgramBadCamera,
                         testing::Values(BadCamera{"Empty", ""}, BadCamera{"NotJson", "eye 1 2 3"},
                                         BadCamera{"NoMatrices", R"({"width": 64, "height": 48})"},
                                         BadCamera{"SingularView", camera_json("0", "2")},
                                         BadCamera{"ScalingView", camera_json("2", "2")},
                                         BadCamera{"SingularProjection", camera_json("1", "0")},
                                         BadCamera{"InfiniteProjection", camera_json("1", "1e999")},
                                         BadCamera{"NanProjection", camera_json("1", "NaN")},
                                         BadCamera{"WordInMatrix", camera_json("\"one\"", "2")}),
                         [](const auto& info) { return std::string(info.param.name); });

// A picture can be made, but is hardly what was meant.
TEST_F(ProgramBadInput, OddProjectionsAreWarnedOf) {
  write_particles("in.ply", block(3));
  const auto told = [&](const std::string& json) {
    write("c.json", json);
    return run_well({"extract", "in.ply", "-o", "a.png", "--camera", "c.json"}).err;
  };
  EXPECT_THAT(told(camera_json("1", "1.5")), Not(HasSubstr("warning")));
  EXPECT_THAT(told(camera_json("1", "2")), HasSubstr("c.json: the projection is of an image 1 "
                                                     "times as wide as high"));
  EXPECT_THAT(told(camera_json("1", "-1.5")),
              HasSubstr("c.json: the projection mirrors the image (negate the first row"));
  std::string vulkan = camera_json("1", "1.5");
  vulkan.replace(vulkan.find("[0,2,0,0]"), 9, "[0,-2,0,0]");
  EXPECT_THAT(told(vulkan), HasSubstr("the projection mirrors the image: it is upside down"));
  vulkan.replace(vulkan.find("\"width\": 64"), 11, "\"width\": 64.0");
  EXPECT_THAT(told(vulkan), HasSubstr("upside down"));
}

// A proxy of half the size, with the camera's file as it is.
TEST_F(ProgramBadInput, SizeWithACameraFileIsAShareOfIts) {
  write_particles("in.ply", block(3));
  ASSERT_EQ(run({"extract", "in.ply", "-o", "a.png", "--size", "64x48", "--write-camera", "c.json"})
                .exit_code,
            0);
  const Outcome half =
      run_well({"extract", "in.ply", "-o", "b.png", "--camera", "c.json", "--size", "50%"});
  EXPECT_THAT(half.out + half.err, HasSubstr("c.json, 32x24"));
  write("c.0001.json", read("c.json"));
  write_particles("in.0001.ply", block(3));
  run_well(
      {"extract", "in.####.ply", "-o", "s.####.png", "--camera", "c.####.json", "--size", "50%"});
  EXPECT_EQ(read("s.0001.png").substr(16, 8), read("b.png").substr(16, 8));  // width and height
  for (const char* size : {"0%", "-5%", "half%", "%", "2000%"})
    expect_error(run({"extract", "in.ply", "-o", "d.png", "--camera", "c.json", "--size", size}), 2,
                 {std::string("--size is ") + size, "e.g. 50%"});
  expect_error(run({"extract", "in.ply", "-o", "d.png", "--camera", "c.json", "--size", "32x24"}),
               2, {"--camera and --size are both given", "--size 50% takes a share"});
  EXPECT_FALSE(exists("d.png"));
}

TEST_F(ProgramBadInput, MissingCamera) {
  write_particles("in.ply", block(3));
  expect_error(run({"extract", "in.ply", "-o", "a.png", "--camera", "gone.json"}), 1,
               {"gone.json"});
}

TEST_F(ProgramBadInput, DegenerateEyeTargetUpAndFieldOfView) {
  write_particles("in.ply", block(3));
  const auto with = [&](const std::vector<std::string>& camera) {
    std::vector<std::string> words{"extract", "in.ply", "-o", "a.png", "-q"};
    words.insert(words.end(), camera.begin(), camera.end());
    return run(words);
  };
  expect_error(with({"--eye", "1,1,1", "--target", "1,1,1"}), 2, {"same point"});
  expect_error(with({"--eye", "0,-5,0", "--target", "0,0,0"}), 2, {"up"});
  expect_error(with({"--eye", "0,0,5", "--target", "0,0,0", "--fov", "180"}), 2, {"180"});
  EXPECT_FALSE(exists("a.png"));
}

// --- outputs that cannot be written
// ---------------------------------------------------------------

TEST_F(ProgramBadInput, NoFolderForTheOutput) {
  write_particles("in.ply", block(3));
  expect_error(run({"extract", "in.ply", "-o", "a.png", "-o", "no/b.exr"}), 1, {"no/b.exr"});
  EXPECT_THAT(files(), ElementsAre("in.ply"));
}

TEST_F(ProgramBadInput, OutputIsAFolder) {
  write_particles("in.ply", block(3));
  std::filesystem::create_directory(path("a.png"));
  expect_error(run({"extract", "in.ply", "-o", "a.png"}), 1, {"a.png"});
}

TEST_F(ProgramBadInput, FolderThatCannotBeWritten) {
  write_particles("in.ply", block(3));
  // No user, not even root, makes files there.
  expect_error(run({"extract", "in.ply", "-o", "/proc/a.png"}), 1, {"/proc/a.png"});
}

// The mesh is far below 4 MiB, the EXR has 640 * 480 * 11 * 4 bytes = 13.5 MB.
const std::vector<std::string> kSmallAndLarge{
    "extract", "in.ply", "--compression", "none", "--cell", "16", "--size",
    "640x480", "-o",     "a.obj",         "-o",   "a.exr"};
const Conditions kDiskFull{{}, 4 << 20};

TEST_F(ProgramBadInput, DiskFullLeavesEarlierOutputsAsTheyWere) {
  write_particles("in.ply", block(6));
  run_well(kSmallAndLarge);
  const std::string obj = read("a.obj"), exr = read("a.exr");
  write_particles("in.ply", block(5));
  expect_error(run(kSmallAndLarge, kDiskFull), 1, {"a.exr", "large"});
  EXPECT_THAT(files(), ElementsAre("a.exr", "a.obj", "in.ply"));
  EXPECT_TRUE(read("a.obj") == obj && read("a.exr") == exr);
}

TEST_F(ProgramBadInput, NoOutputAppearsUnlessAllAreComplete) {
  write_particles("in.ply", block(6));
  expect_error(run(kSmallAndLarge, kDiskFull), 1, {"a.exr"});
  EXPECT_THAT(files(), ElementsAre("in.ply"));
}

// --- devices
// --------------------------------------------------------------------------------------

TEST_F(ProgramBadInput, UnknownDeviceNamesTheOnesThereAre) {
  write_particles("in.ply", block(3));
  expect_error(run({"extract", "in.ply", "-q", "-o", "a.png", "--device", "nonesuch"}), 1,
               {"nonesuch", "0 \""});
  expect_error(run({"extract", "in.ply", "-q", "-o", "a.png", "--device", "99"}), 1,
               {"99", "0 \""});
  EXPECT_THAT(files(), ElementsAre("in.ply"));
}

TEST_F(ProgramBadInput, NoOpenClPlatform) {
  write_particles("in.ply", block(3));
  std::filesystem::create_directory(path("vendors"));
  const Conditions nothing{{{"OCL_ICD_VENDORS", path("vendors")}}};
  expect_error(run({"extract", "in.ply", "-q", "-o", "a.png"}, nothing), 1, {"OpenCL platform"});
  expect_error(run({"devices"}, nothing), 1, {"OpenCL platform"});
  EXPECT_THAT(files(), ElementsAre("in.ply", "vendors"));
}

TEST_F(ProgramBadInput, ADamagedCacheOfPoClIsNamed) {
  write_particles("in.ply", block(3));
  const Conditions own{{{"POCL_CACHE_DIR", path("cache")}}};
  const std::vector<std::string> words{"extract", "in.ply",   "-q",  "--size",   "64x48",  "-o",
                                       "a.png",   "--device", "cpu", "--method", "spheres"};
  if (run(words, own).exit_code != 0 || !exists("cache")) GTEST_SKIP() << "no PoCL";
  for (const std::size_t size : {0, 1000}) {  // no object at all; one whose end is missing
    for (const auto& entry : std::filesystem::recursive_directory_iterator(path("cache")))
      if (entry.path().extension() == ".so") std::filesystem::resize_file(entry.path(), size);
    const Outcome outcome = run(words, own);
    EXPECT_GT(outcome.exit_code, 128);
    EXPECT_THAT(outcome.err, HasSubstr("meniscus: error: ended by "));
    EXPECT_THAT(outcome.err, HasSubstr("remove " + path("cache") + ", or set POCL_CACHE_DIR"));
  }
}

TEST_F(ProgramBadInput, PoClWithoutALinkerIsOneLineThatNamesThePath) {
  write_particles("in.ply", block(3));
  const Conditions bare{{{"POCL_CACHE_DIR", path("cache")}, {"PATH", ""}}};
  const Outcome outcome = run({"extract", "in.ply", "-q", "--size", "64x48", "-o", "a.png",
                               "--device", "cpu", "--method", "spheres"},
                              bare);
  if (outcome.exit_code == 0) GTEST_SKIP() << "no PoCL, or one that links by itself";
  EXPECT_THAT(outcome.err, HasSubstr("because PATH is not set, where PoCL looks for the linker"));
}

// LLVM ended the process on a thread that builds, and what runs at exit waited for the others.
TEST_F(ProgramBadInput, AFullDiskUnderTheCacheOfPoClIsOneLine) {
  write_particles("in.ply", block(3));
  std::filesystem::create_directory(path("disk"));
  if (mount("tmpfs", path("disk").c_str(), "tmpfs", 0, "size=300k") != 0)
    GTEST_SKIP() << "no file system may be mounted here";
  Conditions full = in_time(120);
  full.environment = {{"POCL_CACHE_DIR", path("disk/pocl")},
                      {"MENISCUS_CACHE_DIR", path("disk/programs")}};
  const Outcome outcome =
      run({"extract", "in.ply", "-q", "--size", "64x48", "-o", "a.png", "--device", "cpu"}, full);
  umount(path("disk").c_str());
  if (outcome.exit_code == 0) GTEST_SKIP() << "no PoCL";
  EXPECT_NE(outcome.exit_code, 128 + SIGKILL) << "it hung";
  EXPECT_THAT(outcome.err, HasSubstr("meniscus: error: "));
  EXPECT_THAT(outcome.err, HasSubstr(path("disk/pocl")));
  EXPECT_THAT(outcome.err, HasSubstr("full"));
  EXPECT_FALSE(exists("a.png"));
}

TEST_F(ProgramBadInput, CacheThatCannotBeWrittenIsReplaced) {
  write_particles("in.ply", block(3));
  const Conditions homeless{{{"HOME", "/proc/none"},
                             {"XDG_CACHE_HOME", ""},
                             {"POCL_CACHE_DIR", ""},
                             {"TMPDIR", path("")}}};
  run_well({"extract", "in.ply", "--size", "64x48", "--method", "ssm", "-o", "a.png"}, homeless);
  EXPECT_TRUE(exists("a.png"));

  const Conditions nowhere{{{"HOME", "/proc/none"},
                            {"XDG_CACHE_HOME", ""},
                            {"POCL_CACHE_DIR", ""},
                            {"TMPDIR", "/proc/none"}}};
  expect_error(run({"extract", "in.ply", "-o", "b.png"}, nowhere), 1, {"POCL_CACHE_DIR"});
  EXPECT_FALSE(exists("b.png"));
}

// What PoCL finds in its cache it runs.
class TemporaryCache : public ProgramBadInput {
 protected:
  const std::string name = "tmp/meniscus-pocl-" + std::to_string(geteuid());

  static int mode_of(const fs::path& folder) {
    return static_cast<int>(fs::status(folder).permissions());
  }

  // Runs with what was found there; returns the folder that was used.
  fs::path used() const {
    // Programs are kept from run to run: what counts is the kernels that PoCL makes of them.
    const Conditions homeless{{{"HOME", "/proc/none"},
                               {"XDG_CACHE_HOME", ""},
                               {"POCL_CACHE_DIR", ""},
                               {"MENISCUS_CACHE_DIR", path("programs")},
                               {"TMPDIR", path("tmp")}}};
    run_well({"extract", "in.ply", "--size", "64x48", "--method", "ssm", "-o", "a.png"}, homeless);
    fs::path found;
    for (const auto& entry : fs::directory_iterator(path("tmp")))
      if (entry.is_directory() && !entry.is_symlink() && !fs::is_empty(entry)) found = entry.path();
    return found;
  }

  void renew() const {
    write_particles("in.ply", block(3));
    fs::remove_all(path("tmp"));
    fs::create_directory(path("tmp"));
  }
};

TEST_F(TemporaryCache, IsNotUsedWhereOthersCanWriteIt) {
  renew();
  EXPECT_EQ(used(), path(name));
  EXPECT_EQ(mode_of(path(name)), 0700);
  EXPECT_EQ(used(), path(name)) << "this user's own, made before";

  renew();
  fs::create_directory(path(name));
  fs::permissions(path(name), fs::perms::all);
  EXPECT_THAT(used().string(), testing::StartsWith(path(name) + "-"));
  EXPECT_EQ(mode_of(used()), 0700);
  EXPECT_TRUE(fs::is_empty(path(name)));

  renew();
  fs::create_directory(path("bait"));
  fs::permissions(path("bait"), fs::perms::owner_all);
  fs::create_directory_symlink("../bait", path(name));
  EXPECT_THAT(used().string(), testing::StartsWith(path(name) + "-"));
  EXPECT_TRUE(fs::is_empty(path("bait")));
}

TEST_F(TemporaryCache, IsNotUsedWhereItIsAnotherUsers) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can make another user's folder";
  renew();
  fs::create_directory(path(name));
  fs::permissions(path(name), fs::perms::owner_all);
  ASSERT_EQ(chown(path(name).c_str(), 65534, 65534), 0);
  EXPECT_THAT(used().string(), testing::StartsWith(path(name) + "-"));
  EXPECT_TRUE(fs::is_empty(path(name)));
}

TEST_F(ProgramBadInput, NamesSteerNoTerminalAndHaveAnEnd) {
  const std::string name = "\x1b[2J\x07\nmeniscus: error: \xff.ply";
  const Outcome missing = run({"extract", name, "-o", "a.png"});
  expect_error(missing, 1, {"\\x1b[2J\\x07", "\\xff.ply"});
  EXPECT_THAT(missing.err, testing::Not(HasSubstr("\x1b")));
  EXPECT_LT(run({"extract", std::string(100'000, 'n') + ".ply", "-o", "a.png"}).err.size(),
            20'000u);
  write_particles("Grüße.ply", block(3));
  EXPECT_THAT(
      run({"extract", "Grüße.ply", "--method", "spheres", "--size", "8x8", "-o", "ä\x1b.png"}).err,
      testing::AllOf(HasSubstr("Grüße.ply"), HasSubstr("ä\\x1b.png"),
                     testing::Not(HasSubstr("\x1b"))));
}

}  // namespace
}  // namespace meniscus::test
