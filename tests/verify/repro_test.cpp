// Reproducers: what stands in their folders.
#include "verify/repro.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "io/temporary_folder.hpp"
#include "meniscus/error.hpp"

namespace meniscus::verify {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string read(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

// fill_words of fill.cl with two buffers' worth of made-up values.
SavedLaunch launch_of(std::optional<Bytes> expected) {
  SavedLaunch launch{"fill.cl", "fill_words", "", "kernel text", "-D WIDTH=8", {1}, {64}, {}};
  const Bytes before(70, 1);
  launch.arguments.push_back({"words", true, true, before, 1152, 7, std::move(expected)});
  launch.arguments.push_back({"value", false, false, {0, 0, 128, 63}, 0, 0, {}});
  return launch;
}

class Reproducer : public testing::Test {
 protected:
  Reproducers of(OtherDevices others = {}) {
    DeviceInfo info;
    info.index = 3;
    info.name = "A GPU";
    info.platform = "P";
    info.driver = "1.2\n";
    Reproducers reproducers(folder_.path().string(), info, std::move(others));
    reproducers.set_case("width 8, groups of 16", "fit on block");
    return reproducers;
  }
  TemporaryFolder folder_;
};

TEST_F(Reproducer, HoldsAllThatALaunchTakes) {
  Reproducers reproducers = of();
  EXPECT_TRUE(reproducers.wants("fill_words"));
  Bytes found(70, 1);
  found[5] = 2;
  const std::string path =
      reproducers.write(launch_of(Bytes(70, 1)), "launch 2 of 3", {found, {}}, "");
  EXPECT_FALSE(reproducers.wants("fill_words"));
  EXPECT_FALSE(of().wants("fill_words")) << "nor does another process";
  EXPECT_TRUE(reproducers.wants("other"));
  EXPECT_THAT(folder_.entries(), ElementsAre("fill_words.width_8_groups_of_16.device_3"));
  EXPECT_EQ(path, folder_ / "fill_words.width_8_groups_of_16.device_3");

  EXPECT_THAT(read(path + "/README.md"),
              AllOf(HasSubstr("# fill_words on A GPU"),
                    HasSubstr("**argument words: 1 of 18 values differ, the first at 1: found "
                              "0x01010201 (2.36949957e-38), wanted 0x01010101 (2.36942783e-38)**"),
                    HasSubstr("launch 2 of 3 of fit on block, width 8, groups of 16"),
                    HasSubstr("A GPU, P, driver 1.2 ,"), HasSubstr("`-D WIDTH=8`"),
                    HasSubstr("part of Meniscus"), HasSubstr("stays as it is")));
  EXPECT_THAT(read(path + "/launch.txt"),
              HasSubstr("kernel fill_words\noptions -D WIDTH=8\nrange 64 1 groups 64 1\n"
                        "buffer words floats 1 entry 0 bytes 70 room 1152 00_words.before.bin "
                        "00_words.before.bin\nscalar value 0000803f\n"));
  EXPECT_EQ(read(path + "/kernel.cl"), "kernel text");
  EXPECT_EQ(read(path + "/00_words.before.bin"), std::string(70, '\1'));
  const std::string host = read(path + "/host.c");
  EXPECT_LT(std::count(host.begin(), host.end(), '\n'), 200);
}

TEST_F(Reproducer, SaysWhereNobodyKnowsTheValues) {
  Reproducers reproducers = of();
  const std::string path = reproducers.write(launch_of({}), "launch 1", {Bytes(70, 2), {}}, "");
  EXPECT_THAT(read(path + "/README.md"),
              AllOf(HasSubstr("**argument words: other bits than the canonical ones**"),
                    HasSubstr("Expected bits: not known")));
  EXPECT_THAT(read(path + "/launch.txt"), HasSubstr("00_words.before.bin -\n"));
}

TEST_F(Reproducer, AsksAnotherDeviceAndBelievesItsHashAlone) {
  Device device;
  std::vector<std::size_t> asked;
  const OtherDevices others = [&](std::size_t k) -> Device* {
    asked.push_back(k);
    return k == 0 ? &device : nullptr;
  };
  // 16 words of 16 floats each: fill_words stores vectors of 16.
  SavedLaunch launch{"fill.cl", "fill_words", "", "", "", {1}, {64}, {}};
  const float value = 2;
  Bytes scalar(4), filled(64);
  std::copy_n(reinterpret_cast<const std::uint8_t*>(&value), 4, scalar.begin());
  for (std::size_t k = 0; k < filled.size(); ++k) filled[k] = scalar[k % 4];
  launch.arguments.push_back({"words", true, false, Bytes(64), 1152, 0, {}});
  launch.arguments.push_back({"value", false, false, scalar, 0, 0, {}});
  launch.arguments.push_back({"n", false, false, {1, 0, 0, 0}, 0, 0, {}});
  launch.arguments[0].hash = hash_of(filled, "words");
  const std::string path = of(others).write(launch, "launch 1", {Bytes(64, 9), {}, {}}, "");
  EXPECT_THAT(read(path + "/README.md"),
              AllOf(HasSubstr("whose hash is the canonical one"), HasSubstr(device.info().name)));
  EXPECT_EQ(read(path + "/00_words.expected.bin"), std::string(filled.begin(), filled.end()));

  launch.kernel = "fill_words";
  launch.arguments[0].hash ^= 1;
  Reproducers other = of(others);
  other.set_case("width 1", "");
  const std::string unknown = other.write(launch, "launch 1", {Bytes(64, 9), {}, {}}, "");
  EXPECT_THAT(read(unknown + "/README.md"), HasSubstr("Expected bits: not known"));
  EXPECT_THAT(asked, ElementsAre(0, 0, 1));
}

TEST_F(Reproducer, OfAKernelThatEndedTheProcessSaysHow) {
  Reproducers reproducers = of();
  reproducers.set_ended({{"fill_words", "while it ran, the process was ended by signal 11"}});
  EXPECT_EQ(reproducers.how_it_ended("other"), "");
  const std::string path = reproducers.write(launch_of(Bytes(70, 3)), "launch 1", {},
                                             reproducers.how_it_ended("fill_words"));
  EXPECT_THAT(read(path + "/README.md"),
              HasSubstr("**while it ran, the process was ended by signal 11**"));
  EXPECT_EQ(read(path + "/00_words.expected.bin"), std::string(70, '\3'));
}

TEST_F(Reproducer, IsNoneWhereItsFolderCannotBeWritten) {
  std::ofstream(folder_ / "file") << "x";
  DeviceInfo info;
  Reproducers reproducers(folder_ / "file", info, {});
  EXPECT_THROW(reproducers.write(launch_of({}), "launch 1", {}, "crashed"), OutputError);
}

TEST(FolderOfReproducers, LosesWhatWasNotFinished) {
  const TemporaryFolder folder;
  const std::string path = folder / "new";
  make_folder(path);
  std::filesystem::create_directories(path + "/.k.part/below");
  std::filesystem::create_directories(path + "/b");
  std::filesystem::create_directories(path + "/a");
  EXPECT_THAT(finish_folder(path), ElementsAre("a", "b"));
  EXPECT_THROW(make_folder(path), InvalidArgument) << "it is not empty";
  std::filesystem::remove_all(path);
  make_folder(path);
  std::filesystem::create_directories(path + "/.k.part");
  EXPECT_THAT(finish_folder(path), IsEmpty());
  EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace meniscus::verify
