#include <algorithm>
#include <array>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "frame/measure.hpp"
#include "frame/process.hpp"
#include "frame/report.hpp"
#include "io/output_file.hpp"
#include "meniscus/extract.hpp"
#include "program/cli/commands.hpp"
#include "program/cli/options.hpp"
#include "program/cli/report.hpp"
#include "program/cli/terminal.hpp"
#include "program/wording.hpp"

namespace meniscus::cli {
namespace {

struct BenchFrameOptions {
  std::string input, camera_file, device, json;
  std::optional<double> particle_radius;  // world units
  std::vector<Method> methods;
  std::vector<std::array<int, 2>> sizes;  // pixels
  std::vector<std::int64_t> particles;    // of synthetic frames
  std::vector<int> layers{0};
  Aovs aovs = aovs_named("N");
  bool sweep = false, mesh = false, motion = false;
  int threads = 0;  // 0: all
  FrameBenchOptions measure;
};

std::vector<std::string> words_of(const std::string& list) {
  std::vector<std::string> words;
  std::istringstream text(list);
  for (std::string word; std::getline(text, word, ',');) words.push_back(word);
  return words;
}

std::vector<Method> parse_methods(const std::string& list) {
  std::vector<Method> methods;
  for (const std::string& word : words_of(list)) try {
      methods.push_back(method_named(word));
    } catch (const InvalidArgument& error) {
      throw usage_error(words_of(error));
    }
  if (methods.empty()) throw usage_error("--method names no method, e.g. --method fit,ssm");
  return methods;
}

std::vector<int> parse_layers(const std::string& list) {
  std::vector<int> numbers;
  for (const std::string& word : words_of(list)) {
    const bool good = word.size() == 1 && word[0] >= '0' && word[0] <= '0' + kMostLayers;
    numbers.push_back(good ? word[0] - '0' : -1);
  }
  if (numbers.empty() || std::ranges::min(numbers) < 0)
    throw usage_error("--layers is " + (list.empty() ? "empty" : list) +
                      ", must be numbers from 0 to " + std::to_string(kMostLayers) + ", e.g. 0,2");
  return numbers;
}

/// The given frame or the dam, or synthetic frames, each at every size that was asked for. Made one
/// at a time: large ones need the memory.
template <class Measure>
void for_each_frame(const BenchFrameOptions& options, const Measure& measure) {
  using Sizes = std::vector<std::array<int, 2>>;
  if (options.particles.empty() && !options.sweep) {
    FrameInput frame = options.input.empty()
                           ? dam_frame()
                           : file_frame(options.input, options.particle_radius.value_or(0));
    if (!options.camera_file.empty()) frame.camera = read_camera(options.camera_file);
    const Sizes own{{frame.camera.width, frame.camera.height}};
    for (const auto& [width, height] : options.sizes.empty() ? own : options.sizes) {
      frame.camera = resized(frame.camera, width, height);
      measure(frame);
    }
    return;
  }
  constexpr std::array<int, 2> kUsual{1024, 768};
  constexpr std::int64_t kMiddle = 100'000;
  const auto synthetic = [&](const std::vector<std::int64_t>& counts, const Sizes& sizes) {
    for (const std::int64_t count : counts) {
      FrameInput frame = synthetic_frame(count, kUsual[0], kUsual[1]);
      for (const auto& [width, height] : sizes) {
        frame.camera = resized(frame.camera, width, height);
        measure(frame);
      }
    }
  };
  if (!options.sweep) {
    synthetic(options.particles, options.sizes.empty() ? Sizes{kUsual} : options.sizes);
    return;
  }
  synthetic(options.particles.empty() ? std::vector<std::int64_t>{10'000, kMiddle, 1'000'000}
                                      : options.particles,
            {kUsual});
  synthetic({kMiddle},
            options.sizes.empty() ? Sizes{{640, 480}, {2048, 1536}, {3264, 2448}} : options.sizes);
}

void run_bench_frame(BenchFrameOptions options) {
  constexpr std::int64_t kBytes = 64;  // of a particle that is held, with what reads it
  if (!options.particles.empty()) require_memory(std::ranges::max(options.particles), kBytes);
  use_threads(options.threads);
  const bool to_output = options.json == "-";
  std::unique_ptr<OutputFile> json;  // better now than later
  if (!options.json.empty() && !to_output) json = std::make_unique<OutputFile>(options.json);
  const bool layered = *std::ranges::max_element(options.layers) > 0;
  if (options.methods.empty())
    for (const MethodEntry& entry : method_list())
      if (entry.layers || !layered) options.methods.push_back(entry.method);

  std::string why;
  const DeviceInfo device = select_device(options.device, &why);
  print_line(stderr, printed("%-10s %s: %s", "device", device.name.c_str(), why.c_str()));
  std::vector<FrameFigures> results;
  const OtherWork other_work;
  for_each_frame(options, [&](const FrameInput& frame) {
    for (const Method method : options.methods)
      for (const int layers : options.layers) {
        Parameters parameters;
        parameters.method = method;
        parameters.layers = layers;
        parameters.aovs = options.aovs;
        parameters.mesh = options.mesh;
        parameters.motion = options.motion;
        parameters.particle_radius = options.particle_radius.value_or(0);
        results.push_back(measure_frame(device, frame, parameters, options.measure));
        const FrameFigures& f = results.back();
        print_line(stderr, printed("%-10s %s, %s particles, %dx%d: %.2f ms", f.method.c_str(),
                                   f.frame.c_str(), grouped(f.particles).c_str(), f.width, f.height,
                                   f.median_ms));
      }
  });
  const int processors = static_cast<int>(std::thread::hardware_concurrency());
  const int threads = options.threads > 0 ? options.threads : processors;
  if (const double busy = other_work.processors(); threads + busy > processors + 0.25)
    print_line(stderr, "meniscus: warning: " + other_work_warning(busy, "times"));
  if (to_output) {
    std::fputs(frames_json(device, results).c_str(), stdout);
    return;
  }
  std::fprintf(stderr, "\n");
  print_lines(stdout, frames_table(results));
  std::printf(
      "\ncpu ms is the processor time of the whole process in the median frame, and in flight that "
      "of a frame\nwhere %d are extracted at the same time, as for frames/s. The stages' times "
      "include the wait after each.\nThey are of other frames than the median: - where they take "
      "longer than it together.\n",
      options.measure.in_flight);
  if (json) {
    json->write(frames_json(device, results));
    json->commit();
  }
}

CLI::Option* add_list(CLI::App& command, const std::string& name,
                      const std::function<void(const std::string& list)>& take,
                      const std::string& effect) {
  return command.add_option_function<std::string>(name, take, effect)->type_name("LIST");
}

void add_frame_options(CLI::App& command, BenchFrameOptions& o) {
  CLI::Option* input = command.add_option(
      "INPUT", o.input, "particles to measure on (default: a breaking dam that is built in)");
  input->type_name("FILE");
  command
      .add_option("--camera", o.camera_file,
                  "JSON file as for extract (default: the dam's, or one that frames the particles)")
      ->type_name("FILE");
  add_positive_option(
      command, "--particle-radius", "world units",
      [&o](double radius) { o.particle_radius = radius; },
      "radius of the particles in world units (default: the file's, else estimated)")
      ->type_name("R")
      ->needs(input);
}

void add_sweep_options(CLI::App& command, BenchFrameOptions& o) {
  CLI::Option* input = command.get_option("INPUT");
  add_list(
      command, "--size",
      [&o](const std::string& list) {
        for (const std::string& word : words_of(list)) o.sizes.push_back(parse_size(word));
      },
      "image sizes, e.g. 640x480,1024x768 (default: the camera's); the vertical field of view "
      "stays");
  add_list(
      command, "--particles",
      [&o](const std::string& list) {
        for (const std::string& word : words_of(list)) o.particles.push_back(parse_particles(word));
      },
      "measure synthetic dam breaks of so many particles, e.g. 1e4,1e5,1e6")
      ->excludes(input);
  command
      .add_flag("--sweep", o.sweep,
                "measure synthetic dam breaks of growing size: first more particles, then more "
                "pixels")
      ->excludes(input);
}

void add_output_options(CLI::App& command, BenchFrameOptions& o) {
  add_list(
      command, "--aov",
      [&o](const std::string& list) { o.aovs = as_usage([&] { return aovs_named(list); }); },
      "maps beside depth, as for extract (default N)");
  command.add_flag("--mesh", o.mesh, "make the mesh, too");
  add_list(
      command, "--layers", [&o](const std::string& list) { o.layers = parse_layers(list); },
      "layers along rays that are kept, as for extract, one measurement each, e.g. 0,2 (default "
      "0: the front alone)");
  command.add_flag("--motion", o.motion,
                   "follow the surface's motion, too, where the particles carry velocities");
}

void add_measure_options(CLI::App& command, BenchFrameOptions& o) {
  command
      .add_option("--seconds", o.measure.seconds, "how long each measurement goes on (default 2)")
      ->check(from_to(0.0, 1e6))
      ->type_name("S");
  command
      .add_option("--frames", o.measure.least_frames,
                  "for how many frames each measurement goes on at least (default 5)")
      ->check(from_to(1, 1'000'000))
      ->type_name("N");
  command
      .add_option("--in-flight", o.measure.in_flight,
                  "frames that are extracted at the same time for frames/s (default 2)")
      ->check(from_to(1, 64))
      ->type_name("N");
}

}  // namespace

void add_bench_frame_command(CLI::App& bench) {
  CLI::App& command = *bench.add_subcommand(
      "frame", "Measure whole frames of every method, and the memory they take");
  const auto options = std::make_shared<BenchFrameOptions>();
  BenchFrameOptions& o = *options;
  add_frame_options(command, o);
  add_list(
      command, "--method", [&o](const std::string& list) { o.methods = parse_methods(list); },
      "methods to measure, e.g. fit,ssm (default: all)");
  add_sweep_options(command, o);
  add_output_options(command, o);
  add_measure_options(command, o);
  add_device_option(command, o.device, " (default: the fastest kind found, see meniscus devices)");
  add_threads_option(command, o.threads);
  add_memory_option(command, o.measure.memory);
  command
      .add_option("--json", o.json, "write the figures as JSON; -: to standard output, no table")
      ->type_name("FILE");
  command.callback([options] { run_bench_frame(*options); });
}

}  // namespace meniscus::cli
