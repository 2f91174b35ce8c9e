// compare_corners and interpolate_samples: rough water on a lattice, with holes, splash, creases
// and samples that are open.
#include "stages/sample/interpolate.hpp"

#include <set>

#include "verify/reference/interpolate.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/inputs.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {
namespace {

// Waves of all slopes, creased, in patches; holes and splash; at the lattice's samples alone.
reference::Lattice rough_water(const View& view, const SampleGrid& grid, int every) {
  reference::Lattice lattice;
  lattice.grid = grid;
  lattice.every = every;
  Random random(static_cast<unsigned>(grid.nx + every));
  const auto depth_at = [&](double i, double j) {
    const double wave = 1.2 * std::sin(0.13 * i + 0.04 * j) + 0.8 * std::cos(0.1 * j);
    return 20 + wave + (i > 40 ? 0.12 * (i - 40) : 0) + (std::sin(0.09 * i * j) > 0.97 ? 4 : 0);
  };
  const auto point = [&](double i, double j) {
    return point_at(view, grid.first + grid.step * i, grid.first + grid.step * j, depth_at(i, j));
  };
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const bool own = i % (2 * every) == 0 && j % (2 * every) == 0;
      const bool hole = std::sin(0.21 * i) + std::cos(0.17 * j) < -1.1 || random(0, 1) < 0.04;
      const double rough = random(0, 1) < 0.1 ? 0.3 : 0.02;
      const Vec3d across = point(i + 0.5, j) - point(i - 0.5, j),
                  along = point(i, j - 0.5) - point(i, j + 0.5);
      const Vec3d normal = normalized(normalized(cross(across, along)) +
                                      Vec3d{random(-rough, rough), random(-rough, rough), 0});
      const bool shown = own && !hole;
      const auto depth = static_cast<float>(depth_at(i, j) + random(-0.01, 0.01));
      lattice.depth.push_back(shown ? depth : kNoSurface);
      lattice.normal.push_back(shown ? static_cast<Vec3>(normal) : Vec3{});
      lattice.kind.push_back(random(0, 1) < 0.03 ? Kind::splash : Kind::surface);
      lattice.open.push_back(own && hole && i % 3 == 0 ? depth : kNoSurface);
      lattice.reference.push_back(random(0, 1) < 0.15 ? kNoSurface : depth);
      lattice.splash.push_back(random(0, 1) < 0.8 ? kNoSurface : depth);
    }
  return lattice;
}

// In how many samples of each block of 8 x 8 a map is finite.
OccupiedBlocks counted(Device& device, const SampleGrid& grid, const std::vector<float>& map) {
  const int across = (grid.nx + kTile - 1) / kTile * 2, down = (grid.ny + kTile - 1) / kTile * 2;
  std::vector<cl_int> blocks(static_cast<std::size_t>(across) * static_cast<std::size_t>(down));
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i)
      blocks[j / 8 * across + i / 8] += map[j * grid.nx + i] < kNoSurface;
  return upload(device, blocks);
}

struct Seen {
  Worst depth{"interpolate_samples", "depth"}, normal{"interpolate_samples", "normal"},
      group{"interpolate_samples", "group"}, kind{"interpolate_samples", "kind"},
      open{"interpolate_samples", "open"}, wanted{"interpolate_samples", "samples to evaluate"};
};

// `tolerance`: of corners to planes, particle radii.
void run(Device& device, const View& view, const SampleGrid& grid, int every, bool trust_empty,
         double tolerance, Seen* seen) {
  constexpr cl_int kOfCorner = records::OF_CORNER;
  const reference::Lattice lattice = rough_water(view, grid, every);
  SurfaceMap map{
      grid, lattice.depth, lattice.normal, std::vector<cl_int>(grid.size(), -1), lattice.kind, {}};
  for (std::size_t s = 0; s < grid.size(); ++s)
    if (map.depth[s] < kNoSurface) map.group[s] = static_cast<cl_int>(s);
  const SurfaceBuffers surface = upload(device, map);
  // docs/method.md: four samples at most 4/3 radii apart that show nothing have nothing between
  // them; normals turn by 35 degrees, by 41 in cells up to 2/3; depths differ by up to .8 of the
  // tolerance over the cell's side in radii, twice the tolerance at most.
  const double radius = 2 * every * grid.step / (trust_empty ? 1.3 : 0.6 + every);
  const double side = 2 * every * grid.step / radius;
  reference::InterpolateParams params;
  params.tolerance = tolerance;
  params.agreeing = side <= 2.0 / 3 ? 0.75 : 0.82;
  params.spread = std::min(0.8 / side, 2.0) * tolerance;
  params.trust_empty = side <= 4.0 / 3;
  const Buffer<float> open = upload(device, lattice.open);
  const LayerSamples lists = interpolate_samples(
      device, view,
      {upload(device, lattice.reference), upload(device, lattice.splash),
       counted(device, grid, lattice.reference), counted(device, grid, lattice.splash)},
      open, surface, tolerance, radius, blocks_of(device, grid, false), every);
  const SurfaceMap found = download(device, surface);
  const std::vector<float> opened = download(device, open);
  const std::set<int> wanted = samples_of(device, lists.surface),
                      splash = samples_of(device, lists.splash);
  const reference::Interpolation expected(view, lattice, params);
  const int nx = grid.nx;
  for (int j = 0; j < grid.ny; j += every)
    for (int i = 0; i < nx; i += every) {
      if (i % (2 * every) == 0 && j % (2 * every) == 0) continue;
      const int s = j * nx + i;
      const reference::BetweenSample e = expected.at(i, j);
      if (!e.sure) continue;
      seen->depth.see(found.depth[s], e.shown ? e.depth : kNoSurface, e.error);
      seen->wanted.see(wanted.count(s) > 0, e.wanted, 0);
      seen->wanted.see(splash.count(s) > 0, e.wants_splash, 0);
      seen->open.see(opened[s], e.opened ? lattice.reference[s] : kNoSurface, 0);
      if (!e.shown || !(found.depth[s] < kNoSurface)) continue;
      seen->normal.see(length(Vec3d(found.normal[s]) - e.normal), 0, 16 * kEpsilon, 1);
      seen->group.see(found.group[s] & ~kOfCorner, e.corner, 0);
      seen->kind.see(static_cast<int>(found.kind[s]), static_cast<int>(lattice.kind[e.corner]), 0);
    }
}

}  // namespace

ReferenceErrors interpolate_case(Device& device, int size) {
  Seen seen;
  for (const bool orthographic : {false, true}) {
    const int height = (2 * size + 2) / 3;
    const Camera camera =
        orthographic ? orthographic_camera(size, height) : perspective_camera(size, height);
    const View view = make_view(camera, 0.5, {0, 0, 0});
    for (const int every : {1, 2, 4})
      for (const bool trust_empty : {false, true}) {
        // The default, and one with which the normals decide and not the planes.
        run(device, view, pixel_grid(view), every, trust_empty, 0.16, &seen);
        run(device, view, pixel_grid(view), every, trust_empty, 0.8, &seen);
      }
  }
  return {seen.depth.error(), seen.normal.error(), seen.group.error(),
          seen.kind.error(),  seen.open.error(),   seen.wanted.error()};
}

}  // namespace meniscus::verify
