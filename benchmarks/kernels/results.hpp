// What a run of the kernels' benchmarks found, what follows from it, and its JSON.
#pragma once

#include <string>
#include <vector>

#include "device/probe.hpp"

namespace meniscus::bench {

/// One kernel at one size, or its native version.
struct Result {
  std::string kernel;         // as its events name it
  std::string variant;        // kDevice or kNative
  long long particles = 0;    // of the frame
  int width = 0, height = 0;  // of the image, pixels
  std::string unit;           // what a rate counts: "particles"
  double items = 0;           // of that unit in a launch
  double bytes = 0;           // that the algorithm must read and write in a launch
  double operations = 0;      // floating-point operations of the algorithm in a launch
  double atomics = 0;         // atomic minima in a launch
  std::vector<double> ms;     // of a launch, the mean of each repetition
  bool whole_stage = false;   // ms are wall times of the stage with the host's part
  std::string note;           // what is wrong with it; empty: nothing

  /// The fastest launch. Other work on the machine only ever adds time.
  double best_ms() const;
  /// How far the fastest quarter of the launches reaches above the fastest, ms.
  double noise_ms() const;
  double rate() const { return items / (1e-3 * best_ms()); }  // items a second
  double gb_per_s() const { return 1e-6 * bytes / best_ms(); }
  double gflops() const { return 1e-6 * operations / best_ms(); }
  double intensity() const { return bytes > 0 ? operations / bytes : 0; }  // operations a byte
};

inline constexpr const char* kDevice = "device";
inline constexpr const char* kNative = "native";

/// How near a result is to what the device can do: the largest of its shares of the bandwidth at
/// its size, of the arithmetic, of the atomics, and of the speed of an empty kernel; and which of
/// them it is.
struct Share {
  double value = 0;    // 1: at the limit
  std::string limit;   // "memory", "arithmetic", "atomics" or "launch"; empty: not counted
  double ceiling = 0;  // what that limit allows: GB/s, GFLOP/s, 1e9 atomics a second, or us

  bool counted() const { return !limit.empty(); }
};
/// Not counted are whole stages, and kernels whose operations are not counted.
Share share_of_roofline(const Result& result, const Roofline& roofline);

/// A device with a number of threads: its roofline and its results, measured together.
struct Session {
  std::string device, kind, platform, driver;
  unsigned compute_units = 0;
  int processors = 0;     // of the machine
  int threads = 0;        // of the device, where it is a CPU, and of the native versions; 0: a GPU
  double other_work = 0;  // processors that other processes kept busy meanwhile, on average
  bool native_flags = false;    // whether native versions are compiled for this very processor
  bool without_native = false;  // they were not run, because they are not; not in the JSON
  std::string file;             // that it was read from; empty: measured now
  std::string unfinished;       // why not all was measured, in words; empty: it was
  Roofline roofline;            // the better of one before and one after the results
  std::vector<Result> results;

  /// Whether its threads and what else ran wanted more processors than there are.
  bool disturbed() const { return kind == "CPU" && threads + other_work > processors + 0.25; }

  const Result* find(const std::string& kernel, const std::string& variant, long long particles,
                     int width, int height) const;
  const Result* native_of(const Result& result) const;
  /// The device's speed over the native version's, 0 where there is none that is compiled for this
  /// processor.
  double against_native(const Result& result) const;
};

/// What one call of `bench` measured.
struct BenchRun {
  std::string version;  // of Meniscus
  std::vector<Session> sessions;
};

/// The share of the roofline, and of the native version's speed, from which a kernel counts as
/// close to what the device can do.
inline constexpr double kGoodShare = 0.7, kGoodAgainstNative = 0.8;

/// From which ratio to the native version's speed on a kernel counts as faster.
inline constexpr double kFasterThanNative = 1 / kGoodAgainstNative;

/// How much faster several threads must compute than one, or they did not run at once.
inline constexpr double kLeastGain = 1.5;

/// Whether a kernel is close to what its device can do, at its largest size.
struct Verdict {
  const Session* session;  // with the most threads of its device
  const Result* result;
  Share share;             // of the roofline
  double against_one = 0;  // native version on one thread; 0: not measured
  double against_all = 0;  // native version on all threads; 0: not measured
  /// The smaller of the two ratios to the native version's speed that were measured; 0: none was.
  double against_native() const;
  /// At least kGoodShare of the roofline, or kGoodAgainstNative of the native version's speed.
  bool near_limit() const;
  /// Neither near the roofline nor beside a native version that would tell.
  bool open() const { return !near_limit() && !(against_native() > 0); }
  /// "near", "far" or "open".
  const char* word() const { return near_limit() ? "near" : open() ? "open" : "far"; }
};

/// The session of the same device with one thread; null: there is none.
const Session* one_thread_of(const BenchRun& run, const Session& session);

/// A verdict on every kernel of every device, in the order of the run.
std::vector<Verdict> judge(const BenchRun& run);

std::string to_json(const BenchRun& run);

/// Throws InputError, naming `name`, when the text is no such run.
BenchRun from_json(const std::string& text, const std::string& name);

}  // namespace meniscus::bench
