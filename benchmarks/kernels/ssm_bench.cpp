#include <memory>

#include "kernels/cases.hpp"
#include "kernels/native/native.hpp"
#include "stages/other_methods/spheres.hpp"
#include "stages/other_methods/ssm.hpp"

namespace meniscus::bench {
namespace {

// The spheres' depth map, what smoothing makes of it, and the native versions of both passes.
struct Maps {
  SampleGrid grid;
  Buffer<float> depth, smoothed;
  std::vector<float> host, columns, rows;  // [ny*nx]
  native::Smoothing down{}, along{};
  double open = 0;  // samples with surface
  double taps = 0;  // of one pass
};

native::Smoothing smoothing(const Maps& maps, const std::vector<float>& from,
                            std::vector<float>& to, const View& view, double scale,
                            const SsmParams& params) {
  const double sigma = params.sigma * scale / maps.grid.step;
  return {from.data(),
          to.data(),
          maps.grid.nx,
          maps.grid.ny,
          static_cast<float>(params.z_max),
          {static_cast<float>(2 * sigma * sigma), static_cast<float>(view.w_row[3]),
           static_cast<float>(-view.w_row[2])}};
}

std::shared_ptr<Maps> maps_of(Frame& frame) {
  const auto maps = std::make_shared<Maps>();
  const SsmParams& params = frame.params.ssm;
  maps->grid = pixel_grid(frame.view);
  const DeviceSpheres spheres =
      upload_spheres(frame.device, frame.view, frame.projected(), params.footprint);
  maps->depth = cast_spheres(frame.device, frame.view, spheres, maps->grid);
  maps->host = download(frame.device, maps->depth);
  maps->columns.resize(maps->host.size());
  maps->rows.resize(maps->host.size());
  maps->down = smoothing(*maps, maps->host, maps->columns, frame.view, frame.view.v_scale, params);
  maps->along = smoothing(*maps, maps->columns, maps->rows, frame.view, frame.view.u_scale, params);
  for (const float t : maps->host) {
    if (!(t < kNoSurface)) continue;
    maps->open += 1;
    // Down to a weight of 1/1024, 3.7 sigma of the Gaussian that the binomial row is near to.
    const double w = frame.view.w_row[3] - frame.view.w_row[2] * t;
    maps->taps += 3.7 * params.sigma * frame.view.v_scale / (maps->grid.step * w);
  }
  return maps;
}

Case prepare_pass(Frame& frame, bool columns) {
  const auto maps = maps_of(frame);
  Case result{.unit = "pixels", .items = maps->open, .bytes = 8 * maps->open};
  // A tap on both sides: its weight 5, differences 2, the larger of them 1, sums 4. A pixel: n 4,
  // the mean 4.
  result.operations = 12 * maps->taps + 8 * maps->open;
  result.launch = [&frame, maps] {
    maps->smoothed = smooth_depth(frame.device, frame.view, maps->depth, maps->grid,
                                  frame.params.ssm, frame.params.grid.cell);
  };
  const auto pass = [maps](Workers& workers, const native::Smoothing& input,
                           void (*smooth)(const native::Smoothing&, std::size_t, std::size_t)) {
    workers.run(static_cast<std::size_t>(input.ny), 8,
                [&](std::size_t begin, std::size_t end) { smooth(input, begin, end); });
  };
  if (columns) {
    result.native = [maps, pass](Workers& workers) {
      pass(workers, maps->down, native::smooth_columns);
    };
  } else {
    Workers alone(1);
    pass(alone, maps->down, native::smooth_columns);
    result.native = [maps, pass](Workers& workers) {
      pass(workers, maps->along, native::smooth_rows);
    };
  }
  // Only what both passes make comes back from the device.
  result.differing = [&frame, maps, pass] {
    Workers alone(1);
    pass(alone, maps->along, native::smooth_rows);
    return count_differing(maps->rows, download(frame.device, maps->smoothed));
  };
  return result;
}

}  // namespace

Case prepare_smooth_columns(Frame& frame) { return prepare_pass(frame, true); }
Case prepare_smooth_rows(Frame& frame) { return prepare_pass(frame, false); }

Case prepare_normals(Frame& frame) {
  const auto maps = maps_of(frame);
  Case result{.unit = "pixels", .items = maps->open};
  // A depth read and a normal written, for pixels without surface as well.
  result.bytes = 16.0 * static_cast<double>(maps->grid.size());
  // Five rays 16 each, differences of points 24, of depths 6, cross product 9, sign 4, length 6,
  // scale 4.
  result.operations = 133 * maps->open;
  const auto normals = std::make_shared<Buffer<float>>();
  const double z_max = frame.params.ssm.z_max;
  result.launch = [&frame, maps, normals, z_max] {
    *normals = depth_normals(frame.device, frame.view, maps->depth, maps->grid, z_max);
  };
  const auto own = std::make_shared<std::vector<float>>(3 * maps->grid.size());
  native::Normals input{maps->host.data(),
                        own->data(),
                        maps->grid.nx,
                        maps->grid.ny,
                        maps->grid.first,
                        maps->grid.step,
                        static_cast<float>(z_max),
                        {}};
  copy_rays(frame.view, input.ray);
  result.native = [maps, own, input](Workers& workers) {
    workers.run(static_cast<std::size_t>(input.ny), 8, [&](std::size_t begin, std::size_t end) {
      native::depth_normals(input, begin, end);
    });
  };
  result.differing = [&frame, own, normals] {
    return count_differing(*own, download(frame.device, *normals));
  };
  return result;
}

}  // namespace meniscus::bench
