// Sums over the particles in the cubes of a grid: what thinning knows of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/key_table.hpp"
#include "prepare/velocities.hpp"
#include "stages/vec.hpp"

namespace meniscus {

/// A cube of the grid, counted from its origin along its axes.
using VoxelPlace = std::array<std::int64_t, 3>;

/// Voxels make blocks of so many a side, and so many in all.
inline constexpr std::int64_t kVoxelBlock = 4,
                              kBlockVoxels = kVoxelBlock * kVoxelBlock * kVoxelBlock;

/// The largest whole number up to v, without the call that std::floor is where the processor may be
/// an old one.
inline std::int64_t floor_of(double v) {
  const std::int64_t cut = static_cast<std::int64_t>(v);
  return cut - (v < static_cast<double>(cut) ? 1 : 0);
}

/// One number for a place within 2^20 voxels of the origin, and back. Keys of one block follow each
/// other: key / kBlockVoxels is the block's.
std::uint64_t key_of(const VoxelPlace& place);
VoxelPlace place_of(std::uint64_t key);

/// The grid stands askew to the world's axes, so that no wall or floor lies along it. Sums are of
/// whole numbers: the order of the particles does not matter.
class VoxelGrid {
 public:
  struct Voxel {
    std::uint64_t key = 0;                          // of its place
    std::int64_t count = 0, seen = 0;               // particles in it; fronts among them
    std::array<std::int64_t, 3> sum{}, seen_sum{};  // of places in the voxel, 2^-20 sides
    std::int64_t moving = 0, seen_moving = 0;       // those of them whose velocity is known
    std::array<std::int64_t, 3> velocity{}, seen_velocity{};  // its sums, 2^-20 sides per second
  };
  /// A particle at a finite position (world units), with its velocity (world units per second; in
  /// sums no more than 2^18 sides per second along an axis).
  struct Particle {
    float x, y, z;
    bool seen;
    Vec3 velocity = kNoVelocity;
  };

  /// Cubes of side `side` around `origin`, both in world units, for particles that carry
  /// velocities or do not.
  VoxelGrid(double side, const Vec3d& origin, bool moving = false);
  VoxelGrid(VoxelGrid&&) = default;

  /// Adds particles, on all processors.
  void add(const std::vector<Particle>& particles);
  /// Adds voxels of a grid of the same cubes.
  void add_voxels(const std::vector<Voxel>& voxels);

  double side() const { return side_; }
  const Vec3d& origin() const { return origin_; }
  bool moving() const { return moving_; }
  std::size_t size() const;
  /// The voxels that hold particles, those of a block one after the other, by key; in an order that
  /// follows from the voxels alone.
  std::vector<Voxel> voxels() const;
  /// The mean position of a voxel's particles, or of the fronts among them (world units).
  Vec3d mean(const Voxel& voxel) const { return position(voxel, voxel.sum, voxel.count); }
  Vec3d seen_mean(const Voxel& voxel) const { return position(voxel, voxel.seen_sum, voxel.seen); }
  /// Their mean velocity (world units per second), kNoVelocity where none is known.
  Vec3 mean_velocity(const Voxel& voxel) const { return velocity(voxel.velocity, voxel.moving); }
  Vec3 seen_mean_velocity(const Voxel& voxel) const {
    return velocity(voxel.seen_velocity, voxel.seen_moving);
  }
  /// A position (world units) along the grid's axes, in sides from its origin.
  Vec3d along_axes(const Vec3d& position) const;

 private:
  // The voxels of some of the blocks. Parts are filled side by side.
  struct Part {
    KeyTable number;
    std::vector<Voxel> voxels;  // by their number

    Voxel& at(std::uint64_t key);
  };
  static std::size_t part_of(std::uint64_t key);

  Vec3d position(const Voxel& voxel, const std::array<std::int64_t, 3>& sum,
                 std::int64_t count) const;
  Vec3 velocity(const std::array<std::int64_t, 3>& sum, std::int64_t count) const;

  double side_;
  Vec3d origin_;
  bool moving_;
  std::vector<Part> parts_;
};

}  // namespace meniscus
