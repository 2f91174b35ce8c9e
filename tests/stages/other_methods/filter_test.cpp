// The screen-space filters against double-precision loops, on every device.
#include "stages/other_methods/filter.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "stages/orthographic_view.hpp"
#include "stages/stage_test_support.hpp"
#include "thrown.hpp"
#include "verify/reference/filter.hpp"
#include "verify/stage_cases/cases.hpp"

namespace meniscus {
namespace {

using reference::Bounded;

struct Case {
  const char* name;
  Camera (*camera)(int, int);
  SampleGrid grid;
  double sigma;  // particle radii
};

// The cameras look from some 20 radii of 0.5 world units.
const Case kCases[] = {
    {"odd", perspective_camera, {37, 21, 0, 1}, 1.1},
    {"wide", off_centre_camera, {67, 9, 0.5f, 1}, 1.7},
    {"tall", perspective_camera, {3, 50, 0, 2}, 2.8},
    {"tiny", perspective_camera, {1, 1, 0, 1}, 1},
    {"ortho", orthographic_camera, {41, 33, 0, 1.5f}, 1.37},
};

View view_of(const Case& c) { return make_view(c.camera(c.grid.nx, c.grid.ny), 0.5, {0, 0, 0}); }

std::vector<double> doubles(const std::vector<float>& values) {
  return {values.begin(), values.end()};
}

void expect_near(const std::vector<float>& actual, const std::vector<double>& expected,
                 double tolerance) {
  ASSERT_EQ(actual.size(), expected.size());
  for (std::size_t k = 0; k < actual.size(); ++k) {
    if (std::isfinite(expected[k]))
      ASSERT_NEAR(actual[k], expected[k], tolerance) << k;
    else
      ASSERT_EQ(actual[k], kNoSurface) << k;
  }
}

class Filter : public OnDevice {
 protected:
  std::vector<float> bilateral(const View& view, const std::vector<float>& depth,
                               const SampleGrid& grid, const BilateralParams& params) {
    return download(device_, filter_bilateral(device_, view, upload(device_, depth), grid, params));
  }
  std::vector<float> narrow_range(const View& view, const std::vector<float>& depth,
                                  const SampleGrid& grid, const NarrowRangeParams& params) {
    return download(device_,
                    filter_narrow_range(device_, view, upload(device_, depth), grid, params));
  }
  std::vector<float> flow(const View& view, const std::vector<float>& depth, const SampleGrid& grid,
                          const CurvatureFlowParams& params) {
    return download(device_, flow_curvature(device_, view, upload(device_, depth), grid, params));
  }
};

TEST_P(Filter, OnePassMatchesTheReference) {
  for (const Case& c : kCases) {
    SCOPED_TRACE(c.name);
    expect_within(verify::filter_errors(device_, view_of(c), c.grid, c.sigma));
  }
}

TEST_P(Filter, SeparableBilateralMatchesTheReference) {
  for (const Case& c : kCases) {
    SCOPED_TRACE(c.name);
    const View view = view_of(c);
    const auto depth = patches(c.grid, 3);
    BilateralParams params;
    params.sigma = c.sigma;
    params.range = 0.6;
    params.separable = 1;
    const auto rows = reference::filter_bilateral(
        doubles(depth), c.grid, reference::window_of(view, c.grid, c.sigma, true, false),
        params.range);
    const auto expected = reference::filter_bilateral(
        rows.depth, c.grid, reference::window_of(view, c.grid, c.sigma, false, true), params.range);
    // Depths of a layer differ by less than 0.8, those of two layers by more than 17, whose weight
    // is zero in floats and below 1e-170 here.
    const double exponent = 3.125 + 0.5 * std::pow(0.8 / params.range, 2);
    // What the first pass is off moves the second's samples by as much, and the exponents by
    // |s| / range^2 times twice that.
    const double first = reference::quotient_error(rows, exponent, 0.8);
    const double tolerance = reference::quotient_error(expected, exponent, 0.8) +
                             first * (3 + 2 * 0.8 * 2 * 0.8 / std::pow(params.range, 2));
    ASSERT_GT(expected.disc_margin, 1e-6);  // rounding decides about no sample
    ASSERT_LT(tolerance, 1e-3);
    expect_near(bilateral(view, depth, c.grid, params), expected.depth, tolerance);
  }
}

TEST_P(Filter, NarrowRangePassesAndCleanUpMatchTheReference) {
  for (const Case& c : kCases) {
    SCOPED_TRACE(c.name);
    const View view = view_of(c);
    const auto depth = patches(c.grid, 8);
    NarrowRangeParams params;
    params.sigma = c.sigma;
    params.delta = 2;
    params.mu = 0.5;
    params.iterations = 2;
    params.separable = 1;
    params.cleanup = 2;
    std::vector<double> expected = doubles(depth);
    double tolerance = 0;
    const auto run_pass = [&](const reference::FilterWindow& window) {
      const auto result =
          reference::filter_narrow_range(expected, c.grid, window, params.delta, params.mu);
      EXPECT_GT(std::min(result.disc_margin, result.margin), 1e-5);
      expected = result.depth;
      // A sample's error moves the mean by at most as much, and the centre's its own value.
      tolerance = 2 * tolerance + reference::quotient_error(result, 3.125, 0.8 + 4 * params.mu);
    };
    for (int k = 0; k < params.iterations; ++k) {
      run_pass(reference::window_of(view, c.grid, c.sigma, true, false));
      run_pass(reference::window_of(view, c.grid, c.sigma, false, true));
    }
    // 2.5 sigma are the clean-up's two samples, or a ten-thousandth more.
    const double sigma = 0.8 * std::sqrt(1.0001);
    run_pass({[&](double) { return std::array<double, 2>{sigma, sigma}; }, true, true});
    ASSERT_LT(tolerance, 1e-2);
    expect_near(narrow_range(view, depth, c.grid, params), expected, tolerance);
  }
}

TEST_P(Filter, FlowMatchesTheReference) {
  for (const Case& c : kCases) {
    SCOPED_TRACE(c.name);
    const View view = view_of(c);
    const auto depth = patches(c.grid, 11);
    CurvatureFlowParams params;
    params.z_max = 2;
    // The longest stable step is half the square of a sample's side at the nearest depth.
    float nearest = kNoSurface;
    for (const float t : depth) nearest = std::min(nearest, t);
    const double side = c.grid.step * (view.w_row[3] - view.w_row[2] * nearest) /
                        std::max(view.u_scale, view.v_scale);
    const double longest = 0.5 * params.step * side * side;
    params.time = 1.5 * longest;
    std::vector<Bounded> expected;
    for (const float t : depth) expected.push_back({t, 0.0});
    double margin = 1e9;
    for (int k = 0; k < 2; ++k)
      expected =
          reference::flow_step(view, expected, c.grid, params.z_max, params.time / 2, margin);
    ASSERT_GT(margin, 1e-3);
    const auto actual = flow(view, depth, c.grid, params);
    int tight = 0;
    for (std::size_t k = 0; k < actual.size(); ++k) {
      if (!std::isfinite(expected[k].value)) {
        ASSERT_EQ(actual[k], kNoSurface);
        continue;
      }
      ASSERT_NEAR(actual[k], expected[k].value, expected[k].error) << k;
      tight += expected[k].error < 1e-3;
    }
    EXPECT_GT(2 * tight, static_cast<int>(actual.size()) / 2);  // the bounds say something
  }
}

// A sphere of radius R shrinks as R^2 - 2 tau: H = 1/R.
TEST_P(Filter, FlowShrinksASphere) {
  const SampleGrid grid{61, 61, 0.5f, 1};
  constexpr double kSide = 0.125;  // radii that a sample spans
  const double scale = 2 / (61 * kSide);
  const View view = orthographic_view(61, 61, {scale, scale, -0.001});
  constexpr double kRadius = 8;
  const auto depth = map_of(grid, [&](int i, int j) {
    const double x = kSide * (i - 30), y = kSide * (j - 30);
    return 20 - std::sqrt(kRadius * kRadius - x * x - y * y);
  });
  CurvatureFlowParams params;
  params.time = 0.5;
  const auto flowed = flow(view, depth, grid, params);
  const double radius = std::sqrt(kRadius * kRadius - 2 * params.time);
  // The middle, farther from the map's ends than the flow carries what it does not know there:
  // eight sigma = 5.7 radii would be safe, the map has 3.75; at 3 radii, 4.2 sigma, a difference
  // of 3 arrives with erfc(3) = 2e-5 of it. The differences' own error is side^2 / R^2 of the move.
  const double move = kRadius - radius;
  const double tolerance = 3 * 2e-5 + move * kSide * kSide + 200 * 20 * kEpsilon;
  for (int j = 25; j <= 35; ++j)
    for (int i = 25; i <= 35; ++i) {
      const double x = kSide * (i - 30), y = kSide * (j - 30);
      EXPECT_NEAR(flowed[j * 61 + i], 20 - std::sqrt(radius * radius - x * x - y * y), tolerance);
    }
  EXPECT_GT(move, 20 * tolerance);
}

// Ramps of multiples of 1/8 keep their bits: windows are symmetric, what is beyond a step nearer
// or beyond the image drops out with its opposite; the flow of a plane is none.
TEST_P(Filter, RampsStay) {
  const SampleGrid grid{45, 27, 0, 1};
  const auto depth =
      map_of(grid, [](int i, int j) { return 16 + 0.25 * i + 0.125 * j + (i < 20 ? 0 : 40); });
  const View view = make_view(orthographic_camera(45, 27), 0.5, {0, 0, 0});
  NarrowRangeParams narrow;
  narrow.sigma = 1;
  narrow.delta = 0.3125;
  narrow.mu = 0;
  const auto filtered = narrow_range(view, depth, grid, narrow);
  BilateralParams wide;
  wide.sigma = 1;
  wide.range = 1;
  const auto smoothed = bilateral(view, depth, grid, wide);
  CurvatureFlowParams short_flow;
  short_flow.time = 1;
  const auto flowed = flow(view, depth, grid, short_flow);
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const int k = j * grid.nx + i;
      // The near side of the step sees what is behind it mu = 0 behind: it flattens. The far does
      // not see the near side.
      if (i >= 20) {
        EXPECT_EQ(filtered[k], depth[k]) << i << ' ' << j;
      }
      // A window that the image's end or the step cuts is not symmetric for the bilateral filter.
      if (i >= 4 && std::abs(i - 20) > 4 && i < 41 && j >= 4 && j < 23) {
        // At most 81 samples, each within 2 of the centre, and the sum's last rounding.
        EXPECT_NEAR(smoothed[k], depth[k], (2 * 81 + 40) * kEpsilon) << i << ' ' << j;
      }
      // Second differences vanish to the bit but for the rays' own roundings.
      EXPECT_NEAR(flowed[k], depth[k], 40 * kEpsilon) << i << ' ' << j;
    }
}

TEST_P(Filter, VectorsOfAnyWidthGiveTheSameBits) {
  for (const Case& c : kCases) {
    SCOPED_TRACE(c.name);
    const View view = view_of(c);
    const auto depth = patches(c.grid, 13);
    const auto all = [&](int width) {
      use_width(width);
      BilateralParams wide;
      wide.sigma = c.sigma;
      NarrowRangeParams narrow;
      narrow.sigma = c.sigma;
      narrow.delta = 0.7;
      return std::vector{bilateral(view, depth, c.grid, wide),
                         narrow_range(view, depth, c.grid, narrow), flow(view, depth, c.grid, {})};
    };
    EXPECT_EQ(all(1), all(8));
  }
}

TEST_P(Filter, NamesAMapOfTheWrongSize) {
  const SampleGrid grid{4, 3, 0, 1};
  const std::vector<float> depth(11, 1.0f);
  const View view = make_view(orthographic_camera(4, 3), 0.5, {0, 0, 0});
  const auto expect_named = [&](const auto& filter) {
    EXPECT_EQ(text_of_thrown<InvalidArgument>([&] { filter(); }),
              "filter: the depth map has 11 values but the grid 4 x 3 samples");
  };
  expect_named([&] { bilateral(view, depth, grid, {}); });
  expect_named([&] { narrow_range(view, depth, grid, {}); });
  expect_named([&] { flow(view, depth, grid, {}); });
}

MENISCUS_ON_EVERY_DEVICE(Filter);

}  // namespace
}  // namespace meniscus
