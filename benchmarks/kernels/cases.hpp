// The kernels that are measured. A file for each stage, <stage>_bench.cpp, prepares the launches of
// its kernels on a frame, counts by hand what the algorithm needs, and has the native version to
// compare with.
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
  std::function<void()> launch;  // by the stage's host function; other kernels may run, too
  /// Instead of `launch`, for kernels whose inputs only a whole frame has: the milliseconds of all
  /// launches in each of some frames; the counts are those of all launches then.
  std::vector<double> frame_ms;
  /// Of a kernel with a native version to take turns with, besides: the same of one more frame.
  std::function<double()> next_frame_ms;
  std::string also;                      // a second kernel of it; all launches count together then
  bool whole = false;                    // wall time of `launch` until the device is done
  std::function<void(Workers&)> native;  // empty: there is none
  std::function<void()> reset_native;    // before each native run, not timed; may be empty
  /// After a launch and a native run: how many values of the two results differ in their bits.
  std::function<std::size_t()> differing;
};

struct KernelBench {
  const char* kernel;  // as its events are named
  Case (*prepare)(Frame& frame);
};

/// All kernels, in the pipeline's order.
const std::vector<KernelBench>& kernel_benches();

Case prepare_splat(Frame& frame);
Case prepare_owned(Frame& frame);
Case prepare_owners_by_bins(Frame& frame);
Case prepare_owners_by_minima(Frame& frame);
Case prepare_fronts_by_bins(Frame& frame);
Case prepare_fronts_by_minima(Frame& frame);
Case prepare_spheres_by_bins(Frame& frame);
Case prepare_spheres_by_minima(Frame& frame);
Case prepare_gradients(Frame& frame);
Case prepare_evidence(Frame& frame);
Case prepare_edges(Frame& frame);
Case prepare_averages(Frame& frame);
Case prepare_blend(Frame& frame);
Case prepare_settle(Frame& frame);
Case prepare_follow(Frame& frame);
Case prepare_splash(Frame& frame);
Case prepare_compare(Frame& frame);
Case prepare_interpolate(Frame& frame);
Case prepare_specks(Frame& frame);
Case prepare_fairing(Frame& frame);
Case prepare_motion(Frame& frame);
Case prepare_cast_spheres(Frame& frame);
Case prepare_smooth_columns(Frame& frame);
Case prepare_smooth_rows(Frame& frame);
Case prepare_normals(Frame& frame);
Case prepare_blend_particles(Frame& frame);
Case prepare_shape_kernels(Frame& frame);
Case prepare_cast_field(Frame& frame);
Case prepare_triangles(Frame& frame);
Case prepare_fit(Frame& frame);
Case prepare_bilateral(Frame& frame);
Case prepare_narrow_range(Frame& frame);
Case prepare_flow(Frame& frame);

/// How many values differ in their bits; all of them when the sizes do.
std::size_t count_differing(const std::vector<float>& a, const std::vector<float>& b);

/// Runs `draw` with discs drawn as `form` says.
template <class Draw>
void draw_as(Device& device, DiscForm form, const Draw& draw) {
  const DiscForm before = device.state().discs;
  device.state().discs = form;
  draw();
  device.state().discs = before;
}

/// The rays of a view, as native versions take them.
void copy_rays(const View& view, float (&ray)[12]);

}  // namespace meniscus::bench
