#include "program/cli/report.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "base/comma_separated.hpp"
#include "device/stage_clock.hpp"
#include "frame/process.hpp"

namespace meniscus::cli {

namespace {

// The counts by the names that people read.
std::vector<std::pair<std::string, std::int64_t>> shown(const Counts& counts) {
  auto all = named(counts);
  for (auto& [name, count] : all)
    if (counts.streamed && name == "in view") name = "used";
  return all;
}

}  // namespace

std::string counts_line(const Counts& counts) {
  return comma_separated(shown(counts), [](const auto& entry) {
    const auto& [name, count] = entry;
    const bool is_plural = name.ends_with('s');  // "1 triangle", but "1 in view"
    return grouped(count) + " " +
           (count == 1 && is_plural ? name.substr(0, name.size() - 1) : name);
  });
}

void print_timings(const std::vector<StageTime>& stages, const Counts& counts) {
  std::vector<StageTime> rows;  // one a stage, though some run several times
  StageTime all{"all stages", 0, 0, {}};
  for (const StageTime& stage : stages) {
    auto row = std::find_if(rows.begin(), rows.end(),
                            [&](const StageTime& r) { return r.stage == stage.stage; });
    if (row == rows.end()) row = rows.insert(rows.end(), StageTime{stage.stage, 0, 0, {}});
    const bool is_stage =
        stage.stage != kReading && stage.stage != kWriting && stage.stage != kBuilding;
    for (StageTime* sum : {&*row, is_stage ? &all : nullptr}) {
      if (!sum) continue;
      sum->host_ms += stage.host_ms;
      sum->device_ms += stage.device_ms;
    }
  }
  rows.push_back(all);
  std::printf("%-16s %12s %12s\n", "stage", "host ms", "device ms");
  for (const StageTime& row : rows)
    std::printf("%-16s %12.2f %12.2f\n", row.stage.c_str(), row.host_ms, row.device_ms);
  std::printf("\n%-16s %12s\n", "what", "count");
  for (const auto& [name, count] : shown(counts))
    std::printf("%-16s %12s\n", name.c_str(), grouped(count).c_str());
}

void print_memory(std::uint64_t device_bytes, std::uint64_t host_bytes) {
  std::printf("\n%-16s %12s\n", "memory", "peak");
  std::printf("%-16s %12s\n", "device buffers", size_of(device_bytes).c_str());
  std::printf("%-16s %12s\n", "whole program", size_of(host_bytes).c_str());
}

RankReport report_of(const std::vector<StageTime>& stages, double waited_ms,
                     std::uint64_t device_bytes) {
  const auto spent_in = [&](const char* stage) {
    double sum = 0;
    for (const StageTime& time : stages)
      if (time.stage == stage) sum += time.host_ms;
    return sum;
  };
  return {spent_in("survey"), spent_in("fronts"), spent_in("select"), waited_ms,
          processor_ms(),     device_bytes,       peak_memory()};
}

void print_ranks(const std::vector<RankReport>& ranks) {
  std::printf("\n%-6s %12s %12s %12s %12s %14s %16s %16s\n", "rank", "survey ms", "fronts ms",
              "select ms", "waited ms", "processor ms", "device buffers", "whole program");
  for (std::size_t k = 0; k < ranks.size(); ++k)
    std::printf("%-6zu %12.2f %12.2f %12.2f %12.2f %14.2f %16s %16s\n", k, ranks[k].survey_ms,
                ranks[k].fronts_ms, ranks[k].select_ms, ranks[k].waited_ms, ranks[k].processor_ms,
                size_of(ranks[k].device_bytes).c_str(), size_of(ranks[k].host_bytes).c_str());
}

}  // namespace meniscus::cli
