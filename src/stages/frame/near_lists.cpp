#include "stages/frame/near_lists.hpp"

#include <algorithm>
#include <array>

#include "base/parallel.hpp"

namespace meniscus {
namespace {

// The neighbours of centres [begin, end).
NearLists::Block look_around(const Projected& projected, const std::vector<std::int32_t>& centre,
                             const Cells& cells, float reach, std::size_t begin, std::size_t end) {
  NearFinder* const find = near_finders()[0];
  NearLists::Block block;
  block.near.reserve(128 * (end - begin));  // mostly enough
  block.start.push_back(0);
  std::vector<cl_int> found;
  for (std::size_t k = begin; k < end; ++k) {
    const std::int32_t i = centre[k];
    const std::array at{projected.x[i], projected.y[i], projected.z[i]};
    std::size_t count = 0;
    visit_ranges_near(
        cells, at[0], at[1], at[2], [&](std::int32_t first, std::int32_t last, std::uint32_t tag) {
          const std::size_t most = count + static_cast<std::size_t>(last - first) + kNearRoom;
          if (found.size() < most) found.resize(2 * most);
          count += find(cells, first, last, tag, at, reach * reach, found.data() + count);
          return true;
        });
    block.near.insert(block.near.end(), found.begin(),
                      found.begin() + static_cast<std::ptrdiff_t>(count));
    block.start.push_back(block.near.size());
  }
  return block;
}

}  // namespace

Cells cells_of(const Projected& projected, const std::vector<std::int32_t>& index, double side) {
  const std::size_t n = index.size();
  std::vector<float> x(n), y(n), z(n);
  for (std::size_t k = 0; k < n; ++k) {
    x[k] = projected.x[index[k]];
    y[k] = projected.y[index[k]];
    z[k] = projected.z[index[k]];
  }
  return make_cells(x, y, z, static_cast<float>(side));
}

NearLists list_near(const Projected& projected, const std::vector<std::int32_t>& centre,
                    const std::vector<std::int32_t>& around, double reach) {
  return list_near(projected, centre, cells_of(projected, around, reach), reach);
}

NearLists list_near(const Projected& projected, const std::vector<std::int32_t>& centre,
                    const Cells& cells, double reach) {
  constexpr std::size_t kBlock = NearLists::kBlock;
  const std::size_t n = centre.size();
  NearLists near{std::vector<NearLists::Block>((n + kBlock - 1) / kBlock)};
  parallel_for(near.blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b)
      near.blocks[b] = look_around(projected, centre, cells, static_cast<float>(reach), b * kBlock,
                                   std::min(n, (b + 1) * kBlock));
  });
  return near;
}

}  // namespace meniscus
