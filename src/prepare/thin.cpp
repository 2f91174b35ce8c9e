#include "prepare/thin.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/exact_math.hpp"
#include "base/parallel.hpp"
#include "prepare/apart_points.hpp"
#include "stages/cells.hpp"
#include "stages/density.hpp"

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
// mass of 1 fills a cube of two radii; one of 0 asks alone).
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

}  // namespace

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
  const std::size_t n = voxels.size();
  const double side = grid.side(), unit = side / 2, spacing = 2 * radius, share = spacing / side;
  Thinned thinned;
  thinned.particles.moving = grid.moving();
  if (n == 0) return thinned;
  // The voxels' means, then the points: the means of their fronts.
  std::vector<std::uint32_t> point_of(n, kNone);  // of each voxel, where it has one
  std::uint32_t points = 0;
  for (std::size_t v = 0; v < n; ++v)
    if (voxels[v].seen > 0) point_of[v] = points++;
  std::vector<Vec3d> at(n + points);
  std::vector<float> mass(at.size(), 0.0f);
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const VoxelGrid::Voxel& voxel = voxels[v];
      at[v] = (grid.mean(voxel) - grid.origin()) / unit;
      mass[v] = static_cast<float>(static_cast<double>(voxel.count) * (share * share * share));
      if (point_of[v] != kNone)
        at[n + point_of[v]] = (grid.seen_mean(voxel) - grid.origin()) / unit;
    }
  });
  const FieldAt field = measure_field(device, at, mass);

  // Voxels whose points are as sparse as a sheet.
  KeyTable sparse;
  for (std::size_t v = 0; v < n; ++v)
    if (point_of[v] != kNone && field.density[n + point_of[v]] < kSparse) sparse.add(voxels[v].key);
  const auto sparse_around = [&](std::uint64_t key) {
    const VoxelPlace c = place_of(key);
    int found = -1;  // without itself
    for (std::int64_t k = -1; k <= 1; ++k)
      for (std::int64_t j = -1; j <= 1; ++j)
        for (std::int64_t i = -1; i <= 1; ++i)
          found += sparse.find(key_of({c[0] + i, c[1] + j, c[2] + k})) != kNone;
    return found;
  };
  const auto is_loose = [&](std::size_t v) {
    const double density = field.density[n + point_of[v]];
    return density < kLoose &&
           (density < kLayer * spacing / side || sparse_around(voxels[v].key) < kSheet);
  };

  // Each voxel may get a representative for what is seen of it, and one for what lies behind that.
  // Where they lie takes the place of the means.
  enum class Made : std::uint8_t { nothing, drop, seen, behind };
  std::vector<Made> front(n, Made::nothing), rest(n, Made::nothing);
  const VoxelBlocks blocks(voxels);
  ApartPoints seen(blocks, n), inner(blocks, 2 * n);
  const auto along_axes = [&](const Vec3d& p) { return grid.along_axes(p * unit + grid.origin()); };
  // The surface that the camera sees: from the fronts' depth of `radius` to that of half of S.
  const double inset = offset * (unit - radius) / unit;
  const auto below_front = [&](std::size_t v) {
    const Vec3d &p = at[n + point_of[v]], &g = field.gradient[n + point_of[v]];
    const Vec3d to_eye = normalized((eye - grid.origin()) / unit - p);
    return p - (2 * length(g) > kFlat ? normalized(-g) : to_eye) * inset;
  };
  for_blocks_apart(blocks, [&](std::size_t block) {
    std::vector<std::uint32_t> order;
    for (std::uint32_t v = blocks.first[block]; v < blocks.first[block + 1]; ++v)
      if (point_of[v] != kNone) order.push_back(v);
    // Where many fronts were averaged first.
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return voxels[a].seen != voxels[b].seen ? voxels[a].seen > voxels[b].seen : a < b;
    });
    for (const std::uint32_t v : order) {
      if (is_loose(v)) {
        front[v] = Made::drop;
        continue;
      }
      Vec3d& place = at[n + point_of[v]];
      const Vec3d p = along_axes(place);
      if (!seen.is_apart(block, p, kApart)) continue;
      seen.keep(block, p, v);
      place = below_front(v);
      inner.keep(block, along_axes(place), v);
      front[v] = Made::seen;
    }
  });
  // The surface that it does not see, from how deep below it the voxels' means lie.
  const auto is_behind = [&](std::size_t v) {
    return field.density[v] >= kLoose && field.density[v] <= density_at(kSurface) &&
           2 * length(field.gradient[v]) >= kSteep;
  };
  const auto below_mean = [&](std::size_t v) {
    return at[v] - normalized(-field.gradient[v]) * (1 - 2 * depth_of(field.density[v]));
  };
  const auto keep_apart = [&](double distance, const auto& wanted, const auto& place) {
    for_blocks_apart(blocks, [&](std::size_t block) {
      for (std::uint32_t v = blocks.first[block]; v < blocks.first[block + 1]; ++v) {
        if (rest[v] != Made::nothing || !wanted(v)) continue;
        const Vec3d representative = place(v), p = along_axes(representative);
        if (!inner.is_apart(block, p, distance)) continue;
        inner.keep(block, p, n + v);
        at[v] = representative;
        rest[v] = Made::behind;
      }
    });
  };
  keep_apart(kApart, is_behind, below_mean);
  // What lies behind both.
  keep_apart(
      kBehind, [&](std::size_t v) { return field.density[v] >= kInside; },
      [&](std::size_t v) { return at[v]; });

  const auto put = [&](const Vec3d& p, const Vec3& velocity) {
    const Vec3d world = p * unit + grid.origin();
    thinned.particles.x.push_back(static_cast<float>(world.x));
    thinned.particles.y.push_back(static_cast<float>(world.y));
    thinned.particles.z.push_back(static_cast<float>(world.z));
    if (grid.moving()) thinned.particles.velocity.push_back(velocity);
  };
  for (std::size_t v = 0; v < n; ++v) {
    const VoxelGrid::Voxel& voxel = voxels[v];
    if (front[v] == Made::drop)
      thinned.spray.push_back({grid.mean(voxel),
                               radius * cube_root(static_cast<double>(voxel.count)),
                               grid.mean_velocity(voxel)});
    if (front[v] == Made::seen) put(at[n + point_of[v]], grid.seen_mean_velocity(voxel));
    if (rest[v] == Made::behind) put(at[v], grid.mean_velocity(voxel));
  }
  return thinned;
}

}  // namespace meniscus
