#include "cli/report.hpp"

#include <algorithm>
#include <cstdio>

namespace meniscus::cli {

std::string counts_line(const std::vector<std::pair<std::string, std::int64_t>>& counts) {
  std::string line;
  for (const auto& [name, count] : counts)
    line += (line.empty() ? "" : ", ") + grouped(count) + " " + name;
  return line;
}

void print_timings(const std::vector<StageTime>& stages,
                   const std::vector<std::pair<std::string, std::int64_t>>& counts) {
  std::vector<StageTime> rows;  // one a stage, though some run several times
  StageTime all{"all stages", 0, 0, {}};
  for (const StageTime& stage : stages) {
    auto row = std::find_if(rows.begin(), rows.end(),
                            [&](const StageTime& r) { return r.stage == stage.stage; });
    if (row == rows.end()) row = rows.insert(rows.end(), StageTime{stage.stage, 0, 0, {}});
    for (StageTime* sum : {&*row, &all}) {
      sum->host_ms += stage.host_ms;
      sum->device_ms += stage.device_ms;
    }
  }
  rows.push_back(all);
  std::printf("%-16s %12s %12s\n", "stage", "host ms", "device ms");
  for (const StageTime& row : rows)
    std::printf("%-16s %12.2f %12.2f\n", row.stage.c_str(), row.host_ms, row.device_ms);
  std::printf("\n%-16s %12s\n", "what", "count");
  for (const auto& [name, count] : counts)
    std::printf("%-16s %12s\n", name.c_str(), grouped(count).c_str());
}

void print_memory(std::uint64_t device_bytes, std::uint64_t host_bytes) {
  std::printf("\n%-16s %12s\n", "memory", "peak");
  std::printf("%-16s %12s\n", "device buffers", size_of(device_bytes).c_str());
  std::printf("%-16s %12s\n", "whole program", size_of(host_bytes).c_str());
}

}  // namespace meniscus::cli
