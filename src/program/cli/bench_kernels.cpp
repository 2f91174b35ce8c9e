// `bench`: measures, and writes tables, JSON and the page.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <optional>
#include <thread>

#include "base/comma_separated.hpp"
#include "base/grouped.hpp"
#include "io/input_file.hpp"
#include "io/output_file.hpp"
#include "kernels/compare.hpp"
#include "kernels/measure.hpp"
#include "kernels/page.hpp"
#include "kernels/table.hpp"
#include "meniscus/device.hpp"
#include "meniscus/extract.hpp"
#include "program/batch/outputs.hpp"
#include "program/child_process.hpp"
#include "program/cli/bench_command.hpp"
#include "program/cli/options.hpp"
#include "program/cli/signals.hpp"
#include "program/cli/terminal.hpp"

namespace meniscus::cli {
namespace {

bench::MeasureOptions measure_options(const BenchOptions& options) {
  bench::MeasureOptions measure;
  measure.kernels = options.kernels;
  measure.particles = options.particles;
  measure.width = options.size[0];
  measure.height = options.size[1];
  measure.repetitions = options.repetitions;
  // Of a run that is kept, or compared with one.
  measure.control = !options.without_control && (!options.json.empty() || !options.compare.empty());
  return measure;
}

// OpenCL runtimes read their number of threads once, so that another number needs another process.
// Nothing where a signal stops it.
std::optional<bench::Session> measure_with_one_thread(const BenchOptions& options,
                                                      const DeviceInfo& device,
                                                      const std::function<int()>& stop) {
  const std::string particles = comma_separated(
      options.particles, [](long long count) { return std::to_string(count); }, ",");
  std::vector<std::string> words{
      "bench",         "--child",
      "--threads",     "1",
      "--json",        "-",
      "--device",      std::to_string(device.index),
      "--particles",   particles,
      "--size",        std::to_string(options.size[0]) + "x" + std::to_string(options.size[1]),
      "--repetitions", std::to_string(options.repetitions)};
  for (const std::string& kernel : options.kernels) {
    words.push_back("--kernel");
    words.push_back(kernel);
  }
  if (!measure_options(options).control) words.push_back("--without-control");
  if (options.quiet) words.push_back("--quiet");
  ChildProcess child(words, false);
  std::string json;
  for (std::string line;;) {
    constexpr double kSlice = .1;  // seconds
    const ChildProcess::Read read = child.read_line(line, kSlice);
    if (stop() != 0) return {};
    if (read == ChildProcess::Read::end) break;
    if (read == ChildProcess::Read::line) json += line + "\n";
  }
  // A terminal sends Ctrl-C to both, and ours may come a moment later.
  const std::string how = child.wait();
  constexpr std::chrono::milliseconds kMoment{500};
  if (!how.empty()) std::this_thread::sleep_for(kMoment);
  if (stop() != 0) return {};
  if (!how.empty()) throw Error("bench: the run with one thread failed; its reason is above");
  bench::BenchRun run = bench::from_json(json, "the run with one thread");
  require(run.sessions.size() == 1, "bench: the run with one thread has no results");
  run.sessions.front().file.clear();
  return run.sessions.front();
}

// What cannot be compared is better known before minutes of measuring.
void check_comparison(const bench::BenchRun& old, const BenchOptions& options,
                      const std::vector<DeviceInfo>& devices) {
  const bench::MeasureOptions measure = measure_options(options);
  if (!bench::has_any(old, bench::chosen_names(measure.kernels), measure.particles, measure.width,
                      measure.height))
    throw usage_error("--compare: " + options.compare.front() +
                      " has none of these kernels at these sizes; it has " + bench::sizes_of(old) +
                      " (give its --kernel, --particles and --size)");
  for (const DeviceInfo& info : devices)
    if (std::none_of(old.sessions.begin(), old.sessions.end(),
                     [&](const bench::Session& session) { return session.device == info.name; }))
      print_line(stderr, "meniscus: warning: --compare: " + options.compare.front() + " is of " +
                             old.sessions.front().device + ", this run is of " + info.name +
                             ": two devices are compared");
}

// `whole` says whether a signal has left nothing out.
bench::BenchRun measure(const BenchOptions& options, const std::vector<DeviceInfo>& devices,
                        const std::function<int()>& stop, bool& whole) {
  bench::BenchRun run;
  run.version = version();
  bench::MeasureOptions what = measure_options(options);
  what.stop = stop;
  for (const DeviceInfo& info : devices) {
    whole = whole && stop() == 0;
    if (!whole) break;
    const bool cpu = info.kind == DeviceKind::cpu;
    const int threads = !cpu                  ? 0
                        : options.threads > 0 ? options.threads
                                              : static_cast<int>(info.compute_units);
    Device device(info);
    const auto say = [&](const std::string& what) {
      if (options.quiet) return;
      const std::string on = cpu ? ", threads: " + std::to_string(threads) : "";
      print_line(stderr, "measuring  " + what + " on " + info.name + on);
    };
    run.sessions.push_back(bench::measure(device, threads, what, say));
    // Intel's keeps to --threads, too, but counts all processors as compute units nevertheless.
    const bool intel = info.platform.find("Intel") != std::string::npos;
    if (cpu && !intel && static_cast<int>(info.compute_units) != threads)
      print_line(stderr, "meniscus: warning: " + info.name + " uses " +
                             std::to_string(info.compute_units) +
                             " threads whatever --threads says");
    whole = whole && run.sessions.back().unfinished.empty();
    if (!cpu || options.threads > 0 || threads < 2 || !whole) continue;
    const auto one = measure_with_one_thread(options, info, stop);
    whole = one.has_value();
    if (one) run.sessions.push_back(*one);
  }
  return run;
}

bench::BenchRun read_run(const std::string& path) {
  return bench::from_json(read_file(path).bytes, path);
}

// Two earlier runs: nothing is measured.
void compare_runs(const BenchOptions& options) {
  std::optional<OutputFile> html;
  if (!options.html.empty()) html.emplace(options.html);
  const bench::BenchRun before = read_run(options.compare[0]), after = read_run(options.compare[1]);
  const std::vector<bench::SessionPair> pairs = bench::pair_sessions(&before, after);
  if (html) {
    html->write(bench::to_html(after, pairs));
    html->commit();
  }
  print_lines(stdout, bench::comparison_table(pairs));
}

}  // namespace

int bench_kernels(const BenchOptions& options) {
  if (options.list) {
    print_names(bench::kernel_names());
    return 0;
  }
  // Files that cannot be read or written are better known now than later.
  as_usage([&] { check_outputs({options.compare, {}}, {}, {options.json, options.html}); });
  if (!options.html.empty()) check_page_name("--html", options.html);
  if (options.compare.size() == 2) {
    compare_runs(options);
    return 0;
  }
  check_parts_of_names("--kernel", options.kernels, bench::kernel_names());
  use_threads(options.threads);
  constexpr std::int64_t kBytes = 250;  // of a particle with all that the kernels are given
  require_memory(std::ranges::max(options.particles), kBytes);
  std::optional<bench::BenchRun> old;
  if (!options.compare.empty()) old = read_run(options.compare.front());
  const bool to_output = options.json == "-";
  std::optional<OutputFile> json, html;
  if (!options.json.empty() && !to_output) json.emplace(options.json);
  if (!options.html.empty()) html.emplace(options.html);

  const std::vector<DeviceInfo> devices = chosen_devices(options.device);
  if (old) check_comparison(*old, options, devices);
  const int processors = static_cast<int>(std::thread::hardware_concurrency());
  if (options.threads > processors)
    print_line(stderr, "meniscus: warning: --threads is " + std::to_string(options.threads) +
                           ", but there are " + counted(processors, "processor") +
                           ": threads that share one make times and verdicts wrong");
  std::optional<GentleStop> stop;  // a child ends at once
  if (!options.is_child)
    stop.emplace("stopping after this kernel; what was measured so far follows");
  const auto signal = [&] { return stop ? stop->signal().load() : 0; };
  bool whole = true;
  const bench::BenchRun run = measure(options, devices, signal, whole);
  int exit_code = 0;
  if (!whole) {
    print_line(stderr, "meniscus: error: bench was stopped by " + name_of_signal(signal()) +
                           ": what it shows and writes is unfinished");
    exit_code = 128 + signal();
  }
  const std::vector<bench::SessionPair> pairs = bench::pair_sessions(old ? &*old : nullptr, run);
  if (json) {
    json->write(bench::to_json(run));
    json->commit();
  }
  if (html) {
    html->write(bench::to_html(run, pairs));
    html->commit();
  }
  if (to_output) {
    std::fputs(bench::to_json(run).c_str(), stdout);
    return exit_code;
  }
  print_lines(stdout, bench::results_table(run) + bench::verdict_table(run));
  print_lines(stdout, bench::comparison_table(pairs));
  return exit_code;
}

}  // namespace meniscus::cli
