#include "stages/sample/blend.hpp"

#include "device/kernels.hpp"

namespace meniscus {
namespace {

// How intersections are blended, as kernels take it.
records::Blending blending_of(const BlendParams& params) {
  return {static_cast<float>(params.d_max), static_cast<float>(params.same_low),
          static_cast<float>(params.same_high), static_cast<float>(params.crease)};
}

// The lists of FITS_OF_TILES.
struct FitsOfTiles {
  const Buffer<cl_int>&met_start, &met;
  const Buffer<float>& met_place;
  const Buffer<cl_int>&rim_start, &rim;
  const Buffer<float>& rim_place;
  cl_int2 strides;  // values in a row of the lists' places
};

FitsOfTiles lists_of(const FitTiles& tiles) {
  const auto &met = tiles.met, &rim = tiles.rim;
  return {met.start,
          met.fit,
          met.place,
          rim.start,
          rim.fit,
          rim.place,
          {{static_cast<cl_int>(met.fit.size), static_cast<cl_int>(rim.fit.size)}}};
}

}  // namespace

void blend_groups(Device& device, const View& view, const SampleLists& lists,
                  const DeviceRecords& records, const FitTiles& tiles,
                  const Buffer<float>& reference, const SurfaceBuffers& surface,
                  const BlendParams& params) {
  const int width = device.state().wide_width();
  launch(device, kernels::blend_groups, width, range_of(lists, width), lists, reference, records,
         lists_of(tiles), surface, screen_of(view, surface.grid), blending_of(params));
}

Buffer<cl_int> choose_groups(Device& device, const View& view, const SurfaceBuffers& surface,
                             const DeviceRecords& records, int every, const BlendParams& params) {
  const SampleGrid& grid = surface.grid;
  const int width = device.state().wide_width();
  const int rows = width == 1 ? 1 : records::CHOICE_ROWS;
  const auto across = static_cast<std::size_t>((grid.nx + width - 1) / width);
  const auto down = static_cast<std::size_t>((grid.ny + rows - 1) / rows);
  const auto group = allocate<cl_int>(device, grid.size());
  launch(device, kernels::choose_groups, width, {across, down, 16, 1}, surface.depth, surface.group,
         records, group, screen_of(view, grid), static_cast<cl_float>(params.d_max), cl_int{every});
  return group;
}

void blend_points(Device& device, const View& view, const DeviceRecords& records,
                  const FitTiles& tiles, const SampleGrid& grid, const Buffer<float>& points,
                  const Buffer<float>& reference, const SurfaceBuffers& surface,
                  const BlendParams& params) {
  const std::size_t n = surface.grid.size();
  const meniscus::records::PointsOnTiles on{
      static_cast<int>(n),        tiles.nx,         tiles.ny, grid.first,
      1.0f / (grid.step * kTile), kernel_rays(view)};
  launch(device, kernels::blend_points, 1, {n}, reference, points, records, lists_of(tiles),
         surface, on, blending_of(params));
}

}  // namespace meniscus
