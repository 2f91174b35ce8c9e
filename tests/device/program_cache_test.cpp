// Built programs on disk: taken where they fit, never where they do not, and no harm in either
// case.
#include "device/program_cache.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>
#include <vector>

#include "device/device.hpp"
#include "faults/failing_call.hpp"
#include "io/temporary_folder.hpp"

namespace meniscus {
namespace {

namespace fs = std::filesystem;
using testing::Each;

class ProgramCache : public testing::Test {
 protected:
  ProgramCache() { setenv("MENISCUS_CACHE_DIR", folder().c_str(), 1); }
  ~ProgramCache() override { unsetenv("MENISCUS_CACHE_DIR"); }

  std::string folder() const { return folder_ / "cache"; }

  std::vector<fs::path> entries() const {
    std::vector<fs::path> paths;
    if (fs::exists(folder()))
      for (const auto& entry : fs::directory_iterator(folder())) paths.push_back(entry.path());
    return paths;
  }

  static std::string read(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  static void write(const fs::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
  }

 private:
  TemporaryFolder folder_;
};

TEST_F(ProgramCache, FindsWhatWasKeptUnderTheSameKeyAlone) {
  EXPECT_EQ(find_program("driver 1\n"), "");
  const std::string binary("one\0two", 7);
  keep_program("driver 1\n", binary);
  EXPECT_EQ(find_program("driver 1\n"), binary);
  EXPECT_EQ(find_program("driver 2\n"), "");
  keep_program("driver 1\n", "other");
  EXPECT_EQ(find_program("driver 1\n"), "other");
  drop_program("driver 1\n");
  EXPECT_EQ(find_program("driver 1\n"), "");
  EXPECT_TRUE(entries().empty());
}

TEST_F(ProgramCache, IsThisUsersAlone) {
  setenv("MENISCUS_CACHE_DIR", (folder() + "/").c_str(), 1);
  keep_program("key\n", "binary");
  EXPECT_EQ(fs::status(folder()).permissions(), fs::perms::owner_all);
  for (const fs::perms others : {fs::perms::group_write, fs::perms::others_write}) {
    fs::permissions(folder(), others, fs::perm_options::add);
    EXPECT_EQ(find_program("key\n"), "");
    keep_program("other\n", "binary");
    EXPECT_EQ(entries().size(), 1u);
    fs::permissions(folder(), others, fs::perm_options::remove);
    EXPECT_EQ(find_program("key\n"), "binary");
  }
}

TEST_F(ProgramCache, TakesNoEntryThatIsCutOffOrDamagedAnywhere) {
  keep_program("key\n", "binary");
  ASSERT_EQ(entries().size(), 1u);
  const fs::path path = entries().front();
  const std::string whole = read(path);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    write(path, whole.substr(0, size));
    EXPECT_EQ(find_program("key\n"), "") << "of " << whole.size() << " bytes there are " << size;
  }
  for (std::size_t k = 0; k < whole.size(); ++k) {
    std::string damaged = whole;
    damaged[k] = static_cast<char>(damaged[k] ^ 1);
    write(path, damaged);
    EXPECT_EQ(find_program("key\n"), "") << "byte " << k;
  }
  write(path, whole + "x");
  EXPECT_EQ(find_program("key\n"), "");
  keep_program("key\n", "binary");
  EXPECT_EQ(find_program("key\n"), "binary");
}

TEST_F(ProgramCache, AnotherKeysEntryUnderThisOnesNameIsNotTaken) {
  keep_program("one\n", "binary");
  const fs::path one = entries().front();
  const std::string of_one = read(one);
  fs::remove(one);
  keep_program("two\n", "other");
  write(entries().front(), of_one);
  EXPECT_EQ(find_program("two\n"), "");
}

TEST_F(ProgramCache, SeveralWritersLeaveOneWholeEntry) {
  std::vector<std::string> binaries;
  for (char c = 'a'; c < 'i'; ++c) binaries.push_back(std::string(100'000, c));
  std::vector<std::string> seen;
  {
    std::vector<std::jthread> writers;
    for (const std::string& binary : binaries)
      writers.emplace_back([&] {
        for (int k = 0; k < 5; ++k) keep_program("key\n", binary);
      });
    for (int k = 0; k < 200; ++k) seen.push_back(find_program("key\n"));
  }
  seen.erase(std::remove(seen.begin(), seen.end(), ""), seen.end());  // before the first one
  EXPECT_THAT(seen, Each(testing::AnyOfArray(binaries)));
  EXPECT_THAT(binaries, testing::Contains(find_program("key\n")));
  EXPECT_EQ(entries().size(), 1u);
}

TEST_F(ProgramCache, KeepsNothingAndSaysNothingWhereItCannotWrite) {
  for (const char* folder : {"/proc/nowhere", "/dev/null/below"}) {
    setenv("MENISCUS_CACHE_DIR", folder, 1);
    keep_program("key\n", "binary");
    EXPECT_EQ(find_program("key\n"), "");
  }
}

TEST_F(ProgramCache, IsWhereTheEnvironmentSays) {
  EXPECT_EQ(program_cache_folder(), folder());
  unsetenv("MENISCUS_CACHE_DIR");
  const char* const home = std::getenv("HOME");
  const std::string before = home ? home : "";
  setenv("HOME", "/somewhere", 1);
  unsetenv("XDG_CACHE_HOME");
  EXPECT_EQ(program_cache_folder(), "/somewhere/.cache/meniscus");
  setenv("XDG_CACHE_HOME", "/var/cache", 1);
  EXPECT_EQ(program_cache_folder(), "/var/cache/meniscus");
  unsetenv("XDG_CACHE_HOME");
  unsetenv("HOME");
  EXPECT_EQ(program_cache_folder(), "");
  keep_program("key\n", "binary");
  EXPECT_EQ(find_program("key\n"), "");
  if (home) setenv("HOME", before.c_str(), 1);
}

// What a device does with it: launches a kernel on a device that is opened anew, and says whether
// its result was right and how the program was made.
struct Launched {
  bool right = false;
  long from_binary = 0, from_source = 0;
};

Launched launch_once(const std::string& failing = "") {
  Device device;
  device.state().keeps = Keeps::binaries;
  test::fail_call(failing);
  const auto from = filled<float>(device, 512, 3.0f), to = filled<float>(device, 512, 0.0f);
  launch(device, "probe.cl", "copy_values", {128}, width_option(1), from, to);
  const std::vector<std::string> calls = test::calls_made();
  test::fail_call("");
  return {download(device, to) == std::vector<float>(512, 3.0f),
          std::count(calls.begin(), calls.end(), "clCreateProgramWithBinary"),
          std::count(calls.begin(), calls.end(), "clCreateProgramWithSource")};
}

TEST_F(ProgramCache, ADeviceBuildsOnceAndThenTakesTheBinary) {
  const Launched first = launch_once();
  EXPECT_TRUE(first.right);
  EXPECT_EQ(first.from_binary, 0);
  EXPECT_EQ(first.from_source, 1);
  ASSERT_EQ(entries().size(), 1u);
  const Launched second = launch_once();
  EXPECT_TRUE(second.right);
  EXPECT_EQ(second.from_binary, 1);
  EXPECT_EQ(second.from_source, 0);
}

TEST_F(ProgramCache, WhatTheDriverRefusesIsBuiltAnewAndReplaced) {
  launch_once();
  ASSERT_EQ(entries().size(), 1u);
  const fs::path entry = entries().front();
  const std::string whole = read(entry);
  for (const char* call : {"clCreateProgramWithBinary:1", "clBuildProgram:1"}) {
    const Launched refused = launch_once(call);
    EXPECT_TRUE(refused.right) << call;
    EXPECT_EQ(refused.from_binary, 1) << call;
    EXPECT_EQ(refused.from_source, 1) << call;
    ASSERT_EQ(entries().size(), 1u) << call;
    EXPECT_EQ(launch_once().from_source, 0) << call;
  }
  write(entry, whole.substr(0, whole.size() / 2));
  EXPECT_EQ(launch_once().from_source, 1);
  EXPECT_EQ(launch_once().from_source, 0);
}

TEST_F(ProgramCache, ADriverThatGivesNoBinaryAwayIsNoError) {
  for (const char* call : {"clGetProgramInfo:1", "clGetProgramInfo:2"}) {
    const Launched launched = launch_once(call);
    EXPECT_TRUE(launched.right) << call;
    EXPECT_TRUE(entries().empty()) << call;
  }
}

TEST_F(ProgramCache, ChangedKernelsAreNotKept) {
  Device device;
  device.state().keeps = Keeps::binaries;
  device.state().kernel_text = [](const std::string&, const std::string& text) { return text; };
  const auto from = filled<float>(device, 512, 3.0f), to = filled<float>(device, 512, 0.0f);
  launch(device, "probe.cl", "copy_values", {128}, width_option(1), from, to);
  EXPECT_TRUE(entries().empty());
}

}  // namespace
}  // namespace meniscus
