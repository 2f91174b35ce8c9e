// The sphere splats against a loop over all particles, on every device.
#include "stages/frame/visible.hpp"

#include <algorithm>
#include <climits>
#include <numbers>
#include <numeric>

#include "stages/orthographic_view.hpp"
#include "stages/sample/behind.hpp"
#include "stages/stage_test_support.hpp"
#include "verify/reference/visible.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/into_new.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus {
namespace {

std::size_t block_of(const SampleGrid& grid, std::size_t s) {
  const std::size_t nx = static_cast<std::size_t>(grid.nx);
  return s / nx / 8 * ((nx + kTile - 1) / kTile * 2) + s % nx / 8;
}

// Blocks have as many samples as a map is finite at.
void expect_counted(Device& device, const SampleGrid& grid, const std::vector<float>& map,
                    const OccupiedBlocks& occupied) {
  std::vector<cl_int> expected(occupied.size);
  for (std::size_t s = 0; s < map.size(); ++s) expected[block_of(grid, s)] += map[s] < kNoSurface;
  EXPECT_EQ(download(device, occupied), expected);
}

using Visibility = OnDevice;

constexpr int kWidth = 61, kHeight = 47;

Projected scattered(std::size_t n, unsigned seed) { return discs(n, seed, kWidth, kHeight); }

std::vector<std::int32_t> all_of(const Projected& p) {
  std::vector<std::int32_t> indices(p.size());
  std::iota(indices.begin(), indices.end(), 0);
  return indices;
}

// Fronts deeper than front + gap, where that is finite.
std::vector<float> behind(Device& device, const SplatParticles& splats, const SampleGrid& grid,
                          const Buffer<float>& front, double gap) {
  const GapLists gaps = list_gaps(device, grid, front, gap);
  const DiscsBehind discs = list_discs(device, splats, {{1.8f, 1.0f}}, gaps);
  std::vector<float> depth = download(device, splat_behind(device, discs, gaps.lists, front, gap));
  const std::vector<float> asked = download(device, front);
  for (std::size_t k = 0; k < depth.size(); ++k)
    if (!(asked[k] < kNoSurface)) depth[k] = kNoSurface;
  return depth;
}

const SampleGrid kGrids[] = {{kWidth, kHeight, 0.5f, 1.0f}, {32, 25, 0.0f, 2.0f}, {1, 1, 20, 1}};

TEST_P(Visibility, DepthMatchesTheReference) {
  verify::Worst worst("splat_depth", "depth");
  for (const std::size_t n : {1, 63, 130})
    for (const SampleGrid& grid : kGrids)
      for (const auto& [footprint, bulge] : {std::pair{1.0, 1.0}, {1.8, 1.0}, {2.2, 0.45}})
        verify::see_splats(device_, scattered(n, 5), grid, footprint, bulge, worst);
  expect_within({worst.error()});
}

TEST_P(Visibility, TheSecondLayerLiesBehindTheFirst) {
  const SampleGrid grid = kGrids[0];
  const Projected p = scattered(200, 6);
  const auto splats = upload_splats(device_, p, all_of(p));
  const auto first = splat_depth(device_, splats, grid, 1.8);
  constexpr double kGap = 3;
  const auto second = behind(device_, splats, grid, first, kGap);
  const auto bounds =
      reference::splat_behind(p, grid, 1.8, download(device_, first), kGap, kEpsilon);
  std::size_t layers = 0;
  for (std::size_t node = 0; node < grid.size(); ++node) {
    EXPECT_GE(second[node], bounds.low[node]);
    EXPECT_LE(second[node], bounds.high[node]);
    layers += second[node] < kNoSurface;
  }
  EXPECT_GT(layers, grid.size() / 4);
}

TEST_P(Visibility, OwnersHaveTheMapsDepthAndTheLowestIndex) {
  const SampleGrid grid = kGrids[0];
  const Projected p = scattered(130, 7);
  const auto splats = upload_splats(device_, p, all_of(p));
  const auto depth = splat_depth(device_, splats, grid, 1.8);
  const auto owner = download(device_, splat_owner(device_, splats, grid, 1.8));
  const auto front = download(device_, depth);
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const std::size_t node = static_cast<std::size_t>(j) * grid.nx + i;
      if (!(front[node] < kNoSurface)) {
        EXPECT_EQ(owner[node], INT_MAX);
        continue;
      }
      ASSERT_GE(owner[node], 0);
      ASSERT_LT(owner[node], static_cast<int>(p.size()));
      EXPECT_NE(owner[node] % 10, 9) << "of two equal spheres the first owns the node";
      const auto f = reference::front(p, static_cast<std::size_t>(owner[node]), grid.first + i,
                                      grid.first + j, 1.8, 1, kEpsilon);
      EXPECT_GE(front[node], f.low);
      EXPECT_LE(front[node], f.high);
    }
}

// What many particles show is, to the bit, the nearest of what each shows alone, and its owner the
// first of the nearest: nothing that shows is ever left out, whatever it hides or is hidden by.
TEST_P(Visibility, HiddenParticlesAreLeftOutExactly) {
  struct Scene {
    int count;
    double least, most;  // pixels that a radius spans
    bool level;          // particles on a lattice of places and depths: many equal fronts
  };
  const Scene scenes[] = {
      {1, 5, 5, false},    {1, 300, 300, false}, {150, 1.5, 6, false}, {150, 0.2, 2, false},
      {60, 20, 90, false}, {150, 2, 2, true},    {150, 7, 7, true},
  };
  for (const unsigned seed : {1u, 2u, 3u})
    for (const Scene& scene : scenes)
      for (const SampleGrid& grid : kGrids) {
        Random random(seed);
        Projected p;
        for (int i = 0; i < scene.count; ++i) {
          const auto next = [&](double low, double high) {
            const double x = random(low, high);
            return static_cast<float>(scene.level ? 4 * std::floor(x / 4) : x);
          };
          p.u.push_back(next(0, kWidth));
          p.v.push_back(next(0, kHeight));
          p.z.push_back(next(-40, -12));
          p.ku.push_back(static_cast<float>(random(scene.least, scene.most)));
          p.kv.push_back(scene.level ? p.ku.back() : 1.2f * p.ku.back());
          p.scale.push_back(scene.level ? 1.0f : static_cast<float>(random(0.5, 1.5)));
        }
        p.x = p.y = p.u;  // not used
        std::vector<float> nearest(grid.size(), kNoSurface), second = nearest;
        std::vector<cl_int> owner(grid.size(), INT_MAX);
        std::vector<std::vector<float>> alone;
        for (const std::int32_t i : all_of(p)) {
          alone.push_back(
              download(device_, splat_depth(device_, upload_splats(device_, p, {i}), grid, 1.8)));
          for (std::size_t k = 0; k < grid.size(); ++k)
            if (alone.back()[k] < nearest[k]) {
              nearest[k] = alone.back()[k];
              owner[k] = i;
            }
        }
        constexpr float kGap = 1.5f;
        for (const auto& one : alone)
          for (std::size_t k = 0; k < grid.size(); ++k)
            if (one[k] > nearest[k] + kGap) second[k] = std::min(second[k], one[k]);
        const auto splats = upload_splats(device_, p, all_of(p));
        for (const int way : {0, 1, 2, 3}) {
          use_width(way % 2 == 0 ? 1 : 8);
          device_.state().discs = way < 2 ? DiscForm::bins : DiscForm::minima;
          const auto depth = splat_depth(device_, splats, grid, 1.8);
          EXPECT_EQ(download(device_, depth), nearest);
          EXPECT_EQ(download(device_, splat_owner(device_, splats, grid, 1.8)), owner);
          EXPECT_EQ(behind(device_, splats, grid, depth, kGap), second);
        }
      }
}

// A cap that bulges away from the camera: its front is the rim.
TEST_P(Visibility, CapsMayBulgeBackwards) {
  const SampleGrid grid = kGrids[0];
  const Projected p = scattered(130, 9);
  std::vector<float> nearest(grid.size(), kNoSurface);
  for (const std::int32_t i : all_of(p)) {
    const auto one =
        download(device_, splat_depth(device_, upload_splats(device_, p, {i}), grid, 1.8, -0.5));
    for (std::size_t k = 0; k < grid.size(); ++k) nearest[k] = std::min(nearest[k], one[k]);
  }
  EXPECT_EQ(download(device_,
                     splat_depth(device_, upload_splats(device_, p, all_of(p)), grid, 1.8, -0.5)),
            nearest);
}

TEST_P(Visibility, ExtentsGoFromTheNearestFrontToTheFarthestBack) {
  const SampleGrid grid = kGrids[0];
  const Projected p = scattered(130, 8);
  const SplatParticles splats = upload_splats(device_, p, all_of(p));
  const Extent extent = splat_extent(device_, splats, grid, 2, any_blocks(device_, grid));
  const auto near = download(device_, extent.from), far = download(device_, extent.to);
  EXPECT_EQ(near, download(device_, splat_depth(device_, splats, grid, 2)));
  expect_counted(device_, grid, near, extent.occupied);
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      double low = 0, high = 0;
      for (std::size_t k = 0; k < p.size(); ++k) {
        // A back is the front mirrored at the particle's depth.
        const auto f = reference::front(p, k, grid.first + i, grid.first + j, 2, 1, kEpsilon);
        const double mirror = -2.0 * p.z[k];
        if (f.possible) high = std::max(high, mirror - f.low);
        if (f.sure) low = std::max(low, mirror - f.high);
      }
      const std::size_t s = static_cast<std::size_t>(j) * grid.nx + i;
      const float actual = near[s] < kNoSurface ? far[s] : 0;
      EXPECT_GE(actual, low);
      EXPECT_LE(actual, high);
    }
}

TEST_P(Visibility, FrontsAreThoseOfTheDepthMapInOccupiedBlocks) {
  const Projected p = scattered(130, 9);
  const SplatParticles splats = upload_splats(device_, p, all_of(p));
  for (const SampleGrid& grid : kGrids) {
    const Fronts maps = splat_fronts(device_, splats, grid, 1.8, 0.6);
    const auto full = download(device_, splat_depth(device_, splats, grid, 1.8, 0.6));
    expect_counted(device_, grid, full, maps.occupied);
    const auto occupied = download(device_, maps.occupied);
    auto depth = download(device_, maps.depth);
    for (std::size_t s = 0; s < depth.size(); ++s)
      if (occupied[block_of(grid, s)] == 0) depth[s] = kNoSurface;  // not written
    EXPECT_EQ(depth, full);
  }
}

// A lattice of spheres that touch, parallel to the screen, one radius 8 pixels.
Projected lattice(const View& view, double depth, double shift, Projected p = {}) {
  for (int j = 0; j < 8; ++j)
    for (int i = 0; i < 8; ++i) {
      const float u = static_cast<float>(16 * i + 8 + shift),
                  v = static_cast<float>(16 * j + 8 + shift);
      add_particle(p, point_at(view, u, v, depth), u, v, 8, 8);
    }
  return p;
}

View lattice_view() { return orthographic_view(128, 128, {0.125, 0.125, -0.01}); }

TEST_P(Visibility, ALayerHidesTheOneBehindIt) {
  const View view = lattice_view();
  Projected p = lattice(view, 20, 0);
  p = lattice(view, 22, 4, p);  // 64 to 127, behind
  const VisibleParams params;
  const Visible visible = find_visible(device_, view, p, all_of(p), params, params.owned);
  std::vector<std::int32_t> front(64);
  std::iota(front.begin(), front.end(), 0);
  EXPECT_EQ(visible.index, front);
  // A sphere inside the lattice owns its square of 16 x 16 pixels: up to the square's border the
  // distance to its centre is the least. The grid's nodes are exactly h apart, and the square's
  // share of the footprint's area is (2 / 1.8)^2 / pi of it; half a row of nodes on each side
  // falls to one neighbour or the other.
  const double exact = 4 / (1.8 * 1.8 * std::numbers::pi), rows = 8;  // nodes across a square
  for (int j = 1; j < 7; ++j)
    for (int i = 1; i < 7; ++i)
      EXPECT_NEAR(visible.owned[static_cast<std::size_t>(8 * j + i)], exact, exact * 2 / rows);
}

TEST_P(Visibility, OwnedSharesCountTheOwnersNodes) {
  const View view = lattice_view();
  for (const unsigned seed : {11u, 12u}) {
    Projected p = lattice(view, 20, 0);
    Random random(seed);
    for (std::size_t i = 0; i < p.size(); ++i) {
      p.u[i] += static_cast<float>(random(-9, 9));
      p.z[i] -= static_cast<float>(random(0, 6));
    }
    // The grid of a median radius of 8 pixels: cells of 2.
    const SampleGrid grid = node_grid(view, 2);
    const auto owner =
        download(device_, splat_owner(device_, upload_splats(device_, p, all_of(p)), grid, 1.8));
    for (const int width : {1, 8}) {
      use_width(width);
      const Visible visible = find_visible(device_, view, p, all_of(p), {}, 0);
      std::size_t next = 0;
      for (std::int32_t i = 0; i < 64; ++i) {
        const auto nodes = std::count(owner.begin(), owner.end(), i);
        if (nodes == 0) continue;
        ASSERT_LT(next, visible.index.size());
        EXPECT_EQ(visible.index[next], i);
        const double footprint = std::numbers::pi * 1.8 * 1.8 * 8 * 8 / (2 * 2);
        EXPECT_EQ(visible.owned[next++],
                  static_cast<float>(static_cast<double>(nodes) / footprint));
      }
      EXPECT_EQ(next, visible.index.size());
    }
  }
}

TEST_P(Visibility, WhatIsNotACandidateHidesNothing) {
  const View view = lattice_view();
  Projected p = lattice(view, 20, 0);
  p = lattice(view, 22, 0, p);
  std::vector<std::int32_t> back(64);
  std::iota(back.begin(), back.end(), 64);
  EXPECT_EQ(find_visible(device_, view, p, back, {}, 0.04).index, back);
  EXPECT_TRUE(find_visible(device_, view, p, {}, {}, 0.04).index.empty());
}

TEST_P(Visibility, OfEqualParticlesOnlyTheFirstIsVisible) {
  const View view = lattice_view();
  Projected p = lattice(view, 20, 0);
  p = lattice(view, 20, 0, p);
  const Visible visible = find_visible(device_, view, p, all_of(p), {}, 0.04);
  ASSERT_EQ(visible.index.size(), 64u);
  EXPECT_EQ(visible.index.back(), 63);
}

MENISCUS_ON_EVERY_DEVICE(Visibility);

}  // namespace
}  // namespace meniscus
