// A batch whose devices fail: no frame is lost that a device can still do.
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "faults/faulty_runtime.hpp"

namespace meniscus::test {
namespace {

using testing::Each;
using testing::HasSubstr;
using testing::IsEmpty;

class FaultyBatch : public FaultyRuntime {
 protected:
  static constexpr int kFrames = 8;

  /// d.0000.ply and so on, and what comes of them where nothing fails.
  std::map<std::string, std::string> whole() {
    for (int frame = 0; frame < kFrames; ++frame)
      write_particles("d.000" + std::to_string(frame) + ".ply", block(3 + frame % 3));
    run_well(words());
    const auto bytes = outputs("o.");
    for (const auto& [file, content] : bytes) std::filesystem::remove(path(file));
    return bytes;
  }

  static std::vector<std::string> words(const std::vector<std::string>& more = {}) {
    return Words{"extract", "d.####.ply", "--size", "64x48", "-o",       "o.####.exr",
                 "-o",      "o.####.ply", "--eye",  "1,1,3", "--target", "0,0,0"} +
           more;
  }

  std::vector<nlohmann::json> log() const {
    std::vector<nlohmann::json> records;
    std::istringstream lines(read("log.jsonl"));
    for (std::string line; std::getline(lines, line);)
      records.push_back(nlohmann::json::parse(line));
    return records;
  }

  int warned(const std::string& what) const {
    int records = 0;
    for (const nlohmann::json& record : log())
      records += count(record["warnings"].dump(), what) > 0;
    return records;
  }
};

TEST_F(FaultyBatch, AFrameIsExtractedAgainWhenMemoryRanOut) {
  const auto expected = whole();
  const Outcome outcome = run_well(words({"--log", "log.jsonl"}),
                                   failing({{"MENISCUS_FAIL_CALL", "clEnqueueNDRangeKernel:50"}}));
  EXPECT_EQ(outputs("o."), expected);
  EXPECT_EQ(warned("extracted again in smaller chunks after: "), 1) << read("log.jsonl");
  EXPECT_THAT(outcome.err, HasSubstr("extracted again in smaller chunks after: "));
}

// Each frame fits by itself: what two of them take at once, and what idle threads keep, does not.
TEST_F(FaultyBatch, FramesThatDoNotFitSideBySideAreExtractedAlone) {
  const auto expected = whole();
  long least = 1 << 16;  // bytes; the least that single frames take
  while (run({"extract", "d.0002.ply", "--size", "64x48", "-o", "single.exr", "-o", "single.ply",
              "--eye", "1,1,3", "--target", "0,0,0"},
             failing({{"MENISCUS_DEVICE_MEMORY", std::to_string(least)}}))
             .exit_code != 0)
    least += least / 8;
  run_well(words({"--log", "log.jsonl", "--in-flight", "4"}),
           failing({{"MENISCUS_DEVICE_MEMORY", std::to_string(least + least / 16)}}));
  EXPECT_EQ(outputs("o."), expected);
  EXPECT_GT(warned("extracted again in smaller chunks after: "), 0) << read("log.jsonl");
}

TEST_F(FaultyBatch, AnotherDeviceDoesTheFramesOfOneThatFails) {
  const auto expected = whole();
  // Since its version 5 PoCL calls these devices cpu and cpu-minimal.
  const std::pair<std::string, std::string> two{"POCL_DEVICES", "pthread basic"};
  const bool renamed = run({"devices"}, {{two}}).out.find("cpu-minimal") != std::string::npos;
  const std::string bad = renamed ? "cpu-minimal" : "basic", good = renamed ? "cpu" : "pthread";
  const Conditions conditions = failing({{"MENISCUS_FAIL_CALL", "clEnqueueNDRangeKernel:1+"},
                                         {"MENISCUS_FAIL_CODE", "-54"},
                                         {"MENISCUS_FAIL_DEVICE", bad},
                                         two});
  run_well(words({"--log", "log.jsonl", "--device", "all", "--in-flight", "1"}), conditions);
  EXPECT_EQ(outputs("o."), expected);
  std::set<std::string> devices;
  for (const nlohmann::json& record : log()) devices.insert(record["device"]);
  EXPECT_THAT(devices, Each(testing::AllOf(testing::StartsWith(good),
                                           testing::Not(testing::StartsWith(bad)))));
  const int moved = warned("extracted on another device after: ");
  EXPECT_GE(moved, 1);
  EXPECT_LE(moved, 3);
  EXPECT_EQ(warned("gets no more"), moved == 3 ? 1 : 0);
}

TEST_F(FaultyBatch, WithoutAnotherDeviceEveryFrameFailsByItself) {
  whole();
  const Outcome outcome =
      run(words({"--log", "log.jsonl"}), failing({{"MENISCUS_FAIL_CALL", "clCreateKernel:1+"}}));
  expect_error(outcome, 3, {"8 of 8 frames failed: 0-7"});
  EXPECT_THAT(outputs("o."), IsEmpty());
  EXPECT_THAT(outputs(".meniscus"), IsEmpty());
  for (const nlohmann::json& record : log())
    EXPECT_THAT(record["error"].get<std::string>(),
                HasSubstr("clCreateKernel failed with CL_INVALID_KERNEL_NAME (-46)"));
}

}  // namespace
}  // namespace meniscus::test
