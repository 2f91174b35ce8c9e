// Points of which no two lie nearer than a distance, chosen on all processors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/parallel.hpp"
#include "prepare/voxel_grid.hpp"

namespace meniscus {

/// The blocks that a grid's voxels lie in.
struct VoxelBlocks {
  explicit VoxelBlocks(const std::vector<VoxelGrid::Voxel>& voxels);  // those of a block in a row

  std::size_t size() const { return first.size() - 1; }

  std::vector<std::uint32_t> first;  // [blocks + 1] voxels, in the order they were given in
  std::vector<VoxelPlace> place;     // [blocks] of their first voxel's corner
  /// The blocks around each, (dx + 1) + 3 (dy + 1) + 9 (dz + 1); KeyTable::kNone: there is none.
  std::vector<std::array<std::uint32_t, 27>> around;
  /// Blocks that do not touch each other.
  std::array<std::vector<std::uint32_t>, 8> colour;
};

/// Calls work(block) once for each block, for several that do not touch at a time. What it reads
/// and writes of blocks that touch is the same for any number of threads.
template <class Work>
void for_blocks_apart(const VoxelBlocks& blocks, const Work& work) {
  constexpr std::size_t kGrain = 8;  // blocks that are worth a thread
  for (const std::vector<std::uint32_t>& apart : blocks.colour)
    parallel_for(apart.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) work(apart[k]);
    });
}

/// Points along the axes of a grid, in its sides, each of one of the blocks. Points lie at most a
/// side outside their block; farther ones may be overlooked. For for_blocks_apart().
class ApartPoints {
 public:
  /// Room for `most` points, by numbers.
  ApartPoints(const VoxelBlocks& blocks, std::size_t most);

  /// Whether a point of a block lies at least `distance` from all that were kept, at most a side.
  bool is_apart(std::size_t block, const Vec3d& point, double distance) const;
  /// Keeps a point of a block by a number of its own.
  void keep(std::size_t block, const Vec3d& point, std::size_t number);

 private:
  const VoxelBlocks& blocks_;
  std::vector<std::uint32_t> first_;  // [blocks][voxels] the point that was kept last
  std::vector<std::uint32_t> next_;   // [points] that was kept before, in the same voxel
  std::vector<Vec3d> point_;          // [points]
};

}  // namespace meniscus
