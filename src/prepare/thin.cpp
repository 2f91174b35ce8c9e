#include "prepare/thin.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/exact_math.hpp"
#include "stages/cells.hpp"
#include "stages/density.hpp"

namespace meniscus {
namespace {

// Rows of a rotation: (2 3 6), (3 -6 2), (6 2 -3) over 7.
const std::array<Vec3d, 3> kAxes{Vec3d{2, 3, 6} / 7, Vec3d{3, -6, 2} / 7, Vec3d{6, 2, -3} / 7};

constexpr double kUnit = 1 << 20;                  // steps of a place in a voxel, per side
constexpr std::int64_t kFarthest = (1 << 20) - 1;  // voxels from the origin along an axis
constexpr std::uint64_t kMask = (1 << 21) - 1;

std::uint64_t key_of(const std::array<std::int64_t, 3>& cell) {
  std::uint64_t key = 0;
  for (const std::int64_t c : cell) key = key << 21 | static_cast<std::uint64_t>(c + kFarthest);
  return key;
}

std::array<std::int64_t, 3> voxel_at(std::uint64_t key) {
  std::array<std::int64_t, 3> cell{};
  for (std::size_t a = 0; a < 3; ++a)
    cell[a] = static_cast<std::int64_t>(key >> (42 - 21 * a) & kMask) - kFarthest;
  return cell;
}

// What the field of the voxels' masses says at some points: value and gradient (1 / radii).
struct FieldAt {
  std::vector<double> density;
  std::vector<Vec3d> gradient;
};

// The density field of point masses (positions in radii of the representatives; a mass of 1 fills a
// cube of two radii) at the masses and at further points.
FieldAt measure_field(Device& device, const std::vector<Vec3d>& masses,
                      const std::vector<double>& mass, const std::vector<Vec3d>& points) {
  std::vector<Vec3d> all = masses;
  all.insert(all.end(), points.begin(), points.end());
  const std::size_t n = all.size();
  std::vector<float> weight(n, 0.0f);
  for (std::size_t k = 0; k < mass.size(); ++k) weight[k] = static_cast<float>(mass[k]);
  const Cells cells = make_cells(all, kDensitySupport);
  std::vector<float> in_order(n);
  for (std::size_t p = 0; p < n; ++p) in_order[p] = weight[static_cast<std::size_t>(cells.item[p])];
  DeviceCells field = upload_cells(device, cells);
  field.weight = upload(device, in_order);
  const std::vector<float> values = download(device, measure_gradients(device, field));
  FieldAt at{std::vector<double>(n), std::vector<Vec3d>(n)};
  for (std::size_t p = 0; p < n; ++p) {
    const std::size_t k = static_cast<std::size_t>(cells.item[p]);
    at.gradient[k] = {values[p], values[n + p], values[2 * n + p]};
    at.density[k] = values[3 * n + p];
  }
  return at;
}

// How deep below a flat face the density field has a value, in S, from 0 (density 1/2) to 1 (.967):
// the integral over a half space of the cubic spline, which the field follows within .0005, is 1/2
// + .7 d - d^3/3 + .15 d^5 - .05 d^6.
double depth_of(double density) {
  double low = 0, high = 1;
  for (int k = 0; k < 20; ++k) {
    const double d = (low + high) / 2, cube = d * d * d;
    (0.5 + 0.7 * d - cube / 3 + 0.15 * cube * d * d - 0.05 * cube * cube < density ? low : high) =
        d;
  }
  return low;
}

// Points of which no two lie nearer than a distance.
class ApartPoints {
 public:
  explicit ApartPoints(double distance) : distance_(distance) {}

  /// Whether a point lies at least `distance` from all that were kept.
  bool is_apart(const Vec3d& p, double distance) const {
    const std::array<std::int64_t, 3> c = cell(p);
    for (std::int64_t k = -1; k <= 1; ++k)
      for (std::int64_t j = -1; j <= 1; ++j)
        for (std::int64_t i = -1; i <= 1; ++i) {
          const auto found = points_.find(key_of({c[0] + i, c[1] + j, c[2] + k}));
          if (found == points_.end()) continue;
          for (const Vec3d& q : found->second)
            if (length(q - p) < distance) return false;
        }
    return true;
  }
  void keep(const Vec3d& p) { points_[key_of(cell(p))].push_back(p); }

 private:
  std::array<std::int64_t, 3> cell(const Vec3d& p) const {
    return {static_cast<std::int64_t>(std::floor(p.x / distance_)),
            static_cast<std::int64_t>(std::floor(p.y / distance_)),
            static_cast<std::int64_t>(std::floor(p.z / distance_))};
  }
  double distance_;  // the largest that is asked for
  std::unordered_map<std::uint64_t, std::vector<Vec3d>> points_;
};

}  // namespace

void VoxelGrid::add(float x, float y, float z, bool seen, const Vec3& velocity) {
  const Vec3d p = (Vec3d{x, y, z} - origin_) / side_;
  std::array<std::int64_t, 3> cell{}, place{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double along = dot(kAxes[a], p), most = static_cast<double>(kFarthest);
    const double inside = std::clamp(along, -most, most);
    // Its floor, without the call that std::floor is where the processor may be an old one.
    cell[a] = static_cast<std::int64_t>(inside);
    cell[a] -= static_cast<double>(cell[a]) > inside;
    place[a] = static_cast<std::int64_t>((inside - static_cast<double>(cell[a])) * kUnit);
  }
  // Particles that follow each other in a file are often neighbours.
  const std::uint64_t key = key_of(cell);
  if (!last_ || last_->key != key) {
    last_ = &voxels_[key];
    last_->key = key;
  }
  Voxel& voxel = *last_;
  ++voxel.count;
  for (std::size_t a = 0; a < 3; ++a) voxel.sum[a] += place[a];
  if (seen) {
    ++voxel.seen;
    for (std::size_t a = 0; a < 3; ++a) voxel.seen_sum[a] += place[a];
  }
  if (!is_known(velocity)) return;
  constexpr double kMost = (1 << 18) * kUnit;
  const std::array<float, 3> v{velocity.x, velocity.y, velocity.z};
  voxel.moving += 1;
  voxel.seen_moving += seen;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t units = std::llround(std::clamp(v[a] / side_ * kUnit, -kMost, kMost));
    voxel.velocity[a] += units;
    if (seen) voxel.seen_velocity[a] += units;
  }
}

void VoxelGrid::add(const Voxel& voxel) {
  Voxel& sums = voxels_[voxel.key];
  sums.key = voxel.key;
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

std::vector<VoxelGrid::Voxel> VoxelGrid::voxels() const {
  std::vector<Voxel> all;
  all.reserve(voxels_.size());
  for (const auto& [key, voxel] : voxels_) all.push_back(voxel);
  std::sort(all.begin(), all.end(), [](const Voxel& a, const Voxel& b) { return a.key < b.key; });
  return all;
}

Vec3d VoxelGrid::position(const Voxel& voxel, const std::array<std::int64_t, 3>& sum,
                          std::int64_t count) const {
  const std::array<std::int64_t, 3> cell = voxel_at(voxel.key);
  Vec3d p = origin_;
  for (std::size_t a = 0; a < 3; ++a) {
    const double place = (static_cast<double>(sum[a]) / static_cast<double>(count) + 0.5) / kUnit;
    p += kAxes[a] * (side_ * (static_cast<double>(cell[a]) + place));
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

Thinned thin_particles(Device& device, const VoxelGrid& grid, double radius, const Vec3d& eye,
                       double offset) {
  // Density below which a representative may be loose: what a drop of .4 S^3 has at its centre, and
  // a sheet a fifth of S thick. Sheets are told by their neighbours, of which so many are as
  // sparse, and by half of what one layer of particles has at least, .7 s / S.
  constexpr double kLoose = 0.12, kSparse = 0.3, kLayer = 0.35;
  constexpr int kSheet = 4;
  // Representatives lie this far apart at least, those behind the surface from it; these are
  // deeper than .4 S in the fluid. In S.
  constexpr double kApart = 0.65, kBehind = 0.75, kInside = 0.8;
  constexpr double kSurface = 0.7, kSteep = 0.2;  // of means of the surface: S; 1 / S
  constexpr double kFlat = 0.05;                  // a gradient that tells no direction, 1 / S

  const std::vector<VoxelGrid::Voxel> voxels = grid.voxels();
  const double side = grid.side(), unit = side / 2, spacing = 2 * radius, share = spacing / side;
  std::vector<Vec3d> masses, points;
  std::vector<double> mass;
  std::vector<std::size_t> voxel_of;  // of each point
  for (std::size_t k = 0; k < voxels.size(); ++k) {
    const VoxelGrid::Voxel& voxel = voxels[k];
    masses.push_back((grid.mean(voxel) - grid.origin()) / unit);
    mass.push_back(static_cast<double>(voxel.count) * (share * share * share));
    if (voxel.seen == 0) continue;
    points.push_back((grid.seen_mean(voxel) - grid.origin()) / unit);
    voxel_of.push_back(k);
  }
  Thinned thinned;
  thinned.particles.moving = grid.moving();
  if (masses.empty()) return thinned;
  const FieldAt field = measure_field(device, masses, mass, points);
  const std::size_t first_point = masses.size();

  // Points as sparse as a sheet, by voxel.
  std::unordered_map<std::uint64_t, bool> sparse;
  for (std::size_t k = 0; k < points.size(); ++k)
    if (field.density[first_point + k] < kSparse) sparse[voxels[voxel_of[k]].key] = true;
  const auto sparse_around = [&](std::uint64_t key) {
    const std::array<std::int64_t, 3> c = voxel_at(key);
    int found = -1;  // without itself
    for (std::int64_t k = -1; k <= 1; ++k)
      for (std::int64_t j = -1; j <= 1; ++j)
        for (std::int64_t i = -1; i <= 1; ++i)
          found += sparse.contains(key_of({c[0] + i, c[1] + j, c[2] + k}));
    return found;
  };

  // Where many fronts were averaged first.
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return voxels[voxel_of[a]].seen > voxels[voxel_of[b]].seen;
  });
  const auto put = [&](const Vec3d& p, const Vec3& velocity) {
    const Vec3d world = p * unit + grid.origin();
    thinned.particles.x.push_back(static_cast<float>(world.x));
    thinned.particles.y.push_back(static_cast<float>(world.y));
    thinned.particles.z.push_back(static_cast<float>(world.z));
    if (grid.moving()) thinned.particles.velocity.push_back(velocity);
  };
  // The surface that the camera sees: from the fronts' depth of `radius` to that of half of S.
  const double inset = offset * (unit - radius) / unit;
  ApartPoints seen(2 * kApart), inner(2 * kBehind);
  for (const std::size_t k : order) {
    const VoxelGrid::Voxel& voxel = voxels[voxel_of[k]];
    const double density = field.density[first_point + k];
    if (density < kLoose &&
        (density < kLayer * spacing / side || sparse_around(voxel.key) < kSheet)) {
      thinned.spray.push_back({grid.mean(voxel),
                               radius * cube_root(static_cast<double>(voxel.count)),
                               grid.mean_velocity(voxel)});
      continue;
    }
    if (!seen.is_apart(points[k], 2 * kApart)) continue;
    seen.keep(points[k]);
    const Vec3d g = field.gradient[first_point + k];
    const Vec3d to_eye = normalized((eye - grid.origin()) / unit - points[k]);
    const Vec3d normal = 2 * length(g) > kFlat ? normalized(-g) : to_eye;
    const Vec3d below = points[k] - normal * inset;
    inner.keep(below);
    put(below, grid.seen_mean_velocity(voxel));
  }
  // The surface that it does not see, from how deep below it the voxels' means lie.
  for (std::size_t k = 0; k < masses.size(); ++k) {
    if (field.density[k] < kLoose) continue;
    const Vec3d g = field.gradient[k];
    const double depth = depth_of(field.density[k]);
    if (depth > kSurface || 2 * length(g) < kSteep) continue;
    const Vec3d below = masses[k] - normalized(-g) * (1 - 2 * depth);
    if (!inner.is_apart(below, 2 * kApart)) continue;
    inner.keep(below);
    put(below, grid.mean_velocity(voxels[k]));
  }
  // What lies behind both.
  for (std::size_t k = 0; k < masses.size(); ++k)
    if (field.density[k] >= kInside && inner.is_apart(masses[k], 2 * kBehind))
      put(masses[k], grid.mean_velocity(voxels[k]));
  return thinned;
}

}  // namespace meniscus
