// minima: discs, spheres and triangles drawn one by one, by atomic minima of the samples' depths
// (paper 2.1). The other way than bin by bin (bins.hpp), with the same bits: DiscForm says which
// one a device takes.
#pragma once

#include "device/kernels.hpp"
#include "stages/frame/bins.hpp"
#include "stages/frame/visible.hpp"

namespace meniscus {

/// Whether the device draws so.
inline bool draws_by_minima(Device& device) { return device.state().discs == DiscForm::minima; }

/// The bound of bins in which nothing is left out.
inline Buffer<float> no_bound(Device& device, const SampleGrid& grid) {
  return constant(device, bins_of(grid).size(), kNoSurface);
}

/// A kernel's range where every one of `count` discs is drawn by items of its own.
inline Range disc_items(int count, int width) {
  const std::size_t shares = width == 1 ? records::DISC_SHARES : 1;
  return {static_cast<std::size_t>(count) * shares};
}

/// Launches a kernel of minima.cl that draws the discs of `outlines`.
///
///   records  of the discs, spheres or triangles
///   bound    [bins] those with a greater key are left out of a bin
///   maps     what the kernel reads and lowers
///   samples  a lattice of the grid, or a screen
///   more     its arguments after them
template <class... Maps, class... More>
void draw_minima(Device& device, const auto& kernel, const Buffer<float>& records,
                 const Outlines& outlines, const Buffer<float>& bound, const SampleGrid& grid,
                 const std::tuple<Maps&...>& maps, const auto& samples, const More&... more) {
  const int width = device.state().vector_width;
  std::apply(
      [&](Maps&... all) {
        launch(device, kernel, width, disc_items(outlines.count, width), records, outlines, bound,
               all..., outlined_on(grid, outlines), samples, more...);
      },
      maps);
}

/// Particles as kernels take them that work out by themselves what these may cover.
inline records::DrawnSpheres drawn_spheres(const SampleGrid& grid, const SplatParticles& particles,
                                           cl_float2 sphere, Drawn drawn) {
  return {particles.count, particles.stride, bins_of(grid).nx, static_cast<int>(drawn),
          sphere.s[0],     sphere.s[1],      1.0f / grid.step};
}

/// Launches such a kernel.
///
///   sphere  footprint, particle radii, and bulge over footprint
template <class... Maps, class... More>
void draw_minima(Device& device, const auto& kernel, const SplatParticles& particles,
                 cl_float2 sphere, Drawn drawn, const Buffer<float>& bound, const SampleGrid& grid,
                 const std::tuple<Maps&...>& maps, const More&... more) {
  const int width = device.state().vector_width;
  const records::DrawnSpheres all = drawn_spheres(grid, particles, sphere, drawn);
  std::apply(
      [&](Maps&... drawn_into) {
        launch(device, kernel, width, disc_items(particles.count, width), particles.values, bound,
               drawn_into..., all, lattice_of(grid), more...);
      },
      maps);
}

}  // namespace meniscus
