#include "stages/samples.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kTileSamples = kTile * kTile;

SampleLists no_samples(Device& device, const SampleGrid& grid) {
  const int nx = (grid.nx + kTile - 1) / kTile, ny = (grid.ny + kTile - 1) / kTile;
  const std::size_t tiles = static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
  return {grid, nx, ny, allocate<cl_int>(device, tiles * kTileSamples),
          allocate<cl_int>(device, tiles)};
}

enum class Where : cl_int { nearer, finite, infinite };  // as in list_samples.cl

SampleLists keep(Device& device, const SampleLists& lists, const Buffer<float>& nearer,
                 const Buffer<float>& depth, Where where) {
  const SampleLists kept = no_samples(device, lists.grid);
  launch(device, "list_samples.cl", "keep_samples", {lists.tiles()}, "", lists.sample, lists.count,
         nearer, depth, kept.sample, kept.count, static_cast<cl_int>(lists.tiles()),
         static_cast<cl_int>(where));
  return kept;
}

}  // namespace

SampleLists list_samples(Device& device, const SampleGrid& grid, const Buffer<float>& wanted,
                         const Buffer<float>& or_wanted, int every) {
  const SampleLists lists = no_samples(device, grid);
  launch(device, "list_samples.cl", "list_samples", {lists.tiles()}, "", wanted, or_wanted,
         lists.sample, lists.count, cl_int2{{grid.nx, grid.ny}}, cl_int2{{lists.nx, lists.ny}},
         static_cast<cl_int>(every));
  return lists;
}

SampleLists keep_samples(Device& device, const SampleLists& lists, const Buffer<float>& nearer,
                         const Buffer<float>& depth) {
  return keep(device, lists, nearer, depth, Where::nearer);
}

SampleLists keep_samples(Device& device, const SampleLists& lists, const Buffer<float>& wanted) {
  return keep(device, lists, wanted, wanted, Where::finite);
}

SampleLists drop_samples(Device& device, const SampleLists& lists, const Buffer<float>& unwanted) {
  return keep(device, lists, unwanted, unwanted, Where::infinite);
}

Range range_of(const SampleLists& lists, int width) {
  const std::size_t items = width == 1 ? kTileSamples : 1;
  return {lists.tiles() * items, 1, items, 1};
}

}  // namespace meniscus
