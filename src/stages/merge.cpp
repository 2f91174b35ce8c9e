#include "stages/merge.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/parallel.hpp"
#include "stages/cells.hpp"

namespace meniscus {
namespace {

constexpr double kBendReach = 5;  // within which bends are measured, particle radii
constexpr double kCalmBend = 0.003, kTightBend = 0.03;  // mean of 1 - n.n': largest, least groups
constexpr double kFullReach = 0.95;  // share of its radius within which a group takes in wholly
constexpr float kOther = 0.6f, kSame = 0.8f;      // n.n' of other groups and of the same
constexpr float kBeside = 0.9f, kAbove = 1.4f;    // heights in the same layer and in another
constexpr double kOpenFrom = 0.5, kOpenTo = 0.8;  // u of particles that take others in
constexpr double kTie = 0.02;                     // ranks this near are about equal
constexpr double kLattice = 3.6;                  // between the ranks' maxima, particle radii
constexpr double kGone = 0.35;                   // W of groups that are taken in
constexpr double kSettled = 1e-3;                 // change of W that ends the sweeps
constexpr int kMostSweeps = 8;                    // near ties alone want more than one
constexpr std::size_t kGrain = 256;               // particles that are worth a thread

// A particle to merge.
struct Member {
  float x, y, z;     // eye space, particle radii
  float nx, ny, nz;  // unit
  float weight;      // u
  float takes;       // how far it may take others in
  float rank;        // by its place in the world
};

// Another one within reach of a particle, in the same layer.
struct Near {
  std::int32_t other;
  float distance;  // particle radii
  float alike;     // 0: of another sheet .. 1
};

// The lists of some particles.
struct Block {
  std::vector<std::uint32_t> start;  // [particles + 1]
  std::vector<Near> near;
};

// A wave with level ends: 0 at whole x, 1 halfway.
double wave(double x) {
  const double t = x - std::floor(x), p = 4 * t * (1 - t);
  return p * p * (3 - 2 * p);
}

// Waves along three directions at right angles that no lattice of particles has.
double rank_of(const Vec3d& world) {
  const Vec3d x = world / kLattice;
  return wave(0.7071 * x.x + 0.5412 * x.y + 0.4551 * x.z) +
         wave(-0.6533 * x.x + 0.7511 * x.y + 0.0951 * x.z) +
         wave(-0.2903 * x.x - 0.3645 * x.y + 0.8848 * x.z);
}

std::vector<Member> members_of(const View& view, const Projected& projected, const Visible& rim,
                               const SurfaceParticles& around) {
  const std::vector<std::int32_t> place = places_in(around.index, rim.index);
  std::vector<Member> members(rim.index.size());
  parallel_for(members.size(), 4 * kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t i = static_cast<std::size_t>(rim.index[k]);
      const std::size_t p = static_cast<std::size_t>(place[k]);
      const Vec3d& n = around.normal[p];
      const double rank = rank_of(world_direction(view, projected.eye(i) - view.shift));
      members[k] = {projected.x[i],
                    projected.y[i],
                    projected.z[i],
                    static_cast<float>(n.x),
                    static_cast<float>(n.y),
                    static_cast<float>(n.z),
                    static_cast<float>(around.weight[p]),
                    static_cast<float>(smooth_step(kOpenFrom, kOpenTo, around.weight[p])),
                    static_cast<float>(rank)};
    }
  });
  return members;
}

// Who lies near each particle, and how far each takes in others.
struct Surroundings {
  std::vector<Block> blocks;  // of kGrain particles
  std::vector<float> extent;  // [particles] R, particle radii

  // Calls visit(near) for those near particle k.
  template <class Visit>
  void visit(std::size_t k, const Visit& visit_near) const {
    const Block& block = blocks[k / kGrain];
    for (std::uint32_t p = block.start[k % kGrain]; p < block.start[k % kGrain + 1]; ++p)
      visit_near(block.near[p]);
  }
};

// The share of a group's radius up to which it takes in.
double within(double distance, double extent) {
  return 1 - smooth_step(kFullReach, 1, distance / extent);
}

Surroundings look_around(const Projected& projected, const Visible& rim,
                         const std::vector<Member>& members, const MergeParams& params) {
  const std::size_t n = members.size();
  const double widest = std::max(params.reach, params.least_reach);
  const float reach = static_cast<float>(std::max(kBendReach, widest));
  const Cells cells = cells_of(projected, rim.index, reach);
  Surroundings result{std::vector<Block>((n + kGrain - 1) / kGrain), std::vector<float>(n)};
  NearFinder* const find = near_finders()[0];
  const auto look = [&](std::size_t k, std::vector<std::int32_t>& found, Block& block) {
    const Member& own = members[k];
    const std::array at{own.x, own.y, own.z};
    std::size_t number = 0;
    visit_ranges_near(
        cells, at[0], at[1], at[2], [&](std::int32_t first, std::int32_t last, std::uint32_t tag) {
          const std::size_t most = number + static_cast<std::size_t>(last - first) + kNearRoom;
          if (found.size() < most) found.resize(2 * most);
          number += find(cells, first, last, tag, at, reach * reach, found.data() + number);
          return true;
        });
    float all = 1e-9f, bend = 0;
    for (std::size_t f = 0; f < number; ++f) {
      if (found[f] == static_cast<std::int32_t>(k)) continue;
      const Member& other = members[static_cast<std::size_t>(found[f])];
      const float x = other.x - own.x, y = other.y - own.y, z = other.z - own.z;
      const float squared = x * x + y * y + z * z;
      const float same = own.nx * other.nx + own.ny * other.ny + own.nz * other.nz;
      const float d = std::max(1 - squared / static_cast<float>(kBendReach * kBendReach), 0.0f);
      if (!(same > kOther)) continue;
      float alike = 1;
      if (same < kSame) alike = static_cast<float>(smooth_step(kOther, kSame, same));
      const float w = other.weight * alike * d * d;
      all += w;
      bend += w * (1 - same);
      if (!(squared < widest * widest)) continue;
      // The mean normal's length is sqrt((1 + n.n') / 2).
      const float along =
          x * (own.nx + other.nx) + y * (own.ny + other.ny) + z * (own.nz + other.nz);
      const float square = along * along / (2 * (1 + same));  // of the height
      if (!(square < kAbove * kAbove)) continue;
      if (square > kBeside * kBeside)
        alike *= static_cast<float>(1 - smooth_step(kBeside, kAbove, std::sqrt(square)));
      if (alike > 0) block.near.push_back({found[f], std::sqrt(squared), alike});
    }
    const double calm = 1 - smooth_step(kCalmBend, kTightBend, bend / all);
    result.extent[k] =
        static_cast<float>(params.least_reach + (params.reach - params.least_reach) * calm);
  };
  parallel_for(result.blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
    std::vector<std::int32_t> found;
    for (std::size_t b = begin; b < end; ++b) {
      Block& block = result.blocks[b];
      block.near.reserve(16 * kGrain);
      block.start.push_back(0);
      for (std::size_t k = b * kGrain; k < std::min(n, (b + 1) * kGrain); ++k) {
        look(k, found, block);
        block.start.push_back(static_cast<std::uint32_t>(block.near.size()));
      }
    }
  });
  return result;
}

// What is left of each particle's own group when nothing merges any more, W.
std::vector<float> merge_until_settled(const std::vector<Member>& members,
                                       const Surroundings& around) {
  struct Taker {
    std::int32_t group;
    float takes;  // t
  };
  const std::size_t n = members.size();
  std::vector<std::size_t> first(n + 1, 0);
  std::vector<Taker> takers;
  for (std::size_t k = 0; k < n; ++k) {
    around.visit(k, [&](const Near& near) {
      const std::size_t j = static_cast<std::size_t>(near.other);
      const double lead = double{members[j].rank} - members[k].rank;
      const double extent = std::min(around.extent[k], around.extent[j]);
      if (!(lead > -kTie) || !(near.distance < extent)) return;
      double takes = double{near.alike} * members[j].takes;
      if (near.distance > kFullReach * extent) takes *= within(near.distance, extent);
      if (lead < kTie) takes *= smooth_step(-kTie, kTie, lead);
      if (takes > 0) takers.push_back({near.other, static_cast<float>(takes)});
    });
    first[k + 1] = takers.size();
  }
  std::vector<std::int32_t> order(n);
  for (std::size_t k = 0; k < n; ++k) order[k] = static_cast<std::int32_t>(k);
  std::sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) {
    const float rank_a = members[static_cast<std::size_t>(a)].rank,
                rank_b = members[static_cast<std::size_t>(b)].rank;
    return rank_a > rank_b || (rank_a == rank_b && a < b);
  });
  std::vector<float> left(n, 1.0f);
  float change = 1;
  for (int sweep = 0; sweep < kMostSweeps && change > kSettled; ++sweep) {
    change = 0;
    for (const std::int32_t item : order) {
      const std::size_t k = static_cast<std::size_t>(item);
      float own = 1;
      for (std::size_t p = first[k]; p < first[k + 1]; ++p)
        own *= 1 - left[static_cast<std::size_t>(takers[p].group)] * takers[p].takes;
      change = std::max(change, std::abs(own - left[k]));
      left[k] = own;
    }
  }
  return left;
}

}  // namespace

MergedGroups merge_particles(const View& view, const Projected& projected, const Visible& rim,
                             const SurfaceParticles& around, const MergeParams& params) {
  const std::vector<Member> members = members_of(view, projected, rim, around);
  const Surroundings surroundings = look_around(projected, rim, members, params);
  const std::vector<float> left = merge_until_settled(members, surroundings);
  MergedGroups groups;
  for (std::size_t k = 0; k < members.size(); ++k) {
    if (!(left[k] > kGone)) continue;
    // A group is seen as far as its members are.
    double owned = rim.owned[k];
    surroundings.visit(k, [&](const Near& near) {
      const double others = rim.owned[static_cast<std::size_t>(near.other)];
      if (others <= owned) return;
      owned = std::max(owned, others * within(near.distance, surroundings.extent[k]) * near.alike *
                                  members[k].takes);
    });
    groups.seed.index.push_back(rim.index[k]);
    groups.seed.owned.push_back(static_cast<float>(owned));
    groups.share.push_back((left[k] - kGone) / (1 - kGone));
    groups.extent.push_back(surroundings.extent[k]);
  }
  return groups;
}

}  // namespace meniscus
