// The baseline's kernels against double-precision loops, on every device.
#include "stages/other_methods/ssm.hpp"

#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>
#include <random>

#include "meniscus/camera.hpp"
#include "stages/mesh/mesh.hpp"
#include "stages/mesh/silhouettes.hpp"
#include "stages/orthographic_view.hpp"
#include "stages/stage_test_support.hpp"
#include "thrown.hpp"
#include "verify/stage_cases/cases.hpp"

namespace meniscus {
namespace {

View perspective_view(int width, int height) {
  return make_view(look_at({0, 0, 20}, {0, 0, 0}, {0, 1, 0}, 50, width, height), 0.5, {0, 0, 0});
}

struct Case {
  const char* name;
  bool orthographic;
  SampleGrid grid;
  double sigma;
  int filter;
  double cell;
};

const Case kCases[] = {
    {"odd", false, {37, 21, 0, 1}, 1.1, 0, 2},        {"wide", false, {131, 9, 0.5f, 1}, 2.2, 0, 2},
    {"tall", false, {3, 70, 0, 2}, 0.8, 0, 2},        {"tiny", false, {1, 1, 0, 1}, 1, 0, 2},
    {"coarse", true, {41, 33, 0, 1.5f}, 1.6, 0, 1.5}, {"filter", true, {29, 30, 0, 2}, 1, 3, 2},
    {"pixels", false, {53, 19, 0.5f, 1}, 1, 1, 2},
};

View view_of(const Case& c) {
  return c.orthographic ? orthographic_view(c.grid.nx, c.grid.ny)
                        : perspective_view(c.grid.nx, c.grid.ny);
}

SsmParams params_of(const Case& c) {
  SsmParams params;
  params.z_max = 2;
  params.sigma = c.sigma;
  params.filter = c.filter;
  return params;
}

class Ssm : public OnDevice {
 protected:
  std::vector<float> smoothed(const View& view, const std::vector<float>& depth,
                              const SampleGrid& grid, const SsmParams& params, double cell) {
    return download(device_,
                    smooth_depth(device_, view, upload(device_, depth), grid, params, cell));
  }
};

// Of the smoothing, and of the normals of what it makes.
TEST_P(Ssm, MatchesTheReference) {
  for (const Case& c : kCases) {
    SCOPED_TRACE(c.name);
    expect_within(
        verify::ssm_errors(device_, view_of(c), c.grid, patches(c.grid, 4), params_of(c), c.cell));
  }
}

TEST_P(Ssm, VectorsOfAnyWidthGiveTheSameBits) {
  for (const Case& c : kCases) {
    const View view = view_of(c);
    const auto depth = patches(c.grid, 5);
    device_.state().vector_width = 1;
    const auto one = smoothed(view, depth, c.grid, params_of(c), c.cell);
    device_.state().vector_width = 8;
    EXPECT_EQ(smoothed(view, depth, c.grid, params_of(c), c.cell), one) << c.name;
  }
}

TEST_P(Ssm, NormalsOfAnyWidthHaveTheSameBits) {
  for (const Case& c : kCases) {
    const View view = view_of(c);
    const auto depth = upload(device_, patches(c.grid, 6));
    device_.state().vector_width = 1;
    const auto one = download(device_, depth_normals(device_, view, depth, c.grid, 0.5));
    device_.state().vector_width = 8;
    EXPECT_EQ(download(device_, depth_normals(device_, view, depth, c.grid, 0.5)), one) << c.name;
  }
}

// Two ramps, one behind the other, and none beside them. Symmetric windows keep them to the bit:
// the depths and their differences are multiples of 1/8.
TEST_P(Ssm, RampsAndStepsStay) {
  const SampleGrid grid{45, 27, 0, 1};
  std::vector<float> depth;
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const float ramp = 16 + 0.25f * static_cast<float>(i) + 0.125f * static_cast<float>(j);
      depth.push_back(i < 20 ? ramp : i < 37 ? ramp + 10 : kNoSurface);
    }
  SsmParams params;
  params.sigma = 2;
  EXPECT_EQ(smoothed(perspective_view(45, 27), depth, grid, params, 1), depth);
}

// The binomial row 2n itself: an impulse of 1/2 becomes the outer product of 1/4 2/4 1/4.
TEST_P(Ssm, FilterIsTheBinomialRow) {
  const SampleGrid grid{9, 9, 0, 2};
  std::vector<float> depth(grid.size(), 8.0f);
  depth[4 * 9 + 4] = 8.5f;
  SsmParams params;
  params.filter = 1;
  const auto map = smoothed(orthographic_view(16, 16), depth, grid, params, 2);
  const double row[3] = {0.5, 0.25, 0};
  for (int j = 0; j < 9; ++j)
    for (int i = 0; i < 9; ++i)
      EXPECT_EQ(map[j * 9 + i],
                8 + 0.5 * row[std::min(2, std::abs(i - 4))] * row[std::min(2, std::abs(j - 4))]);
}

TEST_P(Ssm, NamesAMapOfTheWrongSize) {
  const SampleGrid grid{4, 3, 0, 1};
  const auto depth = filled<float>(device_, 11, 1.0f);
  EXPECT_EQ(text_of_thrown<InvalidArgument>(
                [&] { smooth_depth(device_, orthographic_view(4, 3), depth, grid, {}, 2); }),
            "ssm: the depth map has 11 values but the grid 4 x 3 samples");
}

// Spheres on two layers, 20 and 40 radii away, seen by a camera that shows one radius as `pixels`,
// and the depth map of their fronts.
struct Spheres {
  Projected particles;
  SurfaceMap nodes;
};

Spheres two_layers_of_spheres(int count, const SampleGrid& grid, double pixels, double footprint) {
  Spheres scene;
  std::mt19937 random(11);
  for (int k = 0; k < count; ++k) {
    const auto share = [&] { return static_cast<float>(random() % 4096) / 4096; };
    scene.particles.u.push_back(grid.step * static_cast<float>(grid.nx) * share());
    scene.particles.v.push_back(grid.step * static_cast<float>(grid.ny) * share());
    scene.particles.z.push_back(-(k % 2 ? 20 : 40) - share());
    scene.particles.scale.push_back(0.8f + 0.4f * share());
    const float span = static_cast<float>(pixels) * scene.particles.scale.back();
    scene.particles.ku.push_back(span);
    scene.particles.kv.push_back(1.25f * span);  // pixels need not be square
  }
  scene.particles.x = scene.particles.y = scene.particles.u;  // not used
  scene.nodes.grid = grid;
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      float nearest = kNoSurface;
      for (int p = 0; p < count; ++p) {
        const double du = (grid.step * i - scene.particles.u[p]) / scene.particles.ku[p];
        const double dv = (grid.step * j - scene.particles.v[p]) / scene.particles.kv[p];
        const double rest = footprint * footprint - du * du - dv * dv;
        if (rest >= 0)
          nearest =
              std::min(nearest, static_cast<float>(-scene.particles.z[p] -
                                                   scene.particles.scale[p] * std::sqrt(rest)));
      }
      scene.nodes.depth.push_back(nearest);
    }
  return scene;
}

TEST(SsmCuts, LieWhereTheFrontLayersCirclesEnd) {
  const SampleGrid grid{61, 47, 0, 2};
  SsmParams params;
  const auto [particles, nodes] = two_layers_of_spheres(60, grid, 4, params.footprint);
  auto edges = find_silhouette_edges(nodes, params.z_max);
  for (auto& edge : edges) edge.cut = -1;
  const auto cut = place_circle_cuts(nodes, edges, particles, params.footprint, params.z_max);
  ASSERT_EQ(cut.size(), edges.size());
  int in_front_of_a_layer = 0;
  for (std::size_t e = 0; e < cut.size(); ++e) {
    // The circle at f + s (b - f) is a quadratic in s; its larger root is where the edge leaves it.
    const int f = edges[e].front, b = edges[e].back;
    double farthest = -1;
    for (std::size_t p = 0; p < particles.size(); ++p) {
      if ((-particles.z[p] < 30) != (nodes.depth[f] < 30)) continue;
      const double ru = params.footprint * particles.ku[p];
      const double rv = params.footprint * particles.kv[p];
      const double u = (2.0 * (f % grid.nx) - particles.u[p]) / ru;
      const double v = (2.0 * (f / grid.nx) - particles.v[p]) / rv;
      const double su = 2.0 * (b % grid.nx - f % grid.nx) / ru;
      const double sv = 2.0 * (b / grid.nx - f / grid.nx) / rv;
      const double qa = su * su + sv * sv, qb = u * su + v * sv, qc = u * u + v * v - 1;
      if (qb * qb < qa * qc) continue;
      const double root = (-qb + std::sqrt(qb * qb - qa * qc)) / qa;
      if (root >= 0 && root < 1) farthest = std::max(farthest, root);
    }
    ASSERT_GE(farthest, 0) << "an outline of spheres that no circle makes";
    EXPECT_NEAR(cut[e].cut, farthest, 1e-6) << e;  // one rounding to float, and doubles before it
    EXPECT_EQ(cut[e].front, f);
    in_front_of_a_layer += std::isfinite(nodes.depth[b]);
  }
  EXPECT_GT(in_front_of_a_layer, 0);
}

// A jump without a circle, and circles that belong to another layer, leave the cut as it was.
TEST(SsmCuts, IgnoreTheCirclesOfOtherLayers) {
  const SampleGrid grid{21, 21, 0, 2};
  auto [particles, nodes] = two_layers_of_spheres(40, grid, 4, 1.5);
  nodes.depth.assign(grid.size(), kNoSurface);
  for (int k = 0; k < 200; ++k) nodes.depth[k] = 10;
  const auto edges = find_silhouette_edges(nodes, 3);
  for (const auto& edge : place_circle_cuts(nodes, edges, particles, 1.5, 3))
    EXPECT_EQ(edge.cut, 0.5f);
}

MENISCUS_ON_EVERY_DEVICE(Ssm);

}  // namespace
}  // namespace meniscus
