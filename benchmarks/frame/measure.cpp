#include "frame/measure.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>

#include "base/elapsed.hpp"
#include "device/device.hpp"
#include "frame/process.hpp"
#include "meniscus/extract.hpp"

namespace meniscus {
namespace {

class Stopwatch {
 public:
  double wall_ms() const { return milliseconds_since(begin_); }
  double cpu_ms() const { return processor_ms() - cpu_begin_; }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  double cpu_begin_ = processor_ms();
};

Surface extract_frame(Device& device, const FrameInput& input, const Parameters& parameters,
                      const FrameBenchOptions& options, std::vector<StageTime>* timings = nullptr) {
  if (input.file.empty())
    return extract(device, input.particles, input.camera, parameters, timings);
  return extract(device, *open_particles(input.file, input.particle_radius), input.camera,
                 parameters, timings, options.memory);
}

// Calls frame() until both the time and the number of frames are reached.
template <class Frame>
void repeat(const FrameBenchOptions& options, const Frame& frame) {
  const Stopwatch all;
  for (int k = 0; k < options.least_frames || all.wall_ms() < 1e3 * options.seconds; ++k) frame();
}

// Frames overlapped: each thread has a Device of its own, a part of the OpenCL device where that
// can be divided.
void measure_overlapped(const DeviceInfo& info, const FrameInput& input,
                        const Parameters& parameters, const FrameBenchOptions& options,
                        FrameFigures& figures) {
  const int threads = std::max(1, options.in_flight);
  std::vector<std::unique_ptr<Device>> devices;
  for (const DeviceInfo& part : divided(info, threads)) {
    devices.push_back(std::make_unique<Device>(part));
    extract_frame(*devices.back(), input, parameters, options);  // builds its kernels
  }
  const int frames =
      std::max(options.least_frames * threads,
               static_cast<int>(1e3 * options.seconds / std::max(figures.median_ms, 1e-3)));
  std::atomic<int> next{0};
  std::exception_ptr failure;
  std::mutex failing;
  const Stopwatch all;
  {
    std::vector<std::jthread> workers;
    for (int k = 0; k < threads; ++k)
      workers.emplace_back([&, k] {
        try {
          while (next++ < frames)
            extract_frame(*devices[static_cast<std::size_t>(k)], input, parameters, options);
        } catch (...) {
          const std::scoped_lock lock(failing);
          failure = std::current_exception();
          next = frames;
        }
      });
  }
  if (failure) std::rethrow_exception(failure);
  figures.in_flight = threads;
  figures.frames_per_second = 1e3 * frames / all.wall_ms();
  figures.overlapped_cpu_ms = all.cpu_ms() / frames;
}

template <class Item, class Same>
Item& found_or_added(std::vector<Item>& items, Item item, const Same& same) {
  const auto found = std::find_if(items.begin(), items.end(), same);
  return found != items.end() ? *found : items.emplace_back(std::move(item));
}

StageFigures& stage_named(std::vector<StageFigures>& stages, const std::string& name) {
  return found_or_added(stages, StageFigures{name, 0, 0, {}},
                        [&](const StageFigures& s) { return s.stage == name; });
}

double& kernel_named(StageFigures& stage, const std::string& name) {
  return found_or_added(stage.kernels, {name, 0.0}, [&](const auto& k) { return k.first == name; })
      .second;
}

}  // namespace

double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  const double place = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const auto above = std::min(below + 1, values.size() - 1);
  return values[below] + (values[above] - values[below]) * (place - std::floor(place));
}

std::vector<StageFigures> sum_stages(const std::vector<StageTime>& times) {
  std::vector<StageFigures> sums;
  for (const StageTime& time : times) {
    StageFigures& sum = stage_named(sums, time.stage);
    sum.host_ms += time.host_ms;
    sum.device_ms += time.device_ms;
    for (const auto& [kernel, ms] : time.kernels) kernel_named(sum, kernel) += ms;
  }
  return sums;
}

std::vector<StageFigures> median_stages(const std::vector<std::vector<StageFigures>>& frames) {
  std::vector<StageFigures> medians;  // the names first, in the order in which they come
  for (const auto& frame : frames)
    for (const StageFigures& stage : frame) {
      StageFigures& named = stage_named(medians, stage.stage);
      for (const auto& kernel : stage.kernels) kernel_named(named, kernel.first);
    }
  const auto median_over_frames = [&](const auto& value_in) {
    std::vector<double> values;
    for (std::vector<StageFigures> frame : frames) values.push_back(value_in(frame));
    return quantile(values, 0.5);
  };
  for (StageFigures& median : medians) {
    const auto in = [&](auto& frame) -> StageFigures& { return stage_named(frame, median.stage); };
    median.host_ms = median_over_frames([&](auto& frame) { return in(frame).host_ms; });
    median.device_ms = median_over_frames([&](auto& frame) { return in(frame).device_ms; });
    for (auto& kernel : median.kernels)
      kernel.second =
          median_over_frames([&](auto& frame) { return kernel_named(in(frame), kernel.first); });
  }
  return medians;
}

FrameFigures measure_frame(const DeviceInfo& info, const FrameInput& input,
                           const Parameters& parameters, const FrameBenchOptions& options) {
  FrameFigures figures;
  figures.frame = input.name;
  figures.method = to_string(parameters.method);
  figures.particles = input.count;
  figures.streamed = !input.file.empty();
  figures.width = input.camera.width;
  figures.height = input.camera.height;
  figures.layers = parameters.layers;
  figures.mesh = parameters.mesh;

  forget_peak_memory();
  {
    Device device(info);
    const auto frame = [&](std::vector<StageTime>* timings = nullptr) {
      return extract_frame(device, input, parameters, options, timings);
    };
    {
      const Stopwatch watch;
      const Surface surface = frame();
      figures.first_ms = watch.wall_ms();
      figures.pixels = std::count_if(surface.depth.begin(), surface.depth.end(),
                                     [](float depth) { return std::isfinite(depth); });
    }
    const CommandCounts before = device.state().counts;
    frame();  // the first steady one
    figures.commands = device.state().counts.since(before);
    std::vector<double> wall, cpu;
    repeat(options, [&] {
      const Stopwatch watch;
      const Surface surface = frame();
      wall.push_back(watch.wall_ms());
      cpu.push_back(watch.cpu_ms());
    });
    figures.frames = static_cast<int>(wall.size());
    figures.median_ms = quantile(wall, 0.5);
    figures.least_ms = quantile(wall, 0);
    figures.p10_ms = quantile(wall, 0.1);
    figures.p90_ms = quantile(wall, 0.9);
    figures.cpu_ms = quantile(cpu, 0.5);
    figures.device_bytes = device.state().memory->peak();
    figures.host_bytes = peak_memory();

    std::vector<std::vector<StageFigures>> stages;
    repeat(options, [&] {
      std::vector<StageTime> times;
      frame(&times);
      stages.push_back(sum_stages(times));
    });
    figures.stages = median_stages(stages);
  }
  measure_overlapped(info, input, parameters, options, figures);
  return figures;
}

}  // namespace meniscus
