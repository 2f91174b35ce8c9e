// The kernels that are measured. A file for each stage, <stage>_bench.cpp, prepares the launches of
// its kernels on a frame, and counts by hand what the algorithm needs. Three kernels have a native
// version to compare with.
//
// How is counted: bytes are what must be read or written once, each array by its part that is used,
// whatever a cache does with it. Operations are floating-point + - * / sqrt, minimum and maximum;
// a fused multiply-add is two; comparisons, selections, conversions and integers are none. Padding
// of lanes and what work-items compute in vain are not counted, so that they show as a loss.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "kernels/frame.hpp"
#include "kernels/workers.hpp"

namespace meniscus::bench {

/// A kernel ready to be launched. The counts are of one launch.
struct Case {
  std::string unit;  // what `items` counts: "particles"
  double items = 0, bytes = 0, operations = 0, atomics = 0;
  std::function<void()> launch{};  // by the stage's host function; other kernels may run, too
  /// Instead of `launch`, for kernels whose inputs only a whole frame has: the milliseconds of all
  /// launches in each of some frames; the counts are those of all launches then.
  std::vector<double> frame_ms{};
  /// Of a kernel with a native version to take turns with, besides: the same of one more frame.
  std::function<double()> next_frame_ms{};
  std::string also{};  // a second kernel of it; all launches count together then
  bool whole = false;  // wall time of `launch` until the device is done
  std::function<void(Workers&)> native{};  // empty: there is none
  std::function<void()> reset_native{};    // before each native run, not timed; may be empty
  /// After a launch and a native run: how many values of the two results differ in their bits.
  std::function<std::size_t()> differing{};
};

/// Makes a kernel ready on a frame.
using Prepare = Case(Frame& frame);

struct KernelBench {
  const char* kernel;  // as its events are named
  Prepare* prepare;
};

/// All kernels, in the pipeline's order.
const std::vector<KernelBench>& kernel_benches();

Prepare prepare_splat, prepare_owned, prepare_owners_by_bins, prepare_owners_by_minima,
    prepare_fronts_by_bins, prepare_fronts_by_minima, prepare_spheres_by_bins,
    prepare_spheres_by_minima, prepare_gradients, prepare_evidence, prepare_edges, prepare_averages,
    prepare_blend, prepare_settle, prepare_follow, prepare_splash, prepare_compare,
    prepare_interpolate, prepare_specks, prepare_fairing, prepare_motion, prepare_cast_spheres,
    prepare_smooth_columns, prepare_smooth_rows, prepare_normals, prepare_shape_kernels,
    prepare_cast_field, prepare_triangles, prepare_fit, prepare_bilateral, prepare_narrow_range,
    prepare_flow;

/// Runs `draw` with discs drawn as `form` says.
template <class Draw>
void draw_as(Device& device, DiscForm form, const Draw& draw) {
  const DiscForm before = device.state().discs;
  device.state().discs = form;
  draw();
  device.state().discs = before;
}

}  // namespace meniscus::bench
