#include "stages/frame/bins.hpp"

#include <algorithm>

#include "base/rounded_up.hpp"
#include "device/kernels.hpp"

namespace meniscus {
namespace {

// How particles are counted and listed (bins.cl).
struct Chunks {
  Range range;  // a work-item takes a chunk
  int counted;  // chunks that have counts of their own, or one set of counts for all
  cl_int size;  // particles of a chunk
  cl_int own;   // counts of a chunk; 0: shared ones
};

Chunks chunks_of(std::size_t particles, std::size_t counts, int width) {
  if (width == 1) return {{particles}, 1, 1, 0};
  // A chunk's counts should be no more work than its particles.
  constexpr std::size_t kMost = 8, kParticles = 512;
  const std::size_t number = std::clamp<std::size_t>(particles / kParticles, 1, kMost);
  return {{number, 1, 1, 1},
          static_cast<int>(number),
          static_cast<cl_int>((particles + number - 1) / number),
          static_cast<cl_int>(counts)};
}

std::size_t padded_to_vectors(std::size_t n) { return rounded_up(n + 3, 64); }

// Cells of 1 << shift samples a side.
struct CellsOfGrid {
  cl_int2 number;      // along i and along j
  std::size_t padded;  // in all
};

CellsOfGrid cells_on(const SampleGrid& grid, int shift) {
  const int side = 1 << shift;
  const cl_int2 number{{(grid.nx + side - 1) / side, (grid.ny + side - 1) / side}};
  return {number, padded_to_vectors(static_cast<std::size_t>(number.s[0]) *
                                    static_cast<std::size_t>(number.s[1]))};
}

}  // namespace

BinGrid bins_of(const SampleGrid& grid) {
  return {(grid.nx + kBinSide - 1) / kBinSide, (grid.ny + kBinSide - 1) / kBinSide};
}

records::Outlined outlined_on(const SampleGrid& grid, const Outlines& outlines) {
  return {outlines.count, outlines.stride, bins_of(grid).nx};
}

int cover_shift(double radius) { return radius >= 14 ? 3 : radius >= 7 ? 2 : 1; }

BoundCells room_for_cells(Device& device, int particles, const SampleGrid& grid, int shift) {
  const CellsOfGrid cells = cells_on(grid, shift);
  const Chunks chunks =
      chunks_of(static_cast<std::size_t>(particles), cells.padded, device.state().vector_width);
  const std::size_t all = static_cast<std::size_t>(chunks.counted) * cells.padded;
  return {allocate<float>(device, all), shift, chunks.own > 0 ? 0 : all};
}

Buffer<float> bound_bins(Device& device, const Covers& covers, const SampleGrid& grid,
                         const BoundCells& room) {
  const BinGrid bins = bins_of(grid);
  const CellsOfGrid cells = cells_on(grid, room.shift);
  const int width = device.state().vector_width;
  const Chunks chunks = chunks_of(static_cast<std::size_t>(covers.count), cells.padded, width);
  const auto bound = allocate<float>(device, bins.size());
  launch(device, kernels::bound_cells, width, chunks.range, covers.cells, covers.deepest,
         room.bound, covers.count, covers.stride, cells.number.s[0], chunks.size, chunks.own);
  if (chunks.counted > 1)
    launch(device, kernels::least_bounds, width, {cells.padded / static_cast<std::size_t>(width)},
           room.bound, cl_int{chunks.counted}, chunks.own);
  launch(device, kernels::bound_bins, width,
         {static_cast<std::size_t>(bins.nx), static_cast<std::size_t>(bins.ny), 8, 8}, room.bound,
         bound, cells.number, cl_int2{{bins.nx, bins.ny}}, cl_int{kBinSide >> room.shift});
  return bound;
}

Buffer<float> bound_bins(Device& device, const Covers& covers, const SampleGrid& grid, int shift) {
  const BoundCells cells = room_for_cells(device, covers.count, grid, shift);
  if (cells.blank > 0) fill(device, cells.bound, kNoSurface);
  return bound_bins(device, covers, grid, cells);
}

void draw_bins(Device& device, const Outlines& outlines, const Buffer<float>& bound,
               const SampleGrid& grid, const std::function<void(const BinLists&)>& draw,
               std::size_t most_entries) {
  const BinGrid bins = bins_of(grid);
  const int width = device.state().vector_width;
  const std::size_t counts = padded_to_vectors(bins.size());
  const Chunks chunks = chunks_of(static_cast<std::size_t>(outlines.count), counts, width);
  const std::size_t all_counts = static_cast<std::size_t>(chunks.counted) * counts;
  const records::Chunked chunked{outlines.count, outlines.stride, bins.nx, chunks.size, chunks.own};
  const auto count =
      chunks.own > 0 ? allocate<cl_int>(device, all_counts) : filled<cl_int>(device, all_counts, 0);
  const auto total = allocate<cl_int>(device, counts);
  const auto shown = allocate<cl_uchar>(device, static_cast<std::size_t>(outlines.stride));
  launch(device, kernels::count_bins, width, chunks.range, outlines, bound, count, shown, chunked);
  launch(device, kernels::sum_counts, width, {counts / static_cast<std::size_t>(width)}, count,
         total, cl_int{chunks.counted}, static_cast<cl_int>(counts));
  const std::vector<cl_int> totals = download(device, total);

  std::vector<cl_int> end(bins.size());
  most_entries = std::min(most_entries, most_values<cl_int2>(device));
  for (std::size_t first = 0, last = 0; first < bins.size(); first = last) {
    std::size_t entries = 0;
    while (last < bins.size() &&
           (last == first || entries + static_cast<std::size_t>(totals[last]) <= most_entries)) {
      entries += static_cast<std::size_t>(totals[last]);
      end[last++] = static_cast<cl_int>(entries);
    }
    const BinLists lists{upload(device, end),
                         allocate<cl_int2>(device, std::max<std::size_t>(entries, 1)),
                         {static_cast<int>(first), static_cast<int>(last), bins.nx}};
    if (entries > 0)
      launch(device, kernels::fill_bins, width, chunks.range, outlines, bound, shown, lists.end,
             count, lists.entry, chunked, lists.bins);
    draw(lists);
  }
}

Range bin_items(const BinLists& lists, int width) {
  const std::size_t bins = static_cast<std::size_t>(lists.bins.end - lists.bins.begin);
  // Few bins a work-group where one item draws a whole bin: they differ much in cost.
  return width > 1 ? Range{bins, 1, 8} : Range{bins * kBinSide * kBinSide, 1, 64};
}

}  // namespace meniscus
