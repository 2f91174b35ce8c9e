#include <memory>
#include <numbers>

#include "kernels/cases.hpp"
#include "stages/other_methods/spheres.hpp"

namespace meniscus::bench {

Case prepare_cast_spheres(Frame& frame) {
  const SampleGrid grid = pixel_grid(frame.view);
  const double footprint = frame.params.ssm.footprint;
  const Projected& projected = frame.projected();
  const auto spheres = std::make_shared<DeviceSpheres>(
      upload_spheres(frame.device, frame.view, projected, footprint));
  double pairs = 0;
  for (const std::int32_t i : frame.seen().index)
    pairs += std::numbers::pi * footprint * footprint * projected.ku[i] * projected.kv[i];
  Case result{.unit = "pixels", .items = static_cast<double>(grid.size())};
  // Eight values a sphere; a depth written a pixel.
  result.bytes = 32.0 * spheres->count + 4.0 * result.items;
  // A pixel under a sphere that is seen: offset 6, b 3, c 4, discriminant 3, root 2, depth 3,
  // minimum 1. A pixel: its ray 16, a 4.
  result.operations = 22 * pairs + 20 * result.items;
  result.launch = [&frame, grid, spheres] {
    cast_spheres(frame.device, frame.view, *spheres, grid);
  };
  return result;
}

// The same with outlines, bounds and lists, as the methods on spheres have it.
Case prepare_spheres(Frame& frame, DiscForm form) {
  Case result = prepare_cast_spheres(frame);
  result.whole = true;
  result.launch = [&frame, form, cast = result.launch] { draw_as(frame.device, form, cast); };
  return result;
}
Case prepare_spheres_by_bins(Frame& frame) { return prepare_spheres(frame, DiscForm::bins); }
Case prepare_spheres_by_minima(Frame& frame) { return prepare_spheres(frame, DiscForm::minima); }

}  // namespace meniscus::bench
