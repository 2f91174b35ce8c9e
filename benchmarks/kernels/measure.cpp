#include "kernels/measure.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <map>
#include <thread>

#include "base/elapsed.hpp"
#include "frame/process.hpp"
#include "kernels/cases.hpp"
#include "kernels/native/native.hpp"
#include "program/child_process.hpp"

namespace meniscus::bench {
namespace {

// Keeps the times of the repetitions by the benchmark's name.
class Collector : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration) continue;
      ms[run.run_name.function_name].push_back(1e3 * run.real_accumulated_time);
    }
  }
  std::map<std::string, std::vector<double>> ms;
};

double wall_ms(const std::function<void()>& run) {
  const auto begin = std::chrono::steady_clock::now();
  run();
  return milliseconds_since(begin);
}

// Milliseconds of one of the kernel's launches: the mean when the stage launches it several times.
double launch_ms(Device& device, const char* kernel, const Case& measured) {
  device.state().take_times();
  if (measured.whole)
    return wall_ms([&] {
      measured.launch();
      device.state().take_times();
    });
  measured.launch();
  double sum = 0;
  int launches = 0;
  for (const auto& [name, ms] : device.state().take_times())
    if (name == kernel || name == measured.also) {
      sum += ms;
      ++launches;
    }
  if (launches == 0) throw DeviceError(std::string(kernel) + " was not launched by its stage");
  return std::max(measured.also.empty() ? sum / launches : sum,
                  1e-6);  // a clock may stand still for what is too short
}

double native_ms(const Case& measured, Workers& workers) {
  if (measured.reset_native) measured.reset_native();
  return wall_ms([&] { measured.native(workers); });
}

// As many as the options want, or fill their time; but three where those would take ten times it.
int repetitions_of(double once_ms, const MeasureOptions& options) {
  const double fill = 1e3 * options.seconds / once_ms;
  const int wanted =
      std::max(options.repetitions, static_cast<int>(std::min(fill, kMostRepetitions)));
  return std::min(wanted, std::max(3, static_cast<int>(std::min(10 * fill, 1e6))));
}

// Of a native version. As a control alone it runs a few times: many versions are slow where they
// are not compiled for the processor.
MeasureOptions native_options(const MeasureOptions& options) {
  constexpr int kControl = 5;  // runs
  MeasureOptions few = options;
  if (native::has_native_flags()) return few;
  few.repetitions = std::min(options.repetitions, kControl);
  few.seconds = options.seconds / 4;
  return few;
}

// What a run throws goes into `failure`: releases of Google Benchmark report it in different ways.
void add_benchmark(const char* variant, const std::function<double()>& time_ms,
                   const MeasureOptions& options, std::exception_ptr& failure) {
  const double once = wall_ms(time_ms);
  const int repetitions = repetitions_of(once, options);
  benchmark::RegisterBenchmark(variant,
                               [time_ms, &failure](benchmark::State& state) {
                                 try {
                                   for ([[maybe_unused]] auto _ : state)
                                     state.SetIterationTime(1e-3 * time_ms());
                                 } catch (const std::exception& error) {
                                   failure = std::current_exception();
                                   state.SkipWithError(error.what());
                                 }
                               })
      ->UseManualTime()
      ->Iterations(1)
      ->Repetitions(repetitions);
}

Result result_of(const Case& measured, const char* kernel, const char* variant, const Frame& frame,
                 const std::vector<double>& ms) {
  Result result;
  result.kernel = kernel;
  result.variant = variant;
  result.particles = frame.particles;
  result.width = frame.view.width;
  result.height = frame.view.height;
  result.unit = measured.unit;
  result.items = measured.items;
  result.bytes = measured.bytes;
  result.operations = measured.operations;
  result.atomics = measured.atomics;
  result.whole_stage = measured.whole;
  result.ms = ms;
  return result;
}

void measure_kernel(const KernelBench& bench, Frame& frame, Workers* workers,
                    const MeasureOptions& options, std::vector<Result>& results) {
  const Case measured = bench.prepare(frame);
  if (!measured.launch && !(workers && measured.native)) {
    results.push_back(result_of(measured, bench.kernel, kDevice, frame, measured.frame_ms));
    return;
  }
  const auto device_ms = [&] {
    return measured.launch ? launch_ms(frame.device, bench.kernel, measured)
                           : measured.next_frame_ms();
  };
  device_ms();  // not counted: builds the kernel
  std::string note;
  bool native = workers && measured.native;
  if (native) {
    native_ms(measured, *workers);
    if (const std::size_t differing = measured.differing(); differing > 0) {
      native = false;
      note = "the native version differs at " + std::to_string(differing) + " values";
    }
  }
  benchmark::ClearRegisteredBenchmarks();
  std::exception_ptr failure;
  add_benchmark(kDevice, device_ms, options, failure);
  if (native)
    add_benchmark(
        kNative, [&] { return native_ms(measured, *workers); }, native_options(options), failure);
  Collector collector;
  benchmark::RunSpecifiedBenchmarks(&collector, "all");
  benchmark::ClearRegisteredBenchmarks();
  if (failure) std::rethrow_exception(failure);
  for (const char* variant : {kDevice, kNative})
    if (collector.ms.count(variant))
      results.push_back(
          result_of(measured, bench.kernel, variant, frame, collector.ms.at(variant)));
  results[results.size() - collector.ms.size()].note = note;
}

std::vector<KernelBench> chosen_benches(const std::vector<std::string>& parts) {
  std::vector<KernelBench> chosen;
  for (const KernelBench& bench : kernel_benches()) {
    const std::string name = bench.kernel;
    if (parts.empty() || std::any_of(parts.begin(), parts.end(), [&](const std::string& part) {
          return name.find(part) != std::string::npos;
        }))
      chosen.push_back(bench);
  }
  return chosen;
}

// Google Benchmark's own settings come as words of a command line.
void set_up_library() {
  static bool done = false;
  if (done) return;
  done = true;
  std::string program = "meniscus", interleaved = "--benchmark_enable_random_interleaving=true";
  char* words[] = {program.data(), interleaved.data(), nullptr};
  int count = 2;
  benchmark::Initialize(&count, words);
}

}  // namespace

std::vector<std::string> kernel_names() { return chosen_names({}); }

std::vector<std::string> chosen_names(const std::vector<std::string>& parts) {
  std::vector<std::string> names;
  for (const KernelBench& bench : chosen_benches(parts)) names.emplace_back(bench.kernel);
  return names;
}

Session measure(Device& device, int threads, const MeasureOptions& options,
                const std::function<void(const std::string&)>& say) {
  const std::vector<KernelBench> benches = chosen_benches(options.kernels);
  require(!benches.empty(), "no kernel that can be measured has such a name");
  set_up_library();
  const DeviceInfo& info = device.info();
  Session session;
  session.device = info.name;
  session.kind = to_string(info.kind);
  session.platform = info.platform;
  session.driver = info.driver;
  session.compute_units = info.compute_units;
  session.processors = static_cast<int>(std::thread::hardware_concurrency());
  session.threads = threads;
  session.native_flags = native::has_native_flags();
  session.without_native = threads > 0 && !session.native_flags && !options.control;
  const OtherWork other_work;
  say("the roofline");
  const Roofline before = measure_roofline(device, options.probes);
  const std::unique_ptr<Workers> workers =
      threads > 0 && !session.without_native ? std::make_unique<Workers>(threads) : nullptr;
  const auto stopped = [&] { return options.stop && options.stop() != 0; };
  std::size_t begun = 0;
  for (const long long particles : options.particles) {
    if (stopped()) break;
    Frame frame(device, particles, options.width, options.height);
    frame.repetitions = options.repetitions;
    frame.seconds = options.seconds;
    for (const KernelBench& bench : benches) {
      if (stopped()) break;
      ++begun;
      say(std::string(bench.kernel) + ", " + std::to_string(particles) + " particles");
      try {
        measure_kernel(bench, frame, workers.get(), options, session.results);
      } catch (const DeviceError& error) {
        throw DeviceError("bench: " + std::string(bench.kernel) + " with " +
                          std::to_string(particles) + " particles: " + error.what());
      }
    }
  }
  const std::size_t all = benches.size() * options.particles.size();
  if (stopped() && begun < all) {
    session.unfinished = "stopped by " + name_of_signal(options.stop()) + " after " +
                         std::to_string(begun) + " of " + std::to_string(all) +
                         " kernels and sizes";
    session.roofline = before;
  } else {
    say("the roofline again");
    session.roofline = better_of(before, measure_roofline(device, options.probes));
  }
  session.other_work = other_work.processors();
  return session;
}

}  // namespace meniscus::bench
