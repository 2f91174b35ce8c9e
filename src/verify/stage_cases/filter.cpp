// The filters of filter.cl: bilateral, narrow range and curvature flow.
#include "stages/other_methods/filter.hpp"

#include "verify/reference/filter.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/inputs.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {
namespace {

ReferenceError compared(const char* kernel, const std::vector<float>& found,
                        const std::vector<double>& expected, double bound) {
  Worst worst(kernel, "depth");
  for (std::size_t k = 0; k < expected.size(); ++k) worst.see(found[k], expected[k], bound);
  return worst.error();
}

std::vector<double> doubles(const std::vector<float>& values) {
  return {values.begin(), values.end()};
}

ReferenceError bilateral(Device& device, const View& view, const SampleGrid& grid, double sigma) {
  const std::vector<float> depth = patches(grid, 3);
  BilateralParams params;
  params.sigma = sigma;
  params.range = 0.6;
  params.separable = 0;
  const auto expected = reference::filter_bilateral(
      doubles(depth), grid, reference::window_of(view, grid, sigma), params.range);
  // Depths of a layer differ by less than 0.8, those of two layers weigh nothing.
  const double exponent = 3.125 + 0.5 * std::pow(0.8 / params.range, 2);
  const double bound = reference::quotient_error(expected, exponent, 0.8);
  require_decided(expected.disc_margin > 1e-6 && bound < 1e-3);
  return compared(
      "filter_bilateral",
      download(device, filter_bilateral(device, view, upload(device, depth), grid, params)),
      expected.depth, bound);
}

ReferenceError narrow_range(Device& device, const View& view, const SampleGrid& grid,
                            double sigma) {
  const std::vector<float> depth = stairs(grid, 5);
  NarrowRangeParams params;
  params.sigma = sigma;
  params.delta = 41.0 / 128;
  params.mu = 0.75;
  params.cleanup = 0;
  const reference::FilterWindow window = reference::window_of(view, grid, sigma);
  const auto expected =
      reference::filter_narrow_range(doubles(depth), grid, window, params.delta, params.mu);
  const auto [su, sv] = window.sigma(20);
  const double span = std::max(params.mu, 2.5 * (su * 0.25 + sv * 0.125) + 0.25);
  const double bound = reference::quotient_error(expected, 3.125, span);
  // Floats hold what is compared exactly.
  require_decided(expected.disc_margin > 1e-6 && expected.margin >= 1.0 / 128 && bound < 1e-2);
  return compared(
      "filter_narrow_range",
      download(device, filter_narrow_range(device, view, upload(device, depth), grid, params)),
      expected.depth, bound);
}

ReferenceError flow(Device& device, const View& view, const SampleGrid& grid) {
  const std::vector<float> depth = patches(grid, 11);
  CurvatureFlowParams params;
  params.z_max = 2;
  // Two steps; the longest stable one is half the square of a sample's side at the nearest depth.
  const double nearest = *std::min_element(depth.begin(), depth.end());
  const double side =
      grid.step * (view.w_row[3] - view.w_row[2] * nearest) / std::max(view.u_scale, view.v_scale);
  params.time = 1.5 * 0.5 * params.step * side * side;
  std::vector<reference::Bounded> expected;
  for (const float t : depth) expected.push_back({t, 0.0});
  double margin = 1e9;
  for (int k = 0; k < 2; ++k)
    expected = reference::flow_step(view, expected, grid, params.z_max, params.time / 2, margin);
  const std::vector<float> found =
      download(device, flow_curvature(device, view, upload(device, depth), grid, params));
  Worst worst("flow_step", "depth");
  for (std::size_t k = 0; k < expected.size(); ++k)
    worst.see(found[k], expected[k].value, expected[k].error);
  return worst.error();
}

}  // namespace

ReferenceErrors filter_case(Device& device, int size) {
  const SampleGrid grid{size, size / 2 + 3, 0, 1};
  const View view = make_view(perspective_camera(grid.nx, grid.ny), 0.5, {0, 0, 0});
  ReferenceErrors errors = filter_errors(device, view, grid, 1.1);
  errors.push_back(flow(device, view, grid));
  return errors;
}

ReferenceErrors filter_errors(Device& device, const View& view, const SampleGrid& grid,
                              double sigma) {
  return {bilateral(device, view, grid, sigma), narrow_range(device, view, grid, sigma)};
}

}  // namespace meniscus::verify
