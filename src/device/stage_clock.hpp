// Times the stages of a frame.
#pragma once

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include "base/elapsed.hpp"
#include "device/device.hpp"
#include "device/opencl_error.hpp"
#include "meniscus/extract.hpp"

namespace meniscus {

/// What timings call the building of kernels; it is no stage's time.
inline constexpr const char* kBuilding = "build kernels";

/// Names the stage that runs, for timings and for errors.
class StageClock {
 public:
  StageClock(Device& device, std::vector<StageTime>* timings) : device_(device), times_(timings) {}
  /// What is left, of a stage that failed or without timings, is no time of the next frame's.
  ~StageClock() {
    device_.state().events.clear();
    device_.state().take_building_ms();
    device_.state().stage.clear();
  }

  void start(const std::string& stage) {
    check_not_forked();
    stop();
    if (device_.state().on_stage) device_.state().on_stage(stage);
    device_.state().stage = stage;
    begin_ = std::chrono::steady_clock::now();
  }

  void stop() {
    if (device_.state().stage.empty()) return;
    if (times_) {
      StageTime time{device_.state().stage, 0, 0, device_.state().take_times()};
      for (const auto& [kernel, ms] : time.kernels) time.device_ms += ms;
      time.host_ms = milliseconds_since(begin_);
      if (const double building_ms = device_.state().take_building_ms(); building_ms > 0) {
        times_->push_back({kBuilding, building_ms, 0, {}});
        time.host_ms = std::max(0.0, time.host_ms - building_ms);
      }
      times_->push_back(time);
    }
    device_.state().stage.clear();
  }

 private:
  Device& device_;
  std::vector<StageTime>* times_;
  std::chrono::steady_clock::time_point begin_;
};

}  // namespace meniscus
