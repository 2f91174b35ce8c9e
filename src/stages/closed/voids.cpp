#include "stages/closed/voids.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <numbers>
#include <tuple>

#include "base/parallel.hpp"
#include "stages/frame/density.hpp"

namespace meniscus {
namespace {

// Lengths in spacings. Of evened particles 1 place in 200 inside the fluid is as far as kClear from
// all of them.
constexpr double kStep = 0.5;  // of the lattice of places that are tried
constexpr double kClear = 1;   // from a void to the nearest particle, at least
constexpr double kApart = 1;   // of voids
// Particles within kDensitySupport of a void, of as many as there are inside the fluid; in front of
// a face there are fewer than half. With .5 edges of thin water are rounded.
constexpr double kPacked = 0.6;
// Mean square of the cosines between the directions of these particles and any axis, at most. It is
// 1/3 inside the fluid, about .43 across a slit of a spacing, .48 across one of 1.5. With .44 voids
// close 8 % of a slit of 1.5 spacings, with .42 4 %, without this bound 29 %. With .38 pits stay.
constexpr double kFlattest = 0.42;

using LatticePlace = std::array<std::int64_t, 3>;

struct Candidate {
  LatticePlace place;
  double apart;  // from the nearest particle, squared
};

bool comes_before(const Candidate& a, const Candidate& b) {
  return std::tie(a.place[2], a.place[1], a.place[0]) <
         std::tie(b.place[2], b.place[1], b.place[0]);
}

// The places of the lattice in a cell of side kDensitySupport.
struct PlacesOfCell {
  PlacesOfCell(const LatticePlace& cell, double steps) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double low = static_cast<double>(cell[axis]);
      first[axis] = static_cast<std::int64_t>(std::ceil(low * steps));
      end[axis] = static_cast<std::int64_t>(std::ceil((low + 1) * steps));
    }
    marks.resize(
        static_cast<std::size_t>((end[0] - first[0]) * (end[1] - first[1]) * (end[2] - first[2])));
  }
  char& covered(const LatticePlace& at) {
    return marks[static_cast<std::size_t>(
        ((at[2] - first[2]) * (end[1] - first[1]) + at[1] - first[1]) * (end[0] - first[0]) +
        at[0] - first[0])];
  }
  template <class Visit>
  void visit(const Visit& visit_place) {
    for (std::int64_t z = first[2]; z < end[2]; ++z)
      for (std::int64_t y = first[1]; y < end[1]; ++y)
        for (std::int64_t x = first[0]; x < end[0]; ++x)
          visit_place(LatticePlace{x, y, z}, covered({x, y, z}));
  }

  LatticePlace first, end;
  std::vector<char> marks;  // 1: a particle is near
};

// Sums of products of the coordinates of unit vectors.
struct Directions {
  double xx = 0, yy = 0, zz = 0, xy = 0, yz = 0, zx = 0;

  void add(const Vec3d& to, double per_square) {
    xx += to.x * to.x * per_square;
    yy += to.y * to.y * per_square;
    zz += to.z * to.z * per_square;
    xy += to.x * to.y * per_square;
    yz += to.y * to.z * per_square;
    zx += to.z * to.x * per_square;
  }
  // Whether the sum of squares along no axis is `most` or more: `most` times the unit matrix less
  // that of the sums is positive definite.
  bool are_around(double most) const {
    const double x = most - xx, y = most - yy, z = most - zz;
    return x > 0 && x * y > xy * xy &&
           x * (y * z - yz * yz) - xy * (xy * z + yz * zx) - zx * (xy * yz + y * zx) > 0;
  }
};

class VoidFinder {
 public:
  VoidFinder(const Cells& cells, const Disorder& disorder)
      : cells_(cells), spacing_(disorder.spacing / disorder.unit()) {}

  std::vector<Vec3d> find() const {
    const std::vector<Candidate> candidates = all_candidates();
    std::vector<Vec3d> places, voids;
    for (const Candidate& candidate : candidates) places.push_back(position(candidate.place));
    const Cells near = make_cells(places, static_cast<float>(kApart * spacing_));
    for (std::size_t c = 0; c < candidates.size(); ++c)
      if (is_emptiest(candidates, near, places, c)) voids.push_back(places[c]);
    return voids;
  }

 private:
  Vec3d position(const LatticePlace& at) const {
    const double step = kStep * spacing_;
    return {step * static_cast<double>(at[0]), step * static_cast<double>(at[1]),
            step * static_cast<double>(at[2])};
  }

  // A void near which no cell has a particle is none: all lie in cells that have some.
  std::vector<Candidate> all_candidates() const {
    constexpr std::size_t kGrain = 256;  // buckets that are worth a thread
    std::mutex joining;
    std::vector<Candidate> all;
    parallel_for(cells_.start.size() - 1, kGrain, [&](std::size_t begin, std::size_t end) {
      std::vector<Candidate> own;
      for (std::size_t bucket = begin; bucket < end; ++bucket) add_in_bucket(bucket, own);
      const std::scoped_lock lock(joining);
      all.insert(all.end(), own.begin(), own.end());
    });
    std::sort(all.begin(), all.end(), comes_before);
    return all;
  }

  // Those in the cells of a bucket, each cell once.
  void add_in_bucket(std::size_t bucket, std::vector<Candidate>& candidates) const {
    std::vector<LatticePlace> seen;
    for (std::int32_t p = cells_.start[bucket]; p < cells_.start[bucket + 1]; ++p) {
      const auto k = static_cast<std::size_t>(p);
      const LatticePlace cell{cell_of(cells_.x[k], cells_.inverse_cell),
                              cell_of(cells_.y[k], cells_.inverse_cell),
                              cell_of(cells_.z[k], cells_.inverse_cell)};
      if (std::find(seen.begin(), seen.end(), cell) != seen.end()) continue;
      seen.push_back(cell);
      add_in_cell(cell, candidates);
    }
  }

  void add_in_cell(const LatticePlace& cell, std::vector<Candidate>& candidates) const {
    PlacesOfCell places(cell, kDensitySupport / (kStep * spacing_));
    const auto middle = [&](std::size_t axis) {
      return (static_cast<float>(cell[axis]) + 0.5f) / cells_.inverse_cell;
    };
    int count = 0;
    visit_near(cells_, middle(0), middle(1), middle(2), [&](std::int32_t p) {
      ++count;
      cover(static_cast<std::size_t>(p), places);
      return true;
    });
    if (packing(count) < kPacked) return;  // as for most spray
    places.visit([&](const LatticePlace& place, char covered) {
      if (covered == 0) add_if_void(place, candidates);
    });
  }

  // Marks the places to which a particle is near.
  void cover(std::size_t p, PlacesOfCell& places) const {
    const double step = kStep * spacing_, reach = kClear * spacing_;
    const std::array<double, 3> at{cells_.x[p], cells_.y[p], cells_.z[p]};
    LatticePlace first, end;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double low = (at[axis] - reach) / step, high = (at[axis] + reach) / step;
      if (high < static_cast<double>(places.first[axis]) ||
          low > static_cast<double>(places.end[axis] - 1))
        return;
      // Cut towards zero and wider by one: none is missed.
      first[axis] = std::max(places.first[axis], static_cast<std::int64_t>(low) - 1);
      end[axis] = std::min(places.end[axis], static_cast<std::int64_t>(high) + 2);
    }
    for (std::int64_t z = first[2]; z < end[2]; ++z)
      for (std::int64_t y = first[1]; y < end[1]; ++y) {
        char* const row = &places.covered({first[0], y, z});
        const Vec3d to = position({first[0], y, z}) - Vec3d(at[0], at[1], at[2]);
        const double across = to.y * to.y + to.z * to.z;
        if (across >= reach * reach) continue;
        for (std::int64_t x = 0; x < end[0] - first[0]; ++x) {
          const double along = to.x + step * static_cast<double>(x);
          row[x] |= static_cast<char>(along * along + across < reach * reach);
        }
      }
  }

  // So many particles within kDensitySupport, as a share of how many are inside the fluid.
  double packing(int count) const {
    constexpr double kVolume =
        4.0 / 3 * std::numbers::pi * kDensitySupport * kDensitySupport * kDensitySupport;
    return count * spacing_ * spacing_ * spacing_ / kVolume;
  }

  // A place that no particle is near to.
  void add_if_void(const LatticePlace& place, std::vector<Candidate>& candidates) const {
    const Vec3d at = position(place);
    int count = 0;
    double nearest = kDensitySupport * kDensitySupport;
    Directions directions;
    visit_near(cells_, static_cast<float>(at.x), static_cast<float>(at.y), static_cast<float>(at.z),
               [&](std::int32_t p) {
                 const auto k = static_cast<std::size_t>(p);
                 const Vec3d to = Vec3d(cells_.x[k], cells_.y[k], cells_.z[k]) - at;
                 const double squared = dot(to, to);
                 if (squared >= kDensitySupport * kDensitySupport) return true;
                 ++count;
                 nearest = std::min(nearest, squared);
                 directions.add(to, 1 / squared);
                 return true;
               });
    if (packing(count) >= kPacked && directions.are_around(kFlattest * count))
      candidates.push_back({place, nearest});
  }

  // Whether none within kApart is farther from all particles; of equals the first one counts.
  bool is_emptiest(const std::vector<Candidate>& candidates, const Cells& near,
                   const std::vector<Vec3d>& places, std::size_t c) const {
    const Vec3d& at = places[c];
    const double reach = kApart * spacing_;
    bool emptiest = true;
    visit_near(near, static_cast<float>(at.x), static_cast<float>(at.y), static_cast<float>(at.z),
               [&](std::int32_t p) {
                 const auto other =
                     static_cast<std::size_t>(near.item[static_cast<std::size_t>(p)]);
                 const Vec3d to = places[other] - at;
                 if (dot(to, to) >= reach * reach) return true;
                 emptiest = candidates[other].apart < candidates[c].apart ||
                            (candidates[other].apart == candidates[c].apart && other >= c);
                 return emptiest;
               });
    return emptiest;
  }

  const Cells& cells_;
  double spacing_;  // in the unit of length
};

}  // namespace

std::vector<Vec3d> find_voids(const Cells& cells, const Disorder& disorder) {
  return VoidFinder(cells, disorder).find();
}

// A candidate of so many spacings around counts, and of these those around each.
double void_influence(const Disorder& disorder) {
  return kApart * disorder.spacing / disorder.unit() + kDensitySupport;
}

}  // namespace meniscus
