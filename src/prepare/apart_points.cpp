#include "prepare/apart_points.hpp"

#include <algorithm>

namespace meniscus {
namespace {

constexpr std::uint32_t kNone = KeyTable::kNone;

// The number of a voxel in its block.
std::size_t voxel_at(std::int64_t i, std::int64_t j, std::int64_t k) {
  return static_cast<std::size_t>((i * kVoxelBlock + j) * kVoxelBlock + k);
}

std::uint64_t block_of(const VoxelPlace& voxel) { return key_of(voxel) / kBlockVoxels; }

}  // namespace

VoxelBlocks::VoxelBlocks(const std::vector<VoxelGrid::Voxel>& voxels) {
  KeyTable number;
  std::uint64_t last = ~std::uint64_t{0};
  for (std::size_t k = 0; k < voxels.size(); ++k) {
    const std::uint64_t key = voxels[k].key / kBlockVoxels;
    if (key == last) continue;
    number.add(last = key);
    first.push_back(static_cast<std::uint32_t>(k));
    place.push_back(place_of(key * kBlockVoxels));
  }
  const std::size_t n = first.size();
  first.push_back(static_cast<std::uint32_t>(voxels.size()));
  around.resize(n);
  constexpr std::size_t kGrain = 256;  // blocks that are worth a thread
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b)
      for (std::int64_t k = 0; k < 27; ++k) {
        const VoxelPlace there{place[b][0] + kVoxelBlock * (k % 3 - 1),
                               place[b][1] + kVoxelBlock * (k / 3 % 3 - 1),
                               place[b][2] + kVoxelBlock * (k / 9 - 1)};
        const std::uint32_t found = number.find(block_of(there));
        // At the end of the grid places beyond it are those at its end.
        around[b][static_cast<std::size_t>(k)] =
            found != kNone && place[found] == there ? found : kNone;
      }
  });
  for (std::size_t b = 0; b < n; ++b) {
    // Of the first block's corner, from which all blocks lie whole blocks away.
    const auto odd = [&](std::size_t a) {
      return static_cast<std::size_t>((place[b][a] - place[0][a]) / kVoxelBlock & 1);
    };
    colour[odd(0) | odd(1) << 1 | odd(2) << 2].push_back(static_cast<std::uint32_t>(b));
  }
}

ApartPoints::ApartPoints(const VoxelBlocks& blocks, std::size_t most)
    : blocks_(blocks), first_(blocks.size() * kBlockVoxels, kNone), next_(most), point_(most) {}

void ApartPoints::keep(std::size_t block, const Vec3d& point, std::size_t number) {
  const auto within = [&](double v, std::size_t a) {
    return std::clamp<std::int64_t>(floor_of(v) - blocks_.place[block][a], 0, kVoxelBlock - 1);
  };
  std::uint32_t& first =
      first_[block * kBlockVoxels +
             voxel_at(within(point.x, 0), within(point.y, 1), within(point.z, 2))];
  next_[number] = first;
  point_[number] = point;
  first = static_cast<std::uint32_t>(number);
}

bool ApartPoints::is_apart(std::size_t block, const Vec3d& point, double distance) const {
  constexpr std::int64_t kSide = kVoxelBlock;
  const std::array<double, 3> at{point.x, point.y, point.z};
  std::array<std::int64_t, 3> low{}, high{};  // voxels, from the first one of the block before
  for (std::size_t a = 0; a < 3; ++a) {
    const double from = at[a] - static_cast<double>(blocks_.place[block][a] - kSide);
    low[a] = std::clamp<std::int64_t>(floor_of(from - distance), 0, 3 * kSide - 1);
    high[a] = std::clamp<std::int64_t>(floor_of(from + distance), 0, 3 * kSide - 1);
    // Points that lie outside their block were put at its end.
    if (low[a] > 0 && low[a] % kSide == 0) --low[a];
    if (high[a] < 3 * kSide - 1 && high[a] % kSide == kSide - 1) ++high[a];
  }
  for (std::int64_t i = low[0]; i <= high[0]; ++i)
    for (std::int64_t j = low[1]; j <= high[1]; ++j)
      for (std::int64_t k = low[2]; k <= high[2]; ++k) {
        const std::uint32_t there =
            blocks_.around[block]
                          [static_cast<std::size_t>(i / kSide + 3 * (j / kSide) + 9 * (k / kSide))];
        if (there == kNone) continue;
        const std::size_t voxel = voxel_at(i % kSide, j % kSide, k % kSide);
        for (std::uint32_t p = first_[there * kBlockVoxels + voxel]; p != kNone; p = next_[p])
          if (dot(point_[p] - point, point_[p] - point) < distance * distance) return false;
      }
  return true;
}

}  // namespace meniscus
