#include "stages/sample/samples.hpp"

#include "device/kernels.hpp"
#include "stages/frame/bins.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kTileSamples = kTile * kTile;

SampleLists no_samples(const SampleGrid& grid) {
  return {grid, (grid.nx + kTile - 1) / kTile, (grid.ny + kTile - 1) / kTile, {}, {}};
}

SampleLists room_for_samples(Device& device, const SampleGrid& grid) {
  SampleLists lists = no_samples(grid);
  lists.sample = allocate<cl_int>(device, lists.tiles() * kTileSamples);
  lists.count = allocate<cl_int>(device, 2 * lists.tiles());
  return lists;
}

SampleLists keep(Device& device, const SampleLists& lists, const Buffer<float>& nearer,
                 const Buffer<float>& depth, const Buffer<float>& unwanted, cl_int where) {
  const SampleLists kept = room_for_samples(device, lists.grid);
  launch(device, kernels::keep_samples, device.state().vector_width, {lists.tiles()}, lists, nearer,
         depth, unwanted, kept, static_cast<cl_int>(lists.tiles()), where);
  return kept;
}

}  // namespace

ListedBlocks blocks_of(Device& device, const SampleGrid& grid, bool listed) {
  return filled<cl_uchar>(device, blocks_in(grid), listed ? 1 : 0);
}

GapLists list_gaps(Device& device, const SampleGrid& grid, const Buffer<float>& open,
                   const OccupiedBlocks& occupied, const ListedBlocks& blocks, double gap) {
  const SampleLists lists = room_for_samples(device, grid);
  GapLists gaps{lists, lists, allocate<float>(device, bins_of(grid).size())};
  gaps.again.count = allocate<cl_int>(device, lists.count.size);
  launch(device, kernels::list_gaps, device.state().vector_width, {lists.tiles()}, open, occupied,
         lists, gaps.again.count, blocks, gaps.bound, cl_int2{{grid.nx, grid.ny}},
         static_cast<cl_float>(gap));
  return gaps;
}

LayerSamples list_fronts(Device& device, const SampleGrid& grid, const FrontMaps& fronts,
                         int every) {
  const LayerSamples lists{room_for_samples(device, grid), room_for_samples(device, grid)};
  const auto& [surface, splash] = lists;
  launch(device, kernels::list_fronts, device.state().vector_width, {surface.tiles()}, fronts,
         surface, splash, cl_int2{{grid.nx, grid.ny}}, cl_int2{{surface.nx, surface.ny}},
         cl_int{every});
  return lists;
}

LayerSamples list_between(Device& device, const SampleGrid& grid, const Buffer<cl_uchar>& wanted,
                          int stride, int every, const ListedBlocks& blocks) {
  const LayerSamples lists{room_for_samples(device, grid), room_for_samples(device, grid)};
  const auto& [surface, splash] = lists;
  launch(device, kernels::list_between, device.state().vector_width, {surface.tiles()}, wanted,
         surface, splash, blocks, cl_int2{{grid.nx, grid.ny}}, cl_int2{{surface.nx, surface.ny}},
         cl_int{stride}, cl_int{every});
  return lists;
}

SampleLists keep_samples(Device& device, const SampleLists& lists, const Buffer<float>& nearer,
                         const Buffer<float>& depth) {
  return keep(device, lists, nearer, depth, depth, records::NEARER);
}

SampleLists keep_samples(Device& device, const SampleLists& lists, const Buffer<float>& nearer,
                         const Buffer<float>& depth, const Buffer<float>& unwanted) {
  return keep(device, lists, nearer, depth, unwanted, records::NEARER_UNLESS);
}

Range range_of(const SampleLists& lists, int width) {
  if (width == 1) return {lists.tiles() * kTileSamples, 1, kTileSamples, 1};
  // Most lists are empty, and a group costs more than an item that has nothing to do.
  constexpr std::size_t kTilesOfGroup = 8;
  return {lists.tiles(), 1, kTilesOfGroup, 1};
}

}  // namespace meniscus
