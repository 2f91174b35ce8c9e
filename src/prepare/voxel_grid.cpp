#include "prepare/voxel_grid.hpp"

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"

namespace meniscus {
namespace {

// Rows of a rotation: (2 3 6), (3 -6 2), (6 2 -3) over 7.
const std::array<Vec3d, 3> kAxes{Vec3d{2, 3, 6} / 7, Vec3d{3, -6, 2} / 7, Vec3d{6, 2, -3} / 7};

constexpr double kUnit = 1 << 20;                  // steps of a place in a voxel, per side
constexpr std::int64_t kFarthest = (1 << 20) - 1;  // voxels from the origin along an axis
constexpr int kBlockBits = 2, kAxisBits = 21 - kBlockBits;

constexpr std::size_t kParts = 64;
constexpr std::size_t kRun = 8192;  // particles that one thread sorts by part

// A particle in its voxel.
struct Placed {
  std::uint64_t key;
  std::array<std::uint32_t, 3> at;  // steps
  std::uint32_t particle;
};

}  // namespace

std::uint64_t key_of(const VoxelPlace& place) {
  std::uint64_t block = 0, within = 0;
  for (const std::int64_t c : place) {
    const auto positive =
        static_cast<std::uint64_t>(std::clamp(c, -kFarthest, kFarthest) + kFarthest);
    block = block << kAxisBits | positive >> kBlockBits;
    within = within << kBlockBits | (positive & (kVoxelBlock - 1));
  }
  return block << 3 * kBlockBits | within;
}

VoxelPlace place_of(std::uint64_t key) {
  VoxelPlace place{};
  for (std::size_t a = 0; a < 3; ++a) {
    const std::size_t up = 2 - a;
    const std::uint64_t within = key >> up * kBlockBits & (kVoxelBlock - 1),
                        block = key >> (3 * kBlockBits + up * kAxisBits) & ((1 << kAxisBits) - 1);
    place[a] = static_cast<std::int64_t>(block << kBlockBits | within) - kFarthest;
  }
  return place;
}

VoxelGrid::VoxelGrid(double side, const Vec3d& origin, bool moving)
    : side_(side), origin_(origin), moving_(moving), parts_(kParts) {}

std::size_t VoxelGrid::part_of(std::uint64_t key) {
  static_assert(kParts == 64);
  return static_cast<std::size_t>(spread_bits(key / kBlockVoxels) >> 58);
}

VoxelGrid::Voxel& VoxelGrid::Part::at(std::uint64_t key) {
  const std::uint32_t k = number.add(key);
  if (k == voxels.size()) voxels.emplace_back().key = key;
  return voxels[k];
}

// Runs of particles are sorted by part, each for itself. Then each part takes its own of every run.
void VoxelGrid::add(const std::vector<Particle>& particles) {
  const std::size_t n = particles.size(), runs = (n + kRun - 1) / kRun;
  std::vector<Placed> sorted(n);
  std::vector<std::array<std::uint32_t, kParts + 1>> first(runs);  // in a run, of each part
  parallel_for(runs, 1, [&](std::size_t begin, std::size_t end) {
    std::vector<Placed> placed(kRun);
    for (std::size_t run = begin; run < end; ++run) {
      const std::size_t from = run * kRun, count = std::min(kRun, n - from);
      std::array<std::uint32_t, kParts + 1>& next = first[run];
      next.fill(0);
      for (std::size_t k = 0; k < count; ++k) {
        const Particle& particle = particles[from + k];
        const Vec3d p = (Vec3d{particle.x, particle.y, particle.z} - origin_) / side_;
        VoxelPlace place{};
        for (std::size_t a = 0; a < 3; ++a) {
          const double along = dot(kAxes[a], p), most = static_cast<double>(kFarthest);
          const double inside = std::clamp(along, -most, most);
          place[a] = floor_of(inside);
          placed[k].at[a] =
              static_cast<std::uint32_t>((inside - static_cast<double>(place[a])) * kUnit);
        }
        placed[k].key = key_of(place);
        placed[k].particle = static_cast<std::uint32_t>(from + k);
        ++next[part_of(placed[k].key) + 1];
      }
      for (std::size_t part = 0; part < kParts; ++part) next[part + 1] += next[part];
      auto to = next;
      for (std::size_t k = 0; k < count; ++k)
        sorted[from + to[part_of(placed[k].key)]++] = placed[k];
    }
  });
  parallel_for(kParts, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p)
      for (std::size_t run = 0; run < runs; ++run)
        for (std::size_t k = run * kRun + first[run][p]; k < run * kRun + first[run][p + 1]; ++k) {
          const Placed& placed = sorted[k];
          const auto& [x, y, z, seen, velocity] = particles[placed.particle];
          Voxel& voxel = parts_[p].at(placed.key);
          ++voxel.count;
          voxel.seen += seen;
          for (std::size_t a = 0; a < 3; ++a) {
            voxel.sum[a] += placed.at[a];
            if (seen) voxel.seen_sum[a] += placed.at[a];
          }
          if (!is_known(velocity)) continue;
          constexpr double kMost = (1 << 18) * kUnit;
          const std::array<float, 3> v{velocity.x, velocity.y, velocity.z};
          ++voxel.moving;
          voxel.seen_moving += seen;
          for (std::size_t a = 0; a < 3; ++a) {
            const std::int64_t units =
                std::llround(std::clamp(v[a] / side_ * kUnit, -kMost, kMost));
            voxel.velocity[a] += units;
            if (seen) voxel.seen_velocity[a] += units;
          }
        }
  });
}

void VoxelGrid::add_voxels(const std::vector<Voxel>& voxels) {
  for (const Voxel& voxel : voxels) {
    Voxel& sums = parts_[part_of(voxel.key)].at(voxel.key);
    sums.count += voxel.count;
    sums.seen += voxel.seen;
    sums.moving += voxel.moving;
    sums.seen_moving += voxel.seen_moving;
    for (std::size_t a = 0; a < 3; ++a) {
      sums.sum[a] += voxel.sum[a];
      sums.seen_sum[a] += voxel.seen_sum[a];
      sums.velocity[a] += voxel.velocity[a];
      sums.seen_velocity[a] += voxel.seen_velocity[a];
    }
  }
}

std::size_t VoxelGrid::size() const {
  std::size_t all = 0;
  for (const Part& part : parts_) all += part.voxels.size();
  return all;
}

std::vector<VoxelGrid::Voxel> VoxelGrid::voxels() const {
  std::array<std::size_t, kParts> first{};
  std::size_t all = 0;
  for (std::size_t p = 0; p < kParts; ++p) {
    first[p] = all;
    all += parts_[p].voxels.size();
  }
  std::vector<Voxel> voxels(all);
  parallel_for(kParts, 1, [&](std::size_t begin, std::size_t end) {
    std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
    for (std::size_t p = begin; p < end; ++p) {
      const std::vector<Voxel>& of_part = parts_[p].voxels;
      order.clear();
      for (std::size_t k = 0; k < of_part.size(); ++k)
        order.emplace_back(of_part[k].key, static_cast<std::uint32_t>(k));
      std::sort(order.begin(), order.end());
      for (std::size_t k = 0; k < order.size(); ++k)
        voxels[first[p] + k] = of_part[order[k].second];
    }
  });
  return voxels;
}

Vec3d VoxelGrid::position(const Voxel& voxel, const std::array<std::int64_t, 3>& sum,
                          std::int64_t count) const {
  const VoxelPlace at = place_of(voxel.key);
  Vec3d p = origin_;
  for (std::size_t a = 0; a < 3; ++a) {
    const double within = (static_cast<double>(sum[a]) / static_cast<double>(count) + 0.5) / kUnit;
    p += kAxes[a] * (side_ * (static_cast<double>(at[a]) + within));
  }
  return p;
}

Vec3 VoxelGrid::velocity(const std::array<std::int64_t, 3>& sum, std::int64_t count) const {
  if (count == 0) return kNoVelocity;
  const double unit = side_ / kUnit / static_cast<double>(count);
  return static_cast<Vec3>(
      Vec3d{static_cast<double>(sum[0]), static_cast<double>(sum[1]), static_cast<double>(sum[2])} *
      unit);
}

Vec3d VoxelGrid::along_axes(const Vec3d& position) const {
  const Vec3d p = (position - origin_) / side_;
  return {dot(kAxes[0], p), dot(kAxes[1], p), dot(kAxes[2], p)};
}

}  // namespace meniscus
