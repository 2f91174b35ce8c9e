// thin: replaces particles that lie closer on the screen than pixels can tell by fewer that stand
// for them, so that all later stages are bounded by pixels.
//
// The result looks like the same fluid simulated with larger particles, of spacing S: one layer of
// representatives lies half of S below the surface that the camera sees, others fill what is
// behind it. Departs from averaging alone: the mean of what a cell holds lies anywhere between the
// surface and S below it, which shows as steps (docs/method.md).
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "prepare/velocities.hpp"
#include "stages/project.hpp"
#include "stages/view.hpp"

namespace meniscus {

/// Sums over the particles in the cubes of a grid. The grid stands askew to the world's axes, so
/// that no wall or floor lies along it. Sums are of whole numbers: the order does not matter.
class VoxelGrid {
 public:
  struct Voxel {
    std::uint64_t key = 0;                          // of its place; ascending in voxels()
    std::int64_t count = 0, seen = 0;               // particles in it; fronts among them
    std::array<std::int64_t, 3> sum{}, seen_sum{};  // of places in the voxel, 2^-20 sides
    std::int64_t moving = 0, seen_moving = 0;       // those of them whose velocity is known
    std::array<std::int64_t, 3> velocity{}, seen_velocity{};  // its sums, 2^-20 sides per second
  };

  /// Cubes of side `side` around `origin`, both in world units, for particles that carry
  /// velocities or do not.
  VoxelGrid(double side, const Vec3d& origin, bool moving = false)
      : side_(side), origin_(origin), moving_(moving) {}
  VoxelGrid(VoxelGrid&&) = default;

  /// Adds a particle at a finite position (world units), with its velocity (world units per
  /// second; in sums no more than 2^18 sides per second along an axis).
  void add(float x, float y, float z, bool seen, const Vec3& velocity = kNoVelocity);
  /// Adds a voxel of a grid of the same cubes.
  void add(const Voxel& voxel);

  double side() const { return side_; }
  const Vec3d& origin() const { return origin_; }
  bool moving() const { return moving_; }
  std::size_t size() const { return voxels_.size(); }
  /// The voxels that hold particles, by place.
  std::vector<Voxel> voxels() const;
  /// The mean position of a voxel's particles, or of the fronts among them (world units).
  Vec3d mean(const Voxel& voxel) const { return position(voxel, voxel.sum, voxel.count); }
  Vec3d seen_mean(const Voxel& voxel) const { return position(voxel, voxel.seen_sum, voxel.seen); }
  /// Their mean velocity (world units per second), kNoVelocity where none is known.
  Vec3 mean_velocity(const Voxel& voxel) const { return velocity(voxel.velocity, voxel.moving); }
  Vec3 seen_mean_velocity(const Voxel& voxel) const {
    return velocity(voxel.seen_velocity, voxel.seen_moving);
  }

 private:
  Vec3d position(const Voxel& voxel, const std::array<std::int64_t, 3>& sum,
                 std::int64_t count) const;
  Vec3 velocity(const std::array<std::int64_t, 3>& sum, std::int64_t count) const;
  double side_;
  Vec3d origin_;
  bool moving_;
  std::unordered_map<std::uint64_t, Voxel> voxels_;
  Voxel* last_ = nullptr;  // that was added to
};

/// A loose particle, or a drop too small for the surface: drawn as a sphere.
struct SprayDrop {
  Vec3d centre;       // world units
  double radius = 0;  // world units: that of a particle times the cube root of their number
  Vec3 velocity = kNoVelocity;  // world units per second
};

struct Thinned {
  WorldParticles particles;  // that stand for the fluid, one per side^3; each moves as the mean of
                             // what it stands for
  std::vector<SprayDrop> spray;
};

/// Particles of spacing `grid.side()` that stand for those in the grid.
///
///   radius  of the particles, world units; at most half the grid's side
///   eye     where the camera is (world units), or a point far towards it
///   offset  FitParams::offset: the surface lies this many radii outside the particles' centres
///
/// Waits. Throws DeviceError.
Thinned thin_particles(Device& device, const VoxelGrid& grid, double radius, const Vec3d& eye,
                       double offset);

}  // namespace meniscus
