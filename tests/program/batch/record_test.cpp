#include "program/batch/record.hpp"

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <thread>

#include "cost.hpp"
#include "io/sample_surface.hpp"
#include "io/temporary_folder.hpp"
#include "meniscus/error.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

FrameRecord full_record() {
  FrameRecord r;
  r.frame = -12;
  r.status = FrameStatus::failed;
  r.input = "a \"b\"\\\n<c>.ply";
  r.outputs = {"Größe.exr", "b.png"};
  r.version = "1.2.3";
  r.method = "fit";
  r.size = "1024x768";
  r.radius = 1.2345678901e-9;
  r.device = "cpu";
  r.host = "node1";
  r.shard = "1/2";
  r.start = 1732200000.123;
  r.end = 1732200001.5;
  r.read_ms = 1.5;
  r.extract_ms = 250.25;
  r.write_ms = 31;
  r.stages = {{"zebra", 1.25}, {"antelope", 2}};
  r.counts = {{"particles", 1'000'000'000'000}, {"fits", 7}};
  r.residual = 0.03125;
  r.disorder = 0.25;
  r.hash = "0123456789abcdef";
  r.bytes = std::numeric_limits<std::uint64_t>::max();
  r.warnings = {"one", "two"};
  r.error = "a.ply: is empty (0 bytes)";
  return r;
}

void put(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

std::vector<FrameRecord> read(const std::string& path) {
  std::string note;
  auto records = read_log(path, &note);
  EXPECT_EQ(note, "");
  return records;
}

TEST(Record, ComesBackAsItWasWritten) {
  const TemporaryFolder folder;
  FrameRecord plain;
  plain.frame = 3;
  {
    BatchLog log(folder / "a.jsonl");
    log.add(full_record());
    log.add(plain);
  }
  BatchLog(folder / "a.jsonl").add(plain);  // a second run
  EXPECT_THAT(read(folder / "a.jsonl"), ElementsAre(full_record(), plain, plain));
}

TEST(Record, IsOneLineOfJsonWithTheKeysOfTheDocumentation) {
  const std::string line = to_json(full_record());
  EXPECT_EQ(line.find('\n'), std::string::npos);
  const auto json = nlohmann::json::parse(line);
  EXPECT_EQ(json["status"], "failed");
  EXPECT_EQ(json["stages"]["zebra"], 1.25);
  EXPECT_EQ(json["error"], full_record().error);
  std::vector<std::string> keys;
  for (const auto& [key, value] : json.items()) keys.push_back(key);
  EXPECT_THAT(
      keys, testing::UnorderedElementsAre(
                "frame", "status", "input", "outputs", "version", "method", "size", "radius",
                "device", "host", "shard", "start", "end", "read_ms", "extract_ms", "write_ms",
                "stages", "counts", "residual", "disorder", "hash", "bytes", "warnings", "error"));
  for (const char* key : {"error", "disorder", "version", "size", "radius"})
    EXPECT_FALSE(nlohmann::json::parse(to_json(FrameRecord{})).contains(key));
}

TEST(Record, AnyBytesOfAPathGiveValidJson) {
  FrameRecord record;
  record.input = "caf\xe9.ply";
  EXPECT_EQ(nlohmann::json::parse(to_json(record))["input"], "caf\xef\xbf\xbd.ply");
}

TEST(Record, UnknownKeysAndEmptyLinesAreLeftOut) {
  const TemporaryFolder folder;
  put(folder / "a.jsonl",
      "\n{\"frame\": 4, \"status\": \"skipped\", \"new\": [1], \"residual\": null}\r\n\n");
  const auto records = read(folder / "a.jsonl");
  ASSERT_EQ(records.size(), 1u);
  EXPECT_EQ(records[0].frame, 4);
  EXPECT_EQ(records[0].status, FrameStatus::skipped);
  EXPECT_FALSE(records[0].residual);
}

TEST(Record, ALastLineThatWasCutOffIsLeftOutWithANote) {
  const TemporaryFolder folder;
  const std::string whole = to_json(full_record()) + "\n", line = to_json(full_record());
  for (std::size_t size = 0; size <= line.size(); ++size) {
    put(folder / "a.jsonl", whole + line.substr(0, size));
    std::string note;
    const auto records = read_log(folder / "a.jsonl", &note);
    const bool cut = size > 0 && size < line.size();
    EXPECT_EQ(records.size(), size == line.size() ? 2u : 1u) << size;
    EXPECT_EQ(note.empty(), !cut) << size;
    if (cut) {
      EXPECT_THAT(note, HasSubstr("line 2 is cut off"));
    }
    // A log that goes on does so behind the last whole line.
    BatchLog(folder / "a.jsonl").add(FrameRecord{});
    EXPECT_THAT(read(folder / "a.jsonl"), ElementsAre(full_record(), FrameRecord{})) << size;
  }
}

TEST(Record, AnyOtherBadLineIsAnErrorWithItsNumber) {
  const TemporaryFolder folder;
  const std::string good = to_json(full_record());
  const auto message = [&](const std::string& line) {
    put(folder / "a.jsonl", good + "\n\n" + line + "\n");
    return text_of_thrown<InputError>([&] {
      std::string note;
      read_log(folder / "a.jsonl", &note);
    });
  };
  const auto expect = [&](const std::string& line, const std::string& what) {
    EXPECT_THAT(
        message(line),
        testing::AllOf(testing::StartsWith((folder / "a.jsonl") + ": line 3"), HasSubstr(what)));
  };
  expect("{\"frame\": 1, \"status\": \"do", "is not JSON");
  expect("[1]", "wanted {\"frame\"");
  expect("{\"frame\": 1}", "has no \"status\"");
  expect("{\"status\": \"done\"}", "has no \"frame\"");
  expect("{\"frame\": 1.5, \"status\": \"done\"}", "\"frame\" is \"1.5\", wanted a whole number");
  expect("{\"frame\": 1e30, \"status\": \"done\"}", "whole number");
  expect("{\"frame\": 18446744073709551615, \"status\": \"done\"}", "whole number");
  expect("{\"frame\": 9223372036854775807, \"status\": \"done\"}", "\"frame\" is ");
  expect("{\"frame\": -9223372036854775808, \"status\": \"done\"}", "\"frame\" is ");
  expect("{\"frame\": 1, \"status\": \"good\"}", "wanted done, failed or skipped");
  expect("{\"frame\": 1, \"status\": \"done\", \"read_ms\": \"1\"}", "\"read_ms\"");
  expect("{\"frame\": 1, \"status\": \"done\", \"outputs\": \"a\"}", "wanted a list");
  expect("{\"frame\": 1, \"status\": \"done\", \"counts\": {\"a\": \"b\"}}", "\"counts\"");
  expect("{\"frame\": 1, \"status\": \"done\", \"stages\": [1]}", "\"stages\"");
  EXPECT_EQ(message(good), "no error");
}

TEST(Record, LinesOfManyThreadsStayWhole) {
  const TemporaryFolder folder;
  {
    BatchLog log(folder / "a.jsonl");
    std::vector<std::jthread> threads;
    for (int thread = 0; thread < 4; ++thread)
      threads.emplace_back([&log] {
        for (int k = 0; k < 200; ++k) log.add(full_record());
      });
  }
  EXPECT_THAT(read(folder / "a.jsonl"), testing::SizeIs(800));
}

std::string refused(const std::string& path) {
  return text_of_thrown<OutputError>([&] { BatchLog log(path); });
}

// Nobody reads it; and what was written could not be read again.
TEST(Record, ALogIsNoPipe) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkfifo((folder / "a.jsonl").c_str(), 0600), 0);
  EXPECT_EQ(refused(folder / "a.jsonl"),
            (folder / "a.jsonl") + ": is a pipe, wanted a file (give --log another name)");
}

// The rule of other outputs (OutputFile): one's own links are followed, another user's in a folder
// where everyone may make one are not.
TEST(Record, ALogFollowsLinksAsOtherOutputsDo) {
  const TemporaryFolder folder;
  std::filesystem::create_symlink("real.jsonl", folder / "own.jsonl");
  BatchLog(folder / "own.jsonl").add(full_record());
  EXPECT_THAT(read(folder / "real.jsonl"), ElementsAre(full_record()));
  if (geteuid() != 0) GTEST_SKIP() << "only root can make another user's link";
  constexpr uid_t kOther = 65534;
  std::filesystem::create_directory(folder / "shared");
  std::filesystem::create_symlink("../precious", folder / "shared/log");
  ASSERT_EQ(lchown((folder / "shared/log").c_str(), kOther, kOther), 0);
  ASSERT_EQ(chmod((folder / "shared").c_str(), 01777), 0);
  EXPECT_THAT(refused(folder / "shared/log"), HasSubstr("a symbolic link of another user"));
  EXPECT_FALSE(std::filesystem::exists(folder / "precious"));
}

// Two shards share a log, and one of them is killed, or meets a full disk, in the middle of a line.
TEST(Record, HalfALineOfOneProcessDoesNotSpoilThatOfAnother) {
  const TemporaryFolder folder;
  BatchLog log(folder / "a.jsonl");
  log.add(full_record());
  std::ofstream(folder / "a.jsonl", std::ios::binary | std::ios::app) << "{\"frame\": 7, \"sta";
  log.add(full_record());
  EXPECT_THAT(read(folder / "a.jsonl"), ElementsAre(full_record(), full_record()));
}

TEST(Record, ALineThatDoesNotFitOnTheDiskLeavesNothing) {
  const TemporaryFolder folder;
  BatchLog log(folder / "a.jsonl"), other(folder / "a.jsonl");
  log.add(full_record());
  const auto size = std::filesystem::file_size(folder / "a.jsonl");
  // A limit on the file's size cuts a write as a full disk does.
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit full{size + 100, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &full);
  EXPECT_THROW(log.add(full_record()), OutputError);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  other.add(full_record());
  EXPECT_THAT(read(folder / "a.jsonl"), ElementsAre(full_record(), full_record()));
}

TEST(Record, AnEmptyLogHasNoRecords) {
  const TemporaryFolder folder;
  { BatchLog log(folder / "a.jsonl"); }
  EXPECT_THAT(read(folder / "a.jsonl"), IsEmpty());
}

TEST(Record, SaysWhenALogCannotBeWrittenOrRead) {
  const TemporaryFolder folder;
  EXPECT_THROW(BatchLog(folder / "none/a.jsonl"), OutputError);
  std::string note;
  EXPECT_THROW(read_log(folder / "a.jsonl", &note), InputError);
}

TEST(Record, DeepNestingIsABadLineAndNoCrash) {
  const TemporaryFolder folder;
  put(folder / "a.jsonl", "{\"frame\": 1, \"status\": " + std::string(200'000, '[') +
                              std::string(200'000, ']') + "}\n");
  std::string note;
  EXPECT_THROW(read_log(folder / "a.jsonl", &note), InputError);
}

TEST(Record, AnObjectOfManyKeysIsABadLine) {
  const TemporaryFolder folder;
  std::string line = "{\"frame\": 1, \"status\": \"done\", \"stages\": {";
  for (int k = 0; k < 200'000; ++k) line += "\"stage " + std::to_string(k) + "\": 1, ";
  put(folder / "a.jsonl", line + "\"last\": 1}}\n");
  const Cost cost = cost_of([&] {
    std::string note;
    try {
      read_log(folder / "a.jsonl", &note);
    } catch (const InputError&) {
      return;
    }
    _exit(1);
  });
  EXPECT_LT(cost.seconds, 5);
}

}  // namespace
}  // namespace meniscus
