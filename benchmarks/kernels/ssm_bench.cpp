#include <memory>

#include "kernels/cases.hpp"
#include "stages/other_methods/spheres.hpp"
#include "stages/other_methods/ssm.hpp"

namespace meniscus::bench {
namespace {

// The spheres' depth map.
struct Maps {
  SampleGrid grid;
  Buffer<float> depth;
  double open = 0;  // samples with surface
  double taps = 0;  // of one pass of smoothing
};

std::shared_ptr<Maps> maps_of(Frame& frame) {
  const auto maps = std::make_shared<Maps>();
  const SsmParams& params = frame.params.ssm;
  maps->grid = pixel_grid(frame.view);
  const DeviceSpheres spheres =
      upload_spheres(frame.device, frame.view, frame.projected(), params.footprint);
  maps->depth = cast_spheres(frame.device, frame.view, spheres, maps->grid);
  for (const float t : download(frame.device, maps->depth)) {
    if (!(t < kNoSurface)) continue;
    maps->open += 1;
    // Down to a weight of 1/1024, 3.7 sigma of the Gaussian that the binomial row is near to.
    const double w = frame.view.w_row[3] - frame.view.w_row[2] * t;
    maps->taps += 3.7 * params.sigma * frame.view.v_scale / (maps->grid.step * w);
  }
  return maps;
}

}  // namespace

Case prepare_smooth_columns(Frame& frame) {
  const auto maps = maps_of(frame);
  Case result{.unit = "pixels", .items = maps->open, .bytes = 8 * maps->open};
  // A tap on both sides: its weight 5, differences 2, the larger of them 1, sums 4. A pixel: n 4,
  // the mean 4.
  result.operations = 12 * maps->taps + 8 * maps->open;
  result.launch = [&frame, maps] {
    smooth_depth(frame.device, frame.view, maps->depth, maps->grid, frame.params.ssm,
                 frame.params.grid.cell);
  };
  return result;
}
// Smoothing has both passes; events tell them apart.
Case prepare_smooth_rows(Frame& frame) { return prepare_smooth_columns(frame); }

Case prepare_normals(Frame& frame) {
  const auto maps = maps_of(frame);
  Case result{.unit = "pixels", .items = maps->open};
  // A depth read and a normal written, for pixels without surface as well.
  result.bytes = 16.0 * static_cast<double>(maps->grid.size());
  // Five rays 16 each, differences of points 24, of depths 6, cross product 9, sign 4, length 6,
  // scale 4.
  result.operations = 133 * maps->open;
  const double z_max = frame.params.ssm.z_max;
  result.launch = [&frame, maps, z_max] {
    depth_normals(frame.device, frame.view, maps->depth, maps->grid, z_max);
  };
  return result;
}

}  // namespace meniscus::bench
