// How long whole frames take, where the time goes, and how much memory they need.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "device/device.hpp"
#include "frame/input.hpp"
#include "meniscus/device.hpp"
#include "meniscus/extract.hpp"

namespace meniscus {

struct FrameBenchOptions {
  double seconds = 2;                  // how long each of the three measurements goes on ...
  int least_frames = 5;                // ... and for how many frames at least
  std::size_t memory = kStreamMemory;  // as for extract(), bytes
  int in_flight = 2;  // frames that are extracted at the same time, each by a thread
};

/// What a stage takes of a frame: medians over frames. A stage that runs several times is summed.
struct StageFigures {
  std::string stage;
  double host_ms = 0;    // wall time, the wait for its kernels included
  double device_ms = 0;  // its kernels, from their events
  std::vector<std::pair<std::string, double>> kernels;  // ms, each name once
};

/// What one method takes for one frame. A frame is a call of extract(): particles in memory, or in
/// the file they stream from, to depth, normals and what else there is in a Surface, on the host.
struct FrameFigures {
  std::string frame, method;
  std::int64_t particles = 0, pixels = 0;  // pixels: covered ones
  int width = 0, height = 0;
  int layers = 0;  // Parameters::layers
  bool mesh = false, streamed = false;

  double first_ms = 0;  // on a device just opened: kernels are built or loaded
  double median_ms = 0, least_ms = 0, p10_ms = 0, p90_ms = 0;  // wall, one frame after another
  double cpu_ms = 0;             // processor time of the whole process in one frame, median
  int frames = 0;                // that the median is of
  double frames_per_second = 0;  // with in_flight frames at a time
  double overlapped_cpu_ms = 0;  // processor time a frame then
  int in_flight = 0;
  CommandCounts commands;        // of one frame without timings
  std::vector<StageFigures> stages;  // in the order of their first run; waiting after each
  std::uint64_t device_bytes = 0;    // the most that its buffers took at a time
  std::uint64_t host_bytes = 0;      // the most that the process had resident; on a CPU device with
                                     // its buffers
};

/// Measures `parameters.method`: the first frame, frames one after another without and with
/// timings of the stages, then frames overlapped. Throws what extract() throws.
FrameFigures measure_frame(const DeviceInfo& device, const FrameInput& input,
                           const Parameters& parameters, const FrameBenchOptions& options);

/// The value below which `share` of the values lie, between the two nearest. `values` not empty.
double quantile(std::vector<double> values, double share);

/// Makes the summed, once-named stages and kernels of one frame from its timings.
std::vector<StageFigures> sum_stages(const std::vector<StageTime>& times);

/// The median of each stage and kernel over frames; where a frame lacks one, it took 0.
std::vector<StageFigures> median_stages(const std::vector<std::vector<StageFigures>>& frames);

}  // namespace meniscus
