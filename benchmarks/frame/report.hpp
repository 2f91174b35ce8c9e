// Whole frames' figures as JSON and as tables.
#pragma once

#include <string>
#include <vector>

#include "frame/measure.hpp"

namespace meniscus {

/// {"version", "device", "platform", "driver", "results": [{"frame", "method", "particles",
/// "width", "height", "pixels", "mesh", "streamed", "median_ms", "least_ms", "p10_ms", "p90_ms",
/// "cpu_ms", "frames", "first_ms", "frames_per_second", "in_flight", "overlapped_cpu_ms", "stages":
/// {name: ms}, "device_stages": {name: ms}, "kernels": {stage: {kernel: ms}}, "device_bytes",
/// "host_bytes"}]}, times in milliseconds.
std::string frames_json(const DeviceInfo& device, const std::vector<FrameFigures>& frames);

/// Two tables of all frames: times and memory; and, one column a method, what each stage takes.
std::string frames_table(const std::vector<FrameFigures>& frames);

}  // namespace meniscus
