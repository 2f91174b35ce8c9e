#include "stages/sample/sampler.hpp"

#include <utility>

#include "device/together.hpp"
#include "stages/frame/minima.hpp"
#include "stages/sample/behind.hpp"
#include "stages/sample/fairing.hpp"
#include "stages/sample/interpolate.hpp"
#include "stages/sample/settle.hpp"
#include "stages/sample/specks.hpp"

namespace meniscus {
namespace {

// Samples look behind the front layer twice: a look may find particles whose surface the ray passes
// by. In close-ups, where the radii of seen particles span so many samples in the mean, a third
// look is needed: what two have missed is too large for close_specks() there.
constexpr double kCloseUp = 6;
constexpr double kLayerGap = 3;  // particle radii between two layers
// The levelled field lies one radius outside the particles, a little more between two.
constexpr float kBehindFootprint = 1.4f;  // particle radii

// A grid's samples while they are made.
struct Canvas {
  const Sampler& of;
  const SampleGrid& grid;
  const Backdrop& on;  // its `open`: of samples that show nothing so far, the last reference depth
  StageClock& clock;
  SurfaceBuffers surface;
  FitTiles tiles;
};

SettlingField field_of(const Sampler& s) {
  return {s.cells, s.levelled, s.params.region, s.params.disorder};
}

// A layer at listed samples: the blended fits, or the field where they are not trusted.
void show_layer(const Canvas& canvas, const SampleLists& lists, const Buffer<float>& reference) {
  const Sampler& s = canvas.of;
  canvas.clock.start("blend");
  blend_groups(s.device, s.view, lists, s.fits, canvas.tiles, reference, canvas.surface,
               s.params.blend);
  canvas.clock.start("settle");
  settle_samples(s.device, s.view, lists, field_of(s), canvas.on.triangles, reference,
                 canvas.surface, canvas.on.open, false);
}

void show_front(const Canvas& canvas, const LayerSamples& wanted) {
  show_layer(canvas, wanted.surface, canvas.on.fronts.depth);
  const Sampler& s = canvas.of;
  canvas.clock.start("splash");
  draw_splash(s.device, s.view, wanted.splash, s.levelled, canvas.on.splash, canvas.surface,
              s.params.region, &canvas.on.open);
}

// Samples between which others are interpolated: at most 4/3 particle radii apart, or two samples.
int coarsest_lattice(const Sampler& sampler, const SampleGrid& grid) {
  int every = sampler.params.region.interpolation > 0 ? 2 : 1;
  while (every > 1 && every < kTile && 2 * every * grid.step <= kWidestCell * sampler.least_radius)
    every *= 2;
  return every;
}

// The front layer: a coarse lattice, then what lies between its samples and does not follow from
// them.
void sample_front(const Canvas& canvas, int coarsest, const ListedBlocks& listed) {
  const Sampler& s = canvas.of;
  const auto& [front, occupied] = canvas.on.fronts;
  const Extent& splash = canvas.on.splash;
  const FrontMaps maps{front, splash.from, occupied, splash.occupied};
  show_front(canvas, list_fronts(s.device, canvas.grid, maps, coarsest));
  for (int every = coarsest / 2; every > 0; every /= 2) {
    canvas.clock.start("interpolate");
    show_front(canvas,
               interpolate_samples(s.device, s.view, maps, canvas.on.open, canvas.surface,
                                   s.params.region.interpolation, s.least_radius, listed, every));
  }
}

// What lies behind the front layer, at all samples together: few are open.
void sample_behind(const Canvas& canvas, const ListedBlocks& listed) {
  const Sampler& s = canvas.of;
  const Buffer<float>&depth = canvas.surface.depth, &open = canvas.on.open;
  canvas.clock.start("behind");
  const GapLists found =
      list_gaps(s.device, canvas.grid, open, canvas.on.fronts.occupied, listed, kLayerGap);
  const DiscsBehind discs = list_discs(s.device, s.body, {{kBehindFootprint, 1.0f}}, found);
  SampleLists lists = found.lists;
  for (std::size_t layer = 0; layer < canvas.on.behind.size(); ++layer) {
    canvas.clock.start("behind");
    // By minima all open samples are asked for, which alone can have a reference.
    if (draws_by_minima(s.device))
      lists = layer == 0 ? found.lists : found.again;
    else if (layer > 0)
      lists = keep_samples(s.device, lists, open, depth);
    const Buffer<float>& reference = canvas.on.behind[layer];
    splat_behind(s.device, discs, lists, open, kLayerGap, reference);
    if (vectors_are_filled(s.device)) lists = keep_samples(s.device, lists, reference, depth);
    show_layer(canvas, lists, reference);
  }
  canvas.clock.start("settle");
  settle_gaps(s.device, s.view, found.lists, field_of(s), canvas.on.triangles,
              canvas.on.fronts.depth, canvas.on.splash, canvas.surface, open);
}

}  // namespace

Backdrop draw_backdrop(Device& device, const View& view, const SplatParticles& seen,
                       const KeptTriangles& triangles, const SplatParticles& splash,
                       const SampleGrid& grid, const Parameters& params) {
  const std::size_t n = grid.size(), blocks = blocks_in(grid);
  const bool by_minima = draws_by_minima(device);
  const bool close_up = seen.pixels >= kCloseUp * static_cast<double>(grid.step);
  // What becomes the surface lies between what begins as kNoSurface and as 0, and outside of these
  // what only minima need filled.
  using Maps = Together<float, float, float, float, float, float, float, float, float, cl_uchar,
                        cl_int, cl_int, cl_uchar, float>;
  const std::size_t seconds = by_minima ? n : 0, thirds = by_minima && close_up ? n : 0;
  const Maps maps(device, {n, n, n, n, seconds, thirds, n, n, 3 * n, n, blocks, blocks, blocks, n});
  if (by_minima) {
    maps.fill_some<0, 7>(device, kNoSurface);
    maps.fill_some<9, 13>(device, 0);
  } else {
    maps.fill_some<6, 7>(device, kNoSurface);
    maps.fill_some<9, 12>(device, 0);
  }
  const auto& [front, kept, from, first, second, third, open, depth, normal, kind, occupied,
               of_splash, listed, to] = maps.parts;
  std::vector<Buffer<float>> behind{first, by_minima ? second : first};
  if (close_up) behind.push_back(by_minima ? third : first);
  const Backdrop on{{front, occupied},
                    kept,
                    {from, to, of_splash},
                    listed,
                    open,
                    std::move(behind),
                    surface_of(device, grid, maps.some<7, float, float, cl_uchar>(device))};
  const double footprint = params.region.reference, bulge = params.fit.offset / footprint;
  draw_fronts(device, grid, seen, footprint, bulge, on.fronts, splash, on.splash);
  draw_triangles(device, view, triangles, grid, on.fronts.occupied, on.triangles);
  return on;
}

SurfaceBuffers sample_grid(const Sampler& sampler, const SampleGrid& grid, const Backdrop& backdrop,
                           bool groups, StageClock& clock) {
  Device& device = sampler.device;
  const View& view = sampler.view;
  clock.start("region");
  const FitTiles tiles = list_fits(device, view, sampler.records, grid);
  Canvas canvas{sampler, grid, backdrop, clock, backdrop.surface, tiles};

  const int coarsest = coarsest_lattice(sampler, grid);
  const ListedBlocks listed = coarsest == 1 ? blocks_of(device, grid, true) : backdrop.listed;
  sample_front(canvas, coarsest, listed);
  sample_behind(canvas, listed);
  clock.start("specks");
  close_specks(device, canvas.surface, listed, large_particles_until(view, grid));
  if (sampler.params.fairing > 0) {
    clock.start("fairing");
    fair_normals(device, view, canvas.surface, sampler.params.fairing);
  }
  clock.start("blend");
  if (!groups)
    canvas.surface.group = {};
  else if (coarsest > 1)
    canvas.surface.group =
        choose_groups(device, view, canvas.surface, sampler.fits, coarsest, sampler.params.blend);
  return std::move(canvas.surface);
}

std::vector<SurfaceSample> sample_points(const Sampler& sampler, const SampleGrid& grid,
                                         const FitTiles& tiles, const std::vector<float>& points,
                                         const std::vector<float>& near,
                                         const std::vector<float>& near_fits) {
  Device& device = sampler.device;
  const Buffer<float> at = upload(device, points);
  const SurfaceBuffers samples =
      empty_surface(device, {static_cast<int>(near.size()), 1, 0.0f, 1.0f});
  blend_points(device, sampler.view, sampler.fits, tiles, grid, at, upload(device, near_fits),
               samples, sampler.params.blend);
  settle_points(device, sampler.view, field_of(sampler), at, upload(device, near), samples);
  const SurfaceMap map = download(device, samples);
  std::vector<SurfaceSample> found;
  for (std::size_t e = 0; e < near.size(); ++e) found.push_back({map.depth[e], map.normal[e]});
  return found;
}

}  // namespace meniscus
