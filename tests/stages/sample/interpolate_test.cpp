// Interpolation on surfaces whose answer is exact, on every device and in every width.
#include "stages/sample/interpolate.hpp"

#include <cmath>
#include <functional>
#include <set>

#include "stages/stage_test_support.hpp"
#include "verify/stage_cases/into_new.hpp"

namespace meniscus {
namespace {

using Interpolate = OnDevice;

constexpr int kWidth = 121, kHeight = 93;
constexpr double kTolerance = 0.08;
constexpr double kNarrow = 1.49;  // pixels: a particle that may hide between samples two apart

struct Hit {
  double depth;  // infinity: none
  Vec3d normal;
};

// What a ray meets: eye position at depth 0 and direction.
using Scene = std::function<Hit(const Vec3d& from, const Vec3d& direction)>;

Hit meet_sphere(const Vec3d& centre, double radius, const Vec3d& from, const Vec3d& d) {
  const Vec3d o = from - centre;
  const double a = dot(d, d), b = dot(o, d), c = dot(o, o) - radius * radius;
  const double root = b * b - a * c;
  if (root < 0) return {INFINITY, {}};
  const double t = (-b - std::sqrt(root)) / a;
  return {t, (o + d * t) / radius};
}

Hit meet_plane(const Vec3d& through, const Vec3d& normal, const Vec3d& from, const Vec3d& d) {
  return {dot(normal, through - from) / dot(normal, d), normal};
}

struct Result {
  SurfaceMap lattice, map;
  std::set<int> wanted;
};

// Interpolates a scene that is given at every second of the `every`th samples, with the same bits
// in every width.
Result interpolated(Device& device, const View& view, const SampleGrid& grid, const Scene& scene,
                    const std::vector<Kind>& kinds, double least_radius, int every) {
  const std::size_t n = grid.size();
  std::vector<float> depth(n, kNoSurface), normal(3 * n, 0.0f);
  std::vector<cl_int> group(n, -1);
  std::vector<cl_uchar> kind(n, static_cast<cl_uchar>(Kind::surface));
  for (int j = 0; j < grid.ny; j += 2 * every)
    for (int i = 0; i < grid.nx; i += 2 * every) {
      const std::size_t s = static_cast<std::size_t>(j) * grid.nx + i;
      const double u = grid.first + grid.step * i, v = grid.first + grid.step * j;
      const Hit hit = scene(point_at(view, u, v, 0), ray_direction(view, u, v));
      if (!kinds.empty()) kind[s] = static_cast<cl_uchar>(kinds[s]);
      if (!(hit.depth < INFINITY)) continue;
      depth[s] = static_cast<float>(hit.depth);
      normal[s] = static_cast<float>(hit.normal.x);
      normal[n + s] = static_cast<float>(hit.normal.y);
      normal[2 * n + s] = static_cast<float>(hit.normal.z);
      group[s] = static_cast<cl_int>(s);
    }
  Result results[2];
  for (Result& result : results) {
    device.state().vector_width = &result == results ? 1 : 8;
    const SurfaceBuffers surface{grid,
                                 upload(device, depth),
                                 upload(device, normal),
                                 upload(device, group),
                                 filled<float>(device, n, 0.0f),
                                 upload(device, kind)};
    result.lattice = download(device, surface);
    const auto anywhere = filled<float>(device, n, 1.0f);
    const auto nowhere = filled<float>(device, n, kNoSurface);
    const LayerSamples lists = interpolate_samples(
        device, view, {anywhere, anywhere, any_blocks(device, grid), any_blocks(device, grid)},
        nowhere, surface, kTolerance, least_radius, blocks_of(device, grid, false), every);
    result.map = download(device, surface);
    result.wanted = samples_of(device, lists.surface);
    EXPECT_EQ(samples_of(device, lists.splash), result.wanted);
  }
  EXPECT_EQ(results[0].map.depth, results[1].map.depth);
  EXPECT_EQ(results[0].map.normal, results[1].map.normal);
  EXPECT_EQ(results[0].map.group, results[1].map.group);
  EXPECT_EQ(results[0].map.kind, results[1].map.kind);
  EXPECT_EQ(results[0].wanted, results[1].wanted);
  return results[0];
}

Result interpolated(Device& device, const View& view, const Scene& scene,
                    const std::vector<Kind>& kinds, double least_radius) {
  return interpolated(device, view, pixel_grid(view), scene, kinds, least_radius, 1);
}

bool on_lattice(int s) { return s % kWidth % 2 == 0 && s / kWidth % 2 == 0; }

// Every sample is one of the lattice, was interpolated, or is to be evaluated.
std::size_t expect_complete(const Result& result) {
  std::size_t written = 0;
  for (int s = 0; s < kWidth * kHeight; ++s) {
    const bool shown = result.map.depth[s]<kNoSurface, wanted = result.wanted.count(s)> 0;
    if (on_lattice(s)) {
      EXPECT_FALSE(wanted);
      EXPECT_EQ(result.map.depth[s], result.lattice.depth[s]);
      continue;
    }
    EXPECT_NE(shown, wanted) << s % kWidth << " " << s / kWidth;
    written += shown;
  }
  return written;
}

View view_of() { return make_view(perspective_camera(kWidth, kHeight), 0.5, {0, 0, 0}); }

TEST_P(Interpolate, FollowsASphere) {
  for (const bool orthographic : {false, true}) {
    const View view =
        orthographic ? make_view(orthographic_camera(kWidth, kHeight), 0.5, {0, 0, 0}) : view_of();
    const double radius = 5;
    const Vec3d centre = point_at(view, 0.5 * kWidth, 0.5 * kHeight, 19);
    const auto scene = [&](const Vec3d& from, const Vec3d& d) {
      return meet_sphere(centre, radius, from, d);
    };
    const Result result = interpolated(device_, view, scene, {}, kNarrow);
    EXPECT_GT(expect_complete(result), 1000u);
    for (int s = 0; s < kWidth * kHeight; ++s) {
      const double t = result.map.depth[s];
      if (on_lattice(s) || !(t < kNoSurface)) continue;
      const Vec3d x = point_at(view, s % kWidth + 0.5, s / kWidth + 0.5, t);
      // Depth over the screen is f; of corners h to both sides the chord misses the middle by
      // f'' h^2/2 + f h^4/24, the touching planes by -f h^2/2 - f h^4/8, their mean by
      // -f h^4/24. Seen at an angle a, a circle of radius R has f = 3 (1 + 4 sin^2 a) /
      // (R^3 cos^7 a), and the tolerance bounds h: 2 h^2 < tolerance R cos^2 a. Two directions add
      // up; the error along the normal is cos a times that of the depth. A quotient that the slant
      // makes ten times as large carries some ten roundings of the depth.
      const Vec3d d = ray_direction(view, s % kWidth + 0.5, s / kWidth + 0.5);
      const double cosine = dot((centre - x) / radius, normalized(d));
      const double fourth = 3 * (5 - 4 * cosine * cosine) / (24 * radius * cosine * cosine);
      const double bound = 2 * std::pow(kTolerance / 2, 2) * fourth + 100 * kEpsilon * t;
      EXPECT_NEAR(length(x - centre), radius, bound) << s % kWidth << " " << s / kWidth;
      // The mean of normals at most 21 degrees apart errs along the surface as the middle of the
      // corners does: by the same order over the radius, less than 0.01.
      EXPECT_LT(length(Vec3d(result.map.normal[s]) - (x - centre) / radius), 0.01);
      EXPECT_EQ(result.map.kind[s], Kind::surface);
      constexpr int kOfCorner = records::OF_CORNER;
      const int corner = result.map.group[s] - kOfCorner;
      EXPECT_TRUE(on_lattice(corner));
      EXPECT_LE(std::abs(corner % kWidth - s % kWidth), 1);
      EXPECT_LE(std::abs(corner / kWidth - s / kWidth), 1);
    }
  }
}

TEST_P(Interpolate, OfEverySecondSampleHasTheBitsOfACoarserGrid) {
  const View view = view_of();
  const Vec3d centre = point_at(view, 0.5 * kWidth, 0.5 * kHeight, 19);
  const auto scene = [&](const Vec3d& from, const Vec3d& d) {
    return meet_sphere(centre, 5, from, d);
  };
  const SampleGrid fine = pixel_grid(view);
  const SampleGrid coarse{(kWidth + 1) / 2, (kHeight + 1) / 2, fine.first, 2 * fine.step};
  const Result of_fine = interpolated(device_, view, fine, scene, {}, 9, 2);
  const Result of_coarse = interpolated(device_, view, coarse, scene, {}, 9, 1);
  int shown = 0;
  std::set<int> wanted;
  for (int s = 0; s < static_cast<int>(fine.size()); ++s) {
    const int i = s % kWidth, j = s / kWidth, c = j / 2 * coarse.nx + i / 2;
    if (i % 2 || j % 2) {
      EXPECT_EQ(of_fine.map.depth[s], kNoSurface);
      continue;
    }
    EXPECT_EQ(of_fine.map.depth[s], of_coarse.map.depth[c]);
    EXPECT_EQ(of_fine.map.normal[s], of_coarse.map.normal[c]);
    shown += of_fine.map.depth[s] < kNoSurface;
    if (of_coarse.wanted.count(c)) wanted.insert(s);
  }
  EXPECT_GT(shown, 250);
  EXPECT_EQ(of_fine.wanted, wanted);
}

TEST_P(Interpolate, LeavesCreasesAndStepsToBeEvaluated) {
  const View view = view_of();
  const Vec3d ridge = point_at(view, 60.3, 46.1, 15);
  for (const double rise : {0.0, 2.0}) {  // a roof, and planes one behind the other
    const Vec3d left = normalized(Vec3d{rise > 0 ? 0.0 : -0.7, 0, 1}),
                right = normalized(Vec3d{rise > 0 ? 0.0 : 0.7, 0, 1});
    const auto scene = [&](const Vec3d& from, const Vec3d& d) {
      const Hit l = meet_plane(ridge, left, from, d),
                r = meet_plane(ridge - Vec3d{0, 0, rise}, right, from, d);
      const bool is_left = rise > 0 ? (from + d * l.depth).x < ridge.x : l.depth > r.depth;
      return is_left ? l : r;
    };
    const auto side = [&](int s) {
      const Vec3d x = point_at(view, s % kWidth + 0.5, s / kWidth + 0.5, 0);
      const Vec3d d = ray_direction(view, s % kWidth + 0.5, s / kWidth + 0.5);
      const Hit hit = scene(x, d);
      return dot(hit.normal, x + d * hit.depth - ridge) > -1e-6 && hit.normal == left;
    };
    const Result result = interpolated(device_, view, scene, {}, kNarrow);
    EXPECT_GT(expect_complete(result), 4000u);
    std::size_t across = 0;
    for (int j = 1; j + 1 < kHeight; ++j)
      for (int i = 1; i + 1 < kWidth; ++i) {
        const int s = j * kWidth + i;
        if (i % 2 == 0 || side(s - 1 - (j % 2) * kWidth) == side(s + 1 + (j % 2) * kWidth))
          continue;
        ++across;
        EXPECT_TRUE(result.wanted.count(s)) << i << " " << j;
      }
    EXPECT_GT(across, 40u);
  }
}

TEST_P(Interpolate, DoesNotMixSurfaceAndSplash) {
  const View view = view_of();
  std::vector<Kind> kinds(kWidth * kHeight, Kind::surface);
  for (int s = 0; s < kWidth * kHeight; ++s)
    if (s % kWidth >= 60) kinds[s] = Kind::splash;
  const Vec3d through = point_at(view, 60, 46, 15);
  const auto scene = [&](const Vec3d& from, const Vec3d& d) {
    return meet_plane(through, {0, 0, 1}, from, d);
  };
  const Result result = interpolated(device_, view, scene, kinds, kNarrow);
  expect_complete(result);
  for (int s = 0; s < kWidth * kHeight; ++s) {
    if (s % kWidth == 59) {
      EXPECT_TRUE(result.wanted.count(s));
    }
    if (!on_lattice(s) && result.map.depth[s] < kNoSurface) {
      EXPECT_EQ(result.map.kind[s], kinds[s]);
    }
  }
}

TEST_P(Interpolate, TrustsEmptyCellsWhereNothingFitsBetween) {
  const View view = view_of();
  const auto nothing = [](const Vec3d&, const Vec3d&) { return Hit{INFINITY, {}}; };
  EXPECT_EQ(interpolated(device_, view, nothing, {}, kNarrow).wanted.size(),
            static_cast<std::size_t>(kWidth * kHeight - (kWidth / 2 + 1) * (kHeight / 2 + 1)));
  // The last row and column end their cells outside the image.
  const Result result = interpolated(device_, view, nothing, {}, 1.5);
  for (const int s : result.wanted)
    EXPECT_TRUE(s % kWidth >= kWidth - 2 || s / kWidth >= kHeight - 2) << s;
}

TEST_P(Interpolate, LooksWhereFrontsOrSplashAreExpected) {
  const View view = view_of();
  const SampleGrid grid = pixel_grid(view);
  SurfaceMap plane;
  plane.grid = grid;
  for (std::size_t s = 0; s < grid.size(); ++s) {
    const int i = static_cast<int>(s) % kWidth, j = static_cast<int>(s) / kWidth;
    const bool there = i % 2 == 0 && j % 2 == 0;
    plane.depth.push_back(there ? 15.0f : kNoSurface);
    plane.normal.push_back({0, 0, 1});
    plane.group.push_back(there ? static_cast<int>(s) : -1);
    plane.kind.push_back(Kind::splash);
  }
  const auto nowhere = filled<float>(device_, grid.size(), kNoSurface);
  for (const int width : {1, 8})
    for (const bool front : {false, true})
      for (const bool splash : {false, true}) {
        device_.state().vector_width = width;
        const SurfaceBuffers surface = upload(device_, plane);
        const auto blocks = [&](bool any) {
          return any ? any_blocks(device_, grid) : no_blocks(device_, grid);
        };
        interpolate_samples(device_, view, {nowhere, nowhere, blocks(front), blocks(splash)},
                            nowhere, surface, kTolerance, 1.5, blocks_of(device_, grid, false), 1);
        const SurfaceMap map = download(device_, surface);
        for (std::size_t s = 0; s < grid.size(); ++s) {
          const int i = static_cast<int>(s) % kWidth, j = static_cast<int>(s) / kWidth;
          if (i == kWidth - 1 || j == kHeight - 1) continue;
          EXPECT_EQ(map.depth[s] < kNoSurface, front || splash || (i % 2 == 0 && j % 2 == 0)) << s;
        }
      }
}

TEST_P(Interpolate, LeavesOpenWhatLiesBetweenOpenSamples) {
  const View view = view_of();
  const SampleGrid grid = pixel_grid(view);
  // The front layer is expected left of column 79, and was not found; splash, everywhere.
  std::vector<float> reference(grid.size(), kNoSurface), open(grid.size(), kNoSurface);
  for (int s = 0; s < kWidth * kHeight; ++s)
    if (s % kWidth < 79) {
      reference[s] = static_cast<float>(7 + s % 5);
      if (on_lattice(s)) open[s] = reference[s];
    }
  // What a block holds where none is expected is not read.
  std::vector<float> written = reference;
  std::vector<cl_int> occupied((kWidth + 15) / 16 * 2 * ((kHeight + 15) / 16 * 2));
  for (int s = 0; s < kWidth * kHeight; ++s) {
    occupied[static_cast<std::size_t>(s / kWidth / 8 * ((kWidth + 15) / 16 * 2) +
                                      s % kWidth / 8)] += reference[s] < kNoSurface;
    if (s % kWidth >= 80) written[s] = 1;
  }
  for (const int width : {1, 8}) {
    device_.state().vector_width = width;
    const auto opened = upload(device_, open);
    const LayerSamples lists = interpolate_samples(
        device_, view,
        {upload(device_, written), filled<float>(device_, grid.size(), 5.0f),
         upload(device_, occupied), any_blocks(device_, grid)},
        opened, empty_surface(device_, grid), kTolerance, 1.5, blocks_of(device_, grid, false));
    const std::vector<float> found = download(device_, opened);
    const std::set<int> surface = samples_of(device_, lists.surface),
                        splash = samples_of(device_, lists.splash);
    for (int s = 0; s < kWidth * kHeight; ++s) {
      const int i = s % kWidth;
      if (on_lattice(s) || i >= kWidth - 2 || s / kWidth >= kHeight - 2) continue;
      EXPECT_EQ(found[s], reference[s]) << s;
      // Samples of an open cell that expect no front layer may be splash.
      EXPECT_EQ(splash.count(s) == 1, i == 79 || i == 80) << i;
      EXPECT_EQ(surface.count(s), 0u) << i;
    }
  }
}

MENISCUS_ON_EVERY_DEVICE(Interpolate);

}  // namespace
}  // namespace meniscus
