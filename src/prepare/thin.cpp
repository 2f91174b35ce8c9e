#include "prepare/thin.hpp"

#include <algorithm>
#include <cstdint>

#include "base/exact_math.hpp"
#include "base/parallel.hpp"
#include "prepare/apart_points.hpp"
#include "stages/frame/cells.hpp"
#include "stages/frame/density.hpp"

namespace meniscus {
namespace {

constexpr std::uint32_t kNone = KeyTable::kNone;
constexpr std::size_t kGrain = 4096;  // voxels that are worth a thread

// What the field of the voxels' masses says at some points: value and gradient (1 / radii).
struct FieldAt {
  std::vector<double> density;
  std::vector<Vec3d> gradient;
};

// The density field of point masses at each of them (positions in radii of the representatives; a
// mass of 1 fills a cube of two radii; one of 0 adds nothing).
FieldAt measure_field(Device& device, const std::vector<Vec3d>& masses,
                      const std::vector<float>& mass) {
  const std::size_t n = masses.size();
  const Cells cells = make_cells(masses, kDensitySupport);
  std::vector<float> in_order(n);
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p)
      in_order[p] = mass[static_cast<std::size_t>(cells.item[p])];
  });
  DeviceCells field = upload_cells(device, cells);
  field.weight = upload(device, in_order);
  const Buffer<float> gradients = measure_gradients(device, field);
  const HostView values(device, gradients);
  FieldAt at{std::vector<double>(n), std::vector<Vec3d>(n)};
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      const std::size_t k = static_cast<std::size_t>(cells.item[p]);
      at.gradient[k] = {values[p], values[n + p], values[2 * n + p]};
      at.density[k] = values[3 * n + p];
    }
  });
  return at;
}

// The density field so deep below a flat face, in S, from 0 to 1: the integral over a half space of
// the cubic spline, which the field follows within .0005.
constexpr double density_at(double d) {
  return 0.5 + d * (0.7 + d * d * (-1.0 / 3 + d * d * (0.15 - 0.05 * d)));
}

// The depth at which it has a value.
double depth_of(double density) {
  double low = 0, high = 1;
  for (int k = 0; k < 20; ++k) {
    const double d = (low + high) / 2;
    (density_at(d) < density ? low : high) = d;
  }
  return low;
}

// Chooses where the representatives of a grid's voxels lie. Each voxel may get one for what is seen
// of it, and one for what lies behind that. Lengths are in radii of the representatives, S is their
// spacing.
class Representatives {
 public:
  Representatives(Device& device, const VoxelGrid& grid, double radius, const Vec3d& eye,
                  double offset)
      : grid_(grid),
        radius_(radius),
        spacing_(2 * radius),
        unit_(grid.side() / 2),
        eye_((eye - grid.origin()) / unit_),
        inset_(offset * (unit_ - radius) / unit_),
        voxels_(grid.voxels()),
        front_(voxels_.size(), Made::nothing),
        rest_(voxels_.size(), Made::nothing),
        blocks_(voxels_),
        inner_(blocks_, 2 * voxels_.size()) {
    measure_means(device);
    find_sparse();
  }

  /// The surface that the camera sees: from the fronts' depth of `radius` to that of half of S.
  void place_seen() {
    ApartPoints seen(blocks_, voxels_.size());
    for_blocks_apart(blocks_, [&](std::size_t block) {
      for (const std::uint32_t v : by_fronts(block)) {
        if (is_loose(v)) {
          front_[v] = Made::drop;
          continue;
        }
        Vec3d& place = at_[point_of(v)];
        const Vec3d p = along_axes(place);
        if (!seen.is_apart(block, p, kApart)) continue;
        seen.keep(block, p, v);
        place = below_front(v);
        inner_.keep(block, along_axes(place), v);
        front_[v] = Made::seen;
      }
    });
  }

  /// The surface that it does not see, from how deep below it the voxels' means lie.
  void place_unseen() {
    keep_apart(
        kApart,
        [&](std::size_t v) {
          return field_.density[v] >= kLoose && field_.density[v] <= density_at(kSurface) &&
                 2 * length(field_.gradient[v]) >= kSteep;
        },
        [&](std::size_t v) {
          return at_[v] - normalized(-field_.gradient[v]) * (1 - 2 * depth_of(field_.density[v]));
        });
  }

  /// What lies behind both.
  void place_inside() {
    keep_apart(
        kBehind, [&](std::size_t v) { return field_.density[v] >= kInside; },
        [&](std::size_t v) { return at_[v]; });
  }

  /// The representatives and the drops, in world units.
  Thinned in_world() const {
    Thinned thinned;
    thinned.particles.moving = grid_.moving();
    const auto put = [&](const Vec3d& p, const Vec3& velocity) {
      const Vec3d world = p * unit_ + grid_.origin();
      thinned.particles.x.push_back(static_cast<float>(world.x));
      thinned.particles.y.push_back(static_cast<float>(world.y));
      thinned.particles.z.push_back(static_cast<float>(world.z));
      if (grid_.moving()) thinned.particles.velocity.push_back(velocity);
    };
    for (std::size_t v = 0; v < voxels_.size(); ++v) {
      const VoxelGrid::Voxel& voxel = voxels_[v];
      if (front_[v] == Made::drop)
        thinned.spray.push_back({grid_.mean(voxel),
                                 radius_ * cube_root(static_cast<double>(voxel.count)),
                                 grid_.mean_velocity(voxel)});
      if (front_[v] == Made::seen) put(at_[point_of(v)], grid_.seen_mean_velocity(voxel));
      if (rest_[v] == Made::behind) put(at_[v], grid_.mean_velocity(voxel));
    }
    return thinned;
  }

 private:
  enum class Made : std::uint8_t { nothing, drop, seen, behind };

  // Density below which a representative may be loose: what a drop of .4 S^3 has at its centre, and
  // a sheet a fifth of S thick. Sheets are recognised by their neighbours, of which so many are as
  // sparse, and by half of what one layer of particles has at least, .7 s / S.
  static constexpr double kLoose = 0.12, kSparse = 0.3, kLayer = 0.35;
  static constexpr int kSheet = 4;
  // Representatives lie this far apart at least, those behind the surface from it; these are
  // deeper than .4 S in the fluid. In S.
  static constexpr double kApart = 0.65, kBehind = 0.75, kInside = 0.8;
  static constexpr double kSurface = 0.7, kSteep = 0.2;  // of means of the surface: S; 1 / S
  static constexpr double kFlat = 0.05;                  // a gradient without a direction, 1 / S

  bool is_seen(std::size_t v) const { return voxels_[v].seen > 0; }
  // Where a voxel's point, the mean of its fronts, stands behind the means.
  std::size_t point_of(std::size_t v) const { return voxels_.size() + number_[v]; }
  Vec3d along_axes(const Vec3d& p) const { return grid_.along_axes(p * unit_ + grid_.origin()); }

  // The voxels' means and points, and the field of their masses there.
  void measure_means(Device& device) {
    const std::size_t n = voxels_.size();
    const double share = spacing_ / grid_.side();  // of S
    std::uint32_t points = 0;
    number_.assign(n, kNone);
    for (std::size_t v = 0; v < n; ++v)
      if (is_seen(v)) number_[v] = points++;
    at_.resize(n + points);
    std::vector<float> mass(at_.size(), 0.0f);
    parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) {
        const VoxelGrid::Voxel& voxel = voxels_[v];
        at_[v] = (grid_.mean(voxel) - grid_.origin()) / unit_;
        mass[v] = static_cast<float>(static_cast<double>(voxel.count) * (share * share * share));
        if (is_seen(v)) at_[point_of(v)] = (grid_.seen_mean(voxel) - grid_.origin()) / unit_;
      }
    });
    field_ = measure_field(device, at_, mass);
  }

  // Voxels whose points are as sparse as a sheet.
  void find_sparse() {
    for (std::size_t v = 0; v < voxels_.size(); ++v)
      if (is_seen(v) && field_.density[point_of(v)] < kSparse) sparse_.add(voxels_[v].key);
  }

  // How many of the voxels around one are sparse.
  int sparse_around(std::uint64_t key) const {
    const VoxelPlace c = place_of(key);
    int found = -1;  // without itself
    for (std::int64_t k = -1; k <= 1; ++k)
      for (std::int64_t j = -1; j <= 1; ++j)
        for (std::int64_t i = -1; i <= 1; ++i)
          found += sparse_.find(key_of({c[0] + i, c[1] + j, c[2] + k})) != kNone;
    return found;
  }

  bool is_loose(std::size_t v) const {
    const double density = field_.density[point_of(v)];
    return density < kLoose &&
           (density < kLayer * spacing_ / grid_.side() || sparse_around(voxels_[v].key) < kSheet);
  }

  // The seen voxels of a block: where many fronts were averaged first.
  std::vector<std::uint32_t> by_fronts(std::size_t block) const {
    std::vector<std::uint32_t> order;
    for (std::uint32_t v = blocks_.first[block]; v < blocks_.first[block + 1]; ++v)
      if (is_seen(v)) order.push_back(v);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return voxels_[a].seen != voxels_[b].seen ? voxels_[a].seen > voxels_[b].seen : a < b;
    });
    return order;
  }

  Vec3d below_front(std::size_t v) const {
    const Vec3d &p = at_[point_of(v)], &g = field_.gradient[point_of(v)];
    return p - (2 * length(g) > kFlat ? normalized(-g) : normalized(eye_ - p)) * inset_;
  }

  // Places a representative for what lies behind where a voxel is `wanted` and none is near.
  template <class Wanted, class Place>
  void keep_apart(double distance, const Wanted& wanted, const Place& place) {
    for_blocks_apart(blocks_, [&](std::size_t block) {
      for (std::uint32_t v = blocks_.first[block]; v < blocks_.first[block + 1]; ++v) {
        if (rest_[v] != Made::nothing || !wanted(v)) continue;
        const Vec3d representative = place(v), p = along_axes(representative);
        if (!inner_.is_apart(block, p, distance)) continue;
        inner_.keep(block, p, voxels_.size() + v);
        at_[v] = representative;
        rest_[v] = Made::behind;
      }
    });
  }

  const VoxelGrid& grid_;
  double radius_, spacing_;  // of the particles, world units
  double unit_;              // radius of the representatives, world units
  Vec3d eye_;
  double inset_;  // from the fronts to the representatives
  std::vector<VoxelGrid::Voxel> voxels_;
  std::vector<std::uint32_t> number_;  // [voxels] of its point; kNone: nothing of it is seen
  std::vector<Vec3d> at_;              // [voxels + points] means; then where representatives lie
  FieldAt field_;                      // [voxels + points]
  KeyTable sparse_;
  std::vector<Made> front_, rest_;  // [voxels] what stands for what is seen, and for the rest
  VoxelBlocks blocks_;
  ApartPoints inner_;  // all representatives
};

}  // namespace

Thinned thin_particles(Device& device, const VoxelGrid& grid, double radius, const Vec3d& eye,
                       double offset) {
  if (grid.size() == 0) {
    Thinned nothing;
    nothing.particles.moving = grid.moving();
    return nothing;
  }
  Representatives representatives(device, grid, radius, eye, offset);
  representatives.place_seen();
  representatives.place_unseen();
  representatives.place_inside();
  return representatives.in_world();
}

}  // namespace meniscus
