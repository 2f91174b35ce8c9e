#include "stages/sheet/merge.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>

#include "base/all_true.hpp"
#include "base/parallel.hpp"

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
constexpr double kGone = 0.35;                    // W of groups that are taken in
constexpr double kSettled = 1e-3;                 // change of W that ends the sweeps
constexpr int kMostSweeps = 8;                    // near ties alone want more than one
constexpr std::size_t kGrain = 1024;              // particles that are worth a thread

// A particle of the surface.
struct Member {
  float x, y, z;            // eye space, particle radii
  float weight;             // u
  float nx, ny, nz;         // unit; zero: does not merge
  float takes;              // how far it may take others in
  float rank;               // by its place in the world, not negative
  float taking_rank;        // the same; -1 where it takes in nobody
  std::int32_t index = -1;  // in Visible
};

// Others near a particle whose normals are like its own, and room to work with them.
struct Alike {
  std::size_t count = 0;                   // the vectors may be longer
  std::vector<cl_int> place;               // in the surface
  std::vector<float> same;                 // n.n'
  std::vector<float> apart;                // squared distance, particle radii^2
  std::vector<float> weight, taking_rank;  // as in Member
  std::vector<double> between;             // kOther 0 .. kSame 1
  std::vector<float> counts;               // how much each does for the mean bend
  std::vector<std::uint32_t> chosen;       // some of them

  void make_room(std::size_t most) {
    if (place.size() >= most) return;
    most *= 2;
    place.resize(most);
    for (auto* row : {&same, &apart, &weight, &taking_rank, &counts}) row->resize(most);
    between.resize(most);
    chosen.resize(most);
  }
};

// One that takes a particle in if it reaches it.
struct Candidate {
  std::int32_t group;
  float apart;   // as in Alike
  double takes;  // t where it reaches far
};

// One that does.
struct Taker {
  std::int32_t group;
  float takes;  // t
};

// Lists of some particles.
template <class T>
struct Block {
  std::vector<std::uint32_t> start;  // [particles + 1]
  std::vector<T> entry;
};

// Lists of all particles, in the blocks of NearLists.
template <class T>
using Lists = std::vector<Block<T>>;

// Makes the list of each of n particles: add(k, list) appends to it. Every thread takes a copy of
// `add`, which may hold room to work in.
template <class T, class Add>
Lists<T> make_lists(std::size_t n, const Add& add) {
  constexpr std::size_t kBlock = NearLists::kBlock;
  Lists<T> lists((n + kBlock - 1) / kBlock);
  parallel_for(lists.size(), 1, [&](std::size_t begin, std::size_t end) {
    Add own_add = add;
    for (std::size_t b = begin; b < end; ++b) {
      Block<T>& block = lists[b];
      block.entry.reserve(16 * kBlock);  // mostly enough
      block.start.push_back(0);
      for (std::size_t k = b * kBlock; k < std::min(n, (b + 1) * kBlock); ++k) {
        own_add(k, block.entry);
        block.start.push_back(static_cast<std::uint32_t>(block.entry.size()));
      }
    }
  });
  return lists;
}

template <class T>
std::span<const T> list_of(const Lists<T>& lists, std::size_t k) {
  const Block<T>& block = lists[k / NearLists::kBlock];
  const std::uint32_t* const own = block.start.data() + k % NearLists::kBlock;
  return std::span(block.entry).subspan(own[0], own[1] - own[0]);
}

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

// All particles of the surface, [around]; place [k] has the k-th to merge.
std::vector<Member> members_of(const View& view, const Projected& projected, const Visible& rim,
                               const SurfaceParticles& around,
                               const std::vector<std::int32_t>& place) {
  std::vector<Member> members(around.index.size());
  parallel_for(place.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t i = static_cast<std::size_t>(rim.index[k]);
      const std::size_t p = static_cast<std::size_t>(place[k]);
      const Vec3d& n = around.normal[p];
      const float rank =
          static_cast<float>(rank_of(world_direction(view, projected.eye(i) - view.shift)));
      const float takes = rim.influence_of(k) *
                          static_cast<float>(smooth_step(kOpenFrom, kOpenTo, around.weight[p]));
      members[p] = {projected.x[i],
                    projected.y[i],
                    projected.z[i],
                    static_cast<float>(around.weight[p]),
                    static_cast<float>(n.x),
                    static_cast<float>(n.y),
                    static_cast<float>(n.z),
                    takes,
                    rank,
                    takes > 0 ? rank : -1,
                    static_cast<std::int32_t>(k)};
    }
  });
  return members;
}

// The share of a group's radius up to which it takes in.
double within(double distance, double extent) {
  return 1 - smooth_step(kFullReach, 1, distance / extent);
}

// How far two whose normals are alike lie in one layer: 0: of another sheet .. 1.
double in_layer(const Member& a, const Member& b, float same) {
  // The mean normal's length is sqrt((1 + n.n') / 2).
  const float along =
      (b.x - a.x) * (a.nx + b.nx) + (b.y - a.y) * (a.ny + b.ny) + (b.z - a.z) * (a.nz + b.nz);
  const float square = along * along / (2 * (1 + same));  // of the height
  float alike = 1;
  if (same < kSame) alike = static_cast<float>(smooth_step(kOther, kSame, same));
  if (!(square > kBeside * kBeside)) return alike;
  return alike * static_cast<float>(1 - smooth_step(kBeside, kAbove, std::sqrt(square)));
}

// n.n'
float cosine_between(const Member& a, const Member& b) {
  return a.nx * b.nx + a.ny * b.ny + a.nz * b.nz;
}

float squared_distance(const Member& a, const Member& b) {
  const float x = b.x - a.x, y = b.y - a.y, z = b.z - a.z;
  return x * x + y * y + z * z;
}

// Those of a list whose normals are like those of the member at `place`. No branches: they would be
// mispredicted.
void find_alike(const std::vector<Member>& members, cl_int place, std::span<const cl_int> list,
                Alike& found) {
  found.make_room(list.size());
  const Member own = members[static_cast<std::size_t>(place)];
  cl_int* const at = found.place.data();
  float *const same = found.same.data(), *const apart = found.apart.data(),
               *const weight = found.weight.data(), *const taking_rank = found.taking_rank.data();
  std::size_t count = 0;
  for (const cl_int p : list) {
    const Member& other = members[static_cast<std::size_t>(p)];
    const float cosine = cosine_between(own, other);
    at[count] = p;
    same[count] = cosine;
    apart[count] = squared_distance(own, other);
    weight[count] = other.weight;
    taking_rank[count] = other.taking_rank;
    count += static_cast<std::size_t>((cosine > kOther) & (p != place));
  }
  found.count = count;
}

// How far a particle takes in others, R, from those alike.
float extent_among(Alike& alike, const MergeParams& params) {
  double* const t = alike.between.data();
  float* const counts = alike.counts.data();
  const float *const same = alike.same.data(), *const apart = alike.apart.data(),
                     *const weight = alike.weight.data();
  // Loops that become vectors, which smooth_step() in one of them would prevent, and one that sums
  // in order.
  for (std::size_t a = 0; a < alike.count; ++a)
    t[a] = std::min((double{same[a]} - kOther) / (double{kSame} - kOther), 1.0);
  for (std::size_t a = 0; a < alike.count; ++a) {
    const float d = std::max(1 - apart[a] / static_cast<float>(kBendReach * kBendReach), 0.0f);
    counts[a] = weight[a] * static_cast<float>(t[a] * t[a] * (3 - 2 * t[a])) * d * d;
  }
  float all = 1e-9f, bend = 0;
  for (std::size_t a = 0; a < alike.count; ++a) {
    all += counts[a];
    bend += counts[a] * (1 - same[a]);
  }
  const double calm = 1 - smooth_step(kCalmBend, kTightBend, bend / all);
  return static_cast<float>(params.least_reach + (params.reach - params.least_reach) * calm);
}

// How far each particle takes in others, and who may take it in.
struct Surroundings {
  std::vector<float> extent;  // [particles] R, particle radii
  Lists<Candidate> candidates;
};

Surroundings look_around(const std::vector<Member>& members, const std::vector<std::int32_t>& place,
                         const NearLists& lists, const MergeParams& params) {
  std::vector<float> extents(place.size());
  const auto look = [&, alike = Alike()](std::size_t k, std::vector<Candidate>& list) mutable {
    find_alike(members, place[k], lists[k], alike);
    const float extent = extents[k] = extent_among(alike, params);
    const Member& own = members[static_cast<std::size_t>(place[k])];
    const float least_rank = own.rank - static_cast<float>(kTie);
    std::size_t count = 0;
    for (std::size_t a = 0; a < alike.count; ++a) {
      alike.chosen[count] = static_cast<std::uint32_t>(a);
      count += all_true(alike.taking_rank[a] > least_rank, alike.apart[a] < extent * extent);
    }
    for (const std::uint32_t a : std::span(alike.chosen).first(count)) {
      const Member& other = members[static_cast<std::size_t>(alike.place[a])];
      double taken = in_layer(own, other, alike.same[a]) * other.takes;
      const double lead = double{other.rank} - own.rank;
      if (lead < kTie) taken *= smooth_step(-kTie, kTie, lead);
      list.push_back({other.index, alike.apart[a], taken});
    }
  };
  Lists<Candidate> candidates = make_lists<Candidate>(place.size(), look);
  return {std::move(extents), std::move(candidates)};
}

// The particles, those of high rank first.
std::vector<std::int32_t> by_rank(const std::vector<float>& rank) {
  std::vector<std::uint64_t> keys;  // ranks are not negative: their bits go as they do
  for (std::size_t k = 0; k < rank.size(); ++k)
    keys.push_back(std::uint64_t{~std::bit_cast<std::uint32_t>(rank[k])} << 32 | k);
  std::sort(keys.begin(), keys.end());
  std::vector<std::int32_t> order;
  for (const std::uint64_t key : keys) order.push_back(static_cast<std::int32_t>(key));
  return order;
}

// What is left of each particle's own group when nothing merges any more, W.
std::vector<float> merge_until_settled(const std::vector<Member>& members,
                                       const std::vector<std::int32_t>& place,
                                       const Surroundings& around) {
  const std::size_t n = place.size();
  const Lists<Taker> takers = make_lists<Taker>(n, [&](std::size_t k, std::vector<Taker>& list) {
    for (const Candidate& candidate : list_of(around.candidates, k)) {
      const float extent =
          std::min(around.extent[k], around.extent[static_cast<std::size_t>(candidate.group)]);
      const float full = static_cast<float>(kFullReach) * extent;
      if (!(candidate.apart < extent * extent)) continue;
      double taken = candidate.takes;
      if (candidate.apart > full * full) taken *= within(std::sqrt(candidate.apart), extent);
      list.push_back({candidate.group, static_cast<float>(taken)});
    }
  });
  std::vector<float> rank;
  for (const std::int32_t p : place) rank.push_back(members[static_cast<std::size_t>(p)].rank);
  const std::vector<std::int32_t> order = by_rank(rank);
  std::vector<float> left(n, 1.0f);
  float change = 1;
  for (int sweep = 0; sweep < kMostSweeps && change > kSettled; ++sweep) {
    change = 0;
    for (const std::int32_t item : order) {
      const std::size_t k = static_cast<std::size_t>(item);
      float own = 1;
      for (const Taker& taker : list_of(takers, k))
        own *= 1 - left[static_cast<std::size_t>(taker.group)] * taker.takes;
      change = std::max(change, std::abs(own - left[k]));
      left[k] = own;
    }
  }
  return left;
}

}  // namespace

double merge_reach(const MergeParams& params) {
  return std::max({kBendReach, params.reach, params.least_reach});
}

MergedGroups merge_particles(const View& view, const Projected& projected, const Visible& rim,
                             const SurfaceParticles& around, const NearLists& near,
                             const MergeParams& params) {
  const std::vector<std::int32_t> place = places_in(around.index, rim.index);
  const std::vector<Member> members = members_of(view, projected, rim, around, place);
  const Surroundings surroundings = look_around(members, place, near, params);
  const std::vector<float> left = merge_until_settled(members, place, surroundings);
  MergedGroups groups;
  for (std::size_t k = 0; k < place.size(); ++k) {
    const float influence = rim.influence_of(k) * (left[k] - kGone) / (1 - kGone);
    if (!(influence > 0)) continue;
    // A group is seen as far as its members are.
    double owned = rim.owned[k];
    const Member& seed = members[static_cast<std::size_t>(place[k])];
    if (seed.takes > 0)
      for (const cl_int p : near[k]) {
        if (owned >= kFullyVisible) break;
        const Member& other = members[static_cast<std::size_t>(p)];
        if (other.index < 0) continue;
        const double others = rim.owned[static_cast<std::size_t>(other.index)];
        if (!(others > owned)) continue;
        const float same = cosine_between(seed, other);
        if (!(same > kOther)) continue;
        const double distance = std::sqrt(squared_distance(seed, other));
        owned = std::max(owned, others * within(distance, surroundings.extent[k]) *
                                    in_layer(seed, other, same) * seed.takes);
      }
    groups.seed.index.push_back(rim.index[k]);
    groups.seed.owned.push_back(static_cast<float>(owned));
    groups.seed.influence.push_back(influence);
    groups.extent.push_back(surroundings.extent[k]);
  }
  return groups;
}

}  // namespace meniscus
