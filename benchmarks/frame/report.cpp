#include "frame/report.hpp"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "base/grouped.hpp"
#include "meniscus/extract.hpp"

namespace meniscus {
namespace {

using nlohmann::ordered_json;

// Three significant digits, as people read times.
std::string milliseconds(double ms) {
  char text[32];
  std::snprintf(text, sizeof text, ms < 9.995 ? "%.2f" : ms < 99.95 ? "%.1f" : "%.0f", ms);
  return text;
}

std::string mebibytes(std::uint64_t bytes) {
  return milliseconds(static_cast<double>(bytes) / (1 << 20));
}

struct CommandKind {
  const char* name;
  std::int64_t CommandCounts::*count;
};
constexpr CommandKind kCommandKinds[]{
    {"launches", &CommandCounts::launches}, {"arguments", &CommandCounts::arguments},
    {"fills", &CommandCounts::fills},       {"uploads", &CommandCounts::uploads},
    {"reads", &CommandCounts::reads},       {"waits", &CommandCounts::waits}};

ordered_json json_of(const FrameFigures& f) {
  ordered_json stages = ordered_json::object(), device = stages, kernels = stages;
  for (const StageFigures& stage : f.stages) {
    stages[stage.stage] = stage.host_ms;
    device[stage.stage] = stage.device_ms;
    for (const auto& [name, ms] : stage.kernels) kernels[stage.stage][name] = ms;
  }
  ordered_json commands;
  for (const CommandKind& kind : kCommandKinds) commands[kind.name] = f.commands.*kind.count;
  return {{"frame", f.frame},
          {"method", f.method},
          {"layers", f.layers},
          {"particles", f.particles},
          {"width", f.width},
          {"height", f.height},
          {"pixels", f.pixels},
          {"mesh", f.mesh},
          {"streamed", f.streamed},
          {"median_ms", f.median_ms},
          {"least_ms", f.least_ms},
          {"p10_ms", f.p10_ms},
          {"p90_ms", f.p90_ms},
          {"cpu_ms", f.cpu_ms},
          {"frames", f.frames},
          {"first_ms", f.first_ms},
          {"frames_per_second", f.frames_per_second},
          {"in_flight", f.in_flight},
          {"overlapped_cpu_ms", f.overlapped_cpu_ms},
          {"commands", commands},
          {"stages", stages},
          {"device_stages", device},
          {"kernels", kernels},
          {"device_bytes", f.device_bytes},
          {"host_bytes", f.host_bytes}};
}

// Rows of cells, the columns as wide as they must be: the first to the left, the rest to the right.
std::string aligned(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()), 0);
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  std::string text;
  for (const auto& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string space(widths[c] - row[c].size(), ' ');
      text += c == 0 ? row[c] + space : "  " + space + row[c];
    }
    text.erase(text.find_last_not_of(' ') + 1);
    text += '\n';
  }
  return text;
}

std::string heading(const FrameFigures& f) {
  return f.frame + ": " + grouped(f.particles) + " particles, " + std::to_string(f.width) + "x" +
         std::to_string(f.height) + (f.streamed ? ", with reading the file" : "") +
         (f.mesh ? ", with the mesh" : "");
}

// What a row or a column is of.
std::string measured(const FrameFigures& f) {
  return f.layers == 0 ? f.method : f.method + ", " + std::to_string(f.layers) + " layers";
}

// The stages of the methods of one frame, one column a method.
std::string stage_table(const std::vector<const FrameFigures*>& methods) {
  std::vector<std::string> names;
  for (const FrameFigures* f : methods)
    for (const StageFigures& stage : f->stages)
      if (std::find(names.begin(), names.end(), stage.stage) == names.end())
        names.push_back(stage.stage);
  std::vector<std::vector<std::string>> rows{{"stage, ms"}};
  for (const FrameFigures* f : methods) rows[0].push_back(measured(*f));
  for (const std::string& name : names) {
    rows.push_back({name});
    for (const FrameFigures* f : methods) {
      const auto stage = std::find_if(f->stages.begin(), f->stages.end(),
                                      [&](const StageFigures& s) { return s.stage == name; });
      rows.back().push_back(stage == f->stages.end() ? "" : milliseconds(stage->host_ms));
    }
  }
  rows.push_back({"outside stages"});
  for (const FrameFigures* f : methods) {
    double rest = f->median_ms;
    for (const StageFigures& stage : f->stages) rest -= stage.host_ms;
    // Stages are timed in other frames than the median is of: they may take longer together.
    rows.back().push_back(rest < 0 ? "-" : milliseconds(rest));
  }
  return aligned(rows);
}

// What one frame asks of the device, one column a method.
std::string command_table(const std::vector<const FrameFigures*>& methods) {
  std::vector<std::vector<std::string>> rows{{"commands of a frame"}};
  for (const FrameFigures* f : methods) rows[0].push_back(measured(*f));
  for (const CommandKind& kind : kCommandKinds) {
    rows.push_back({kind.name});
    for (const FrameFigures* f : methods)
      rows.back().push_back(std::to_string(f->commands.*kind.count));
  }
  return aligned(rows);
}

}  // namespace

std::string frames_json(const DeviceInfo& device, const std::vector<FrameFigures>& frames) {
  ordered_json root{{"version", version()},
                    {"device", device.name},
                    {"platform", device.platform},
                    {"driver", device.driver},
                    {"results", ordered_json::array()}};
  for (const FrameFigures& f : frames) root["results"].push_back(json_of(f));
  return root.dump(1) + "\n";
}

std::string frames_table(const std::vector<FrameFigures>& frames) {
  std::string text;
  for (std::size_t first = 0; first < frames.size();) {
    std::size_t last = first;
    std::vector<const FrameFigures*> methods;
    std::vector<std::vector<std::string>> rows{{"method", "median ms", "p10", "p90", "cpu ms",
                                                "frames/s", "cpu ms, in flight", "first ms",
                                                "device MiB", "host MiB"}};
    for (; last < frames.size() && heading(frames[last]) == heading(frames[first]); ++last) {
      const FrameFigures& f = frames[last];
      methods.push_back(&f);
      rows.push_back({measured(f), milliseconds(f.median_ms), milliseconds(f.p10_ms),
                      milliseconds(f.p90_ms), milliseconds(f.cpu_ms),
                      milliseconds(f.frames_per_second), milliseconds(f.overlapped_cpu_ms),
                      milliseconds(f.first_ms), mebibytes(f.device_bytes),
                      mebibytes(f.host_bytes)});
    }
    if (first > 0) text += '\n';
    text += heading(frames[first]) + "\n\n" + aligned(rows) + "\n" + stage_table(methods) + "\n" +
            command_table(methods);
    first = last;
  }
  return text;
}

}  // namespace meniscus
