#include <memory>
#include <numbers>

#include "kernels/cases.hpp"
#include "stages/other_methods/filter.hpp"
#include "stages/other_methods/spheres.hpp"

namespace meniscus::bench {
namespace {

// The windows grow with the image: a grid with a sample every four pixels keeps them to what takes
// a moment, whatever the image.
constexpr double kStep = 4;

struct Map {
  SampleGrid grid;
  Buffer<float> depth;
  double open = 0;             // samples with surface
  double inverse_squares = 0;  // sum of 1 / w^2 over them: what their windows grow with
};

std::shared_ptr<Map> map_of(Frame& frame, double footprint) {
  const auto map = std::make_shared<Map>();
  map->grid = node_grid(frame.view, kStep);
  const DeviceSpheres spheres =
      upload_spheres(frame.device, frame.view, frame.projected(), footprint);
  map->depth = cast_spheres(frame.device, frame.view, spheres, map->grid);
  const auto& w_row = frame.view.w_row;
  for (const float t : download(frame.device, map->depth)) {
    if (!(t < kNoSurface)) continue;
    const double w = w_row[3] - w_row[2] * t;
    map->open += 1;
    map->inverse_squares += 1 / (w * w);
  }
  return map;
}

// Samples in all windows: discs of 2.5 sigma.
double windows(const Frame& frame, const Map& map, double sigma) {
  const double half_u = 2.5 * sigma * frame.view.u_scale / kStep;
  const double half_v = 2.5 * sigma * frame.view.v_scale / kStep;
  return std::numbers::pi * half_u * half_v * map.inverse_squares;
}

}  // namespace

Case prepare_bilateral(Frame& frame) {
  const BilateralParams& params = frame.params.bilateral;
  const auto map = map_of(frame, params.footprint);
  Case result{.unit = "samples", .items = map->open, .bytes = 8 * map->open};
  // A sample of the window: distance on the screen 3, in depth 1, exponent 3, exponential 21, sums
  // 3. The window itself and the quotient: 10.
  result.operations = 31 * windows(frame, *map, params.sigma) + 10 * map->open;
  result.launch = [&frame, map] {
    filter_bilateral(frame.device, frame.view, map->depth, map->grid, frame.params.bilateral);
  };
  return result;
}

Case prepare_narrow_range(Frame& frame) {
  NarrowRangeParams params = frame.params.narrow_range;
  params.cleanup = 0;  // another window
  const auto map = map_of(frame, params.footprint);
  Case result{.unit = "samples", .items = map->open, .bytes = 8 * map->open};
  // A pair of opposite samples: distance 2 and weight 22, differences 2, sums 6, ranges 8.
  result.operations = 20 * windows(frame, *map, params.sigma) + 10 * map->open;
  result.launch = [&frame, map, params] {
    filter_narrow_range(frame.device, frame.view, map->depth, map->grid, params);
  };
  return result;
}

Case prepare_flow(Frame& frame) {
  CurvatureFlowParams params = frame.params.curvature_flow;
  params.time = 0.1;
  const auto map = map_of(frame, params.footprint);
  Case result{.unit = "samples", .items = map->open, .bytes = 8 * map->open};
  // Eight differences 8, ray and tangents 24, first differences 34, second 22, mixed 32, normal 9,
  // fundamental forms 30, speed and step 16.
  result.operations = 175 * map->open;
  result.launch = [&frame, map, params] {
    flow_curvature(frame.device, frame.view, map->depth, map->grid, params);
  };
  return result;
}

}  // namespace meniscus::bench
