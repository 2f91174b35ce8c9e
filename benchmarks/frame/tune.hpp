// Which way of launching kernels is fastest on a device.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "device/tuning.hpp"
#include "frame/input.hpp"

namespace meniscus {

/// A way that was tried.
struct Trial {
  Tuning tuning;
  double ms = 0;          // the fastest frame
  double spread_ms = 0;   // how far the fastest quarter of the frames, two at least, reaches above
                          // it; infinite where there is one frame
  bool same_bits = true;  // as the default way
  std::string error;      // empty: it ran
};

struct TuningRun {
  std::vector<Trial> trials;  // the default way first
  Tuning best;                // the default, unless another one is_faster
};

/// Whether a way is worth keeping: faster than the default by 3 %, and by more than both ways'
/// frames spread.
bool is_faster(const Trial& trial, const Trial& usual);

/// Extracts `frame` by method fit in both vector widths, then in the faster width with discs drawn
/// the other way, then in the fastest of these with groups of 16 to 256 work-items, in turns,
/// `rounds` times each. Only ways with the default's bits can be the best.
TuningRun tune(const DeviceInfo& info, const FrameInput& frame, int rounds,
               const std::function<void(const std::string&)>& say);

/// "width 8, groups of 64, discs by bins".
std::string to_string(const Tuning& tuning);

}  // namespace meniscus
