#include "stages/fit/neighbours.hpp"

#include <algorithm>
#include <span>
#include <tuple>
#include <utility>

#include "base/parallel.hpp"
#include "device/together.hpp"
#include "stages/sheet/surface.hpp"

namespace meniscus {
namespace {

// The most slots that 32-bit indices reach.
constexpr std::size_t kMostSlots = std::size_t{1} << 28;

constexpr std::size_t kLanes = records::FIT_BATCH;  // of fits, whatever the device's WIDTH
static_assert(NearLists::kBlock % kLanes == 0);

// The lists of a block's fits by themselves, neighbours fit by fit.
struct Block {
  NeighbourLists lists;          // without neighbours
  const NearLists::Block* near;  // these
  std::size_t begin, slots = 0;  // first fit; slots that the lists take
};

// The lists of a block whose first fit is `begin`, of fits at `place` in the surface. Fits with
// about as many neighbours share a batch; the order touches no result.
Block list_block(const NearLists::Block& near, const std::vector<std::int32_t>& place,
                 cl_int nobody, std::size_t begin) {
  Block block{{}, &near, begin};
  std::vector<std::uint64_t> order;  // number of neighbours, fit
  for (std::size_t l = 0; l + 1 < near.start.size(); ++l)
    order.push_back((near.start[l + 1] - near.start[l]) << 32 | l);
  std::sort(order.begin(), order.end());
  NeighbourLists& lists = block.lists;
  for (const std::uint64_t sized : order) {
    const std::size_t k = begin + (sized & 0xffffffffu);
    lists.fit.push_back(static_cast<std::int32_t>(k));
    lists.particle.push_back(place[k]);
  }
  for (std::size_t lane = 0; lane < order.size(); lane += kLanes) {
    const std::size_t longest = order[std::min(lane + kLanes, order.size()) - 1] >> 32;
    lists.first.push_back(static_cast<cl_int>(block.slots));
    lists.length.push_back(static_cast<cl_int>(longest));
    block.slots += kLanes * longest;
  }
  lists.fit.resize(kLanes * lists.first.size(), -1);
  lists.particle.resize(lists.fit.size(), nobody);
  return block;
}

// The lists of blocks of fits.
std::vector<Block> list_blocks(const NearLists& near, const std::vector<std::int32_t>& centre,
                               const std::vector<std::int32_t>& around) {
  const std::vector<std::int32_t> place = places_in(around, centre);
  const cl_int nobody = static_cast<cl_int>(around.size());
  std::vector<Block> blocks(near.blocks.size());
  parallel_for(blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b)
      blocks[b] = list_block(near.blocks[b], place, nobody, b * NearLists::kBlock);
  });
  return blocks;
}

using Blocks = std::span<const Block>;

std::size_t slots_of(Blocks blocks) {
  std::size_t slots = 0;
  for (const Block& block : blocks) slots += block.slots;
  return slots;
}

std::size_t batches_of(Blocks blocks) {
  std::size_t batches = 0;
  for (const Block& block : blocks) batches += block.lists.first.size();
  return batches;
}

// Calls make(part) for as many blocks at a time as make at most so many slots, or for one.
template <class Make>
void in_parts(Blocks blocks, std::size_t most_slots, const Make& make) {
  while (!blocks.empty()) {
    std::size_t count = 1, slots = blocks[0].slots;
    for (; count < blocks.size(); ++count) {
      slots += blocks[count].slots;
      if (slots > most_slots) break;
    }
    make(blocks.first(count));
    blocks = blocks.subspan(count);
  }
}

// Puts a block's neighbours into its slots, and nobody into those that are not in use.
void fill_slots(const Block& block, cl_int nobody, cl_int* slots) {
  for (std::size_t lane = 0; lane < block.lists.fit.size(); ++lane) {
    const std::size_t batch = lane / kLanes;
    cl_int* slot = slots + block.lists.first[batch] + lane % kLanes;
    cl_int* const end = slot + kLanes * static_cast<std::size_t>(block.lists.length[batch]);
    if (block.lists.fit[lane] >= 0) {
      const std::size_t k = static_cast<std::size_t>(block.lists.fit[lane]) - block.begin;
      for (std::size_t p = block.near->start[k]; p < block.near->start[k + 1]; ++p, slot += kLanes)
        *slot = block.near->near[p];
    }
    for (; slot < end; slot += kLanes) *slot = nobody;
  }
}

// Some blocks' lists as one; the neighbours go to `neighbour`, which has room for their slots.
NeighbourLists joined(Blocks blocks, cl_int nobody, cl_int* neighbour) {
  NeighbourLists all;
  std::vector<std::size_t> from;  // first slot of each block
  std::size_t slots = 0;
  for (const Block& block : blocks) {
    const NeighbourLists& own = block.lists;
    all.fit.insert(all.fit.end(), own.fit.begin(), own.fit.end());
    all.particle.insert(all.particle.end(), own.particle.begin(), own.particle.end());
    all.length.insert(all.length.end(), own.length.begin(), own.length.end());
    for (const cl_int first : own.first) all.first.push_back(static_cast<cl_int>(slots) + first);
    from.push_back(slots);
    slots += block.slots;
  }
  parallel_for(from.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) fill_slots(blocks[k], nobody, neighbour + from[k]);
  });
  return all;
}

std::size_t most_slots(Device& device) {
  return std::min(most_values<float>(device), kMostSlots - 1);
}

// Cells of the neighbours' fits around `centre`.
LaneCells upload_lane_cells(Device& device, const Projected& projected,
                            const std::vector<std::int32_t>& centre,
                            const FitNeighbours& neighbours) {
  LaneCells all{cells_of(projected, centre, kResidualReach), {}, {}};
  const Cells& cells = all.host;
  const std::size_t n = centre.size();
  std::vector<cl_int> place(n);  // of each fit in bucket order
  for (std::size_t p = 0; p < n; ++p)
    place[static_cast<std::size_t>(cells.item[p])] = static_cast<cl_int>(p);
  std::vector<std::vector<cl_int>> places;  // of each part's lanes
  for (const FitNeighbours::Part& part : neighbours.parts) {
    std::vector<cl_int>& to = places.emplace_back();
    for (const std::int32_t fit : part.lists.fit)
      to.push_back(fit < 0 ? -1 : place[static_cast<std::size_t>(fit)]);
  }
  if (places.empty()) places.emplace_back();
  // With the cells those of the first part, which mostly is the only one.
  std::tie(all.cells, all.to.emplace_back()) = upload_with_cells(device, cells, places[0]);
  for (std::size_t part = 1; part < places.size(); ++part)
    all.to.push_back(upload(device, places[part]));
  return all;
}

}  // namespace

std::vector<NeighbourLists> list_neighbours(const Projected& projected,
                                            const std::vector<std::int32_t>& centre,
                                            const std::vector<std::int32_t>& around, double reach,
                                            std::size_t most_slots) {
  std::vector<NeighbourLists> parts;
  const NearLists near = list_near(projected, centre, around, reach);
  in_parts(list_blocks(near, centre, around), most_slots, [&](Blocks blocks) {
    std::vector<cl_int> neighbour(slots_of(blocks));
    parts.push_back(joined(blocks, static_cast<cl_int>(around.size()), neighbour.data()));
    parts.back().neighbour = std::move(neighbour);
  });
  return parts;
}

FitNeighbours find_neighbours(Device& device, const Projected& projected, const Visible& centre,
                              const std::vector<std::int32_t>& around, double reach) {
  return upload_neighbours(device, projected, list_near(projected, centre.index, around, reach),
                           centre, around);
}

FitNeighbours upload_neighbours(Device& device, const Projected& projected, const NearLists& near,
                                const Visible& centre, const std::vector<std::int32_t>& around) {
  FitNeighbours neighbours;
  const std::vector<Block> blocks = list_blocks(near, centre.index, around);
  in_parts(blocks, most_slots(device), [&](Blocks part) {
    const std::size_t slots = slots_of(part);
    require(slots < kMostSlots,
            "fit: too many points for 32-bit indices (use a smaller " + setting("support") + ")");
    const std::size_t batches = batches_of(part);
    UploadTogether<cl_int, float, cl_int, cl_int, cl_int> arrays(
        device, {kLanes * batches, kLanes * batches, slots, batches, batches});
    NeighbourLists lists = joined(part, static_cast<cl_int>(around.size()), arrays.data<2>());
    std::copy(lists.particle.begin(), lists.particle.end(), arrays.data<0>());
    std::ranges::transform(lists.fit, arrays.data<1>(), [&](std::int32_t fit) {
      return fit < 0 ? 0 : centre.influence_of(static_cast<std::size_t>(fit));
    });
    std::copy(lists.first.begin(), lists.first.end(), arrays.data<3>());
    std::copy(lists.length.begin(), lists.length.end(), arrays.data<4>());
    auto [particle, influence, neighbour, first, length] = arrays.done();
    neighbours.parts.push_back({std::move(lists), particle, influence, neighbour, first, length});
  });
  neighbours.sheet = upload_lane_cells(device, projected, centre.index, neighbours);
  return neighbours;
}

}  // namespace meniscus
