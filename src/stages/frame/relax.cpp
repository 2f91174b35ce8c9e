#include "stages/frame/relax.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "base/exact_math.hpp"
#include "base/parallel.hpp"
#include "stages/frame/lane_lists.hpp"
#include "stages/frame/near_lists.hpp"
#include "stages/frame/push_lanes.hpp"
#include "stages/vec.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kFewest = 64;  // particles; fewer tell nothing
// Variations of the distances and of the density, from those of SPH to those of one particle
// anywhere in each cube of a lattice.
constexpr double kEvenDistances = 0.065, kUnevenDistances = 0.265;
constexpr double kEvenDensity = 0.085, kUnevenDensity = 0.195;
// And from one particle anywhere in each cube of a lattice to particles anywhere.
constexpr double kCubesDistances = 0.285, kAnywhereDistances = 0.315;
constexpr double kCubesDensity = 0.215, kAnywhereDensity = 0.255;
constexpr double kCoarsestUnit = 1.4;  // particle radii
constexpr double kDensityReach = 1.5;  // spacings
constexpr double kStep = 0.5;          // of relax()
// Where forces vanish, spacings, from hardly irregular particles to those of FLIP.
constexpr double kAtRest = 1.161, kAtRestIrregular = 1.153;
// Who is near is looked up once, a little wider than forces reach, which are as good as nothing at
// that distance.
constexpr float kWider = 1.1f;
// Added to the second moments of the neighbours' places (squared reaches): few neighbours, or such
// in a plane, do not tell how the motion that they have in common changes from place to place.
constexpr double kFewNeighbours = 0.3;

// The density field of a lone particle of weight 1, at most two particle radii away.
double density_of_one(double away) {
  const double q = away / 2;
  return (1 - 1.5 * q * q * (1 - q / 2)) / std::numbers::pi;
}

// What a particle sees of others.
struct Around {
  std::size_t begin, others;  // its part of Inside::squared
  double nearest;             // particle radii
};

// Particles that lie inside the fluid.
struct Inside {
  std::vector<Around> sample;
  std::vector<double> squared;  // distances of others within kRelaxReach
};

// Standard deviation over mean.
double variation_of(const std::vector<double>& values) {
  double sum = 0, squares = 0;
  for (const double value : values) {
    sum += value;
    squares += value * value;
  }
  const double count = static_cast<double>(values.size()), mean = sum / count;
  return std::sqrt(std::max(squares / count - mean * mean, 0.0)) / std::max(mean, 1e-12);
}

// The squared distances of a particle's others, which go to `squared`.
Around see_others(const Projected& particles, std::int32_t own, std::span<const cl_int> near,
                  std::vector<double>& squared) {
  const Vec3d at = particles.eye(static_cast<std::size_t>(own));
  Around around{squared.size(), 0, kRelaxReach * kRelaxReach};
  for (const cl_int other : near) {
    if (other == own) continue;
    const Vec3d to = particles.eye(static_cast<std::size_t>(other)) - at;
    squared.push_back(dot(to, to));
    around.nearest = std::min(around.nearest, squared.back());
  }
  around.others = squared.size() - around.begin;
  around.nearest = std::sqrt(around.nearest);
  return around;
}

// The half of some particles that see the most others, of equally many those with the nearest ones:
// they lie inside the fluid.
Inside look_inside(const Projected& particles, const std::vector<std::int32_t>& sampled,
                   const Cells& cells) {
  const NearLists lists = list_near(particles, sampled, cells, kRelaxReach);
  const std::size_t half = sampled.size() / 2;
  if (half == 0) return {};
  std::vector<std::size_t> near;  // how many, itself among them
  for (std::size_t k = 0; k < sampled.size(); ++k) near.push_back(lists[k].size());
  std::vector<std::size_t> sorted = near;
  std::ranges::nth_element(sorted, sorted.begin() + static_cast<std::ptrdiff_t>(half) - 1,
                           std::greater{});
  // In a lattice of cubes a particle sees 32 others.
  constexpr std::size_t kInside = 19;
  const std::size_t fewest = std::max(sorted[half - 1], kInside + 1);
  Inside inside;
  inside.squared.reserve(64 * half);  // mostly enough
  for (std::size_t k = 0; k < sampled.size(); ++k)
    if (near[k] >= fewest)
      inside.sample.push_back(see_others(particles, sampled[k], lists[k], inside.squared));
  std::ranges::stable_sort(inside.sample, [](const Around& a, const Around& b) {
    return a.others != b.others ? a.others > b.others : a.nearest < b.nearest;
  });
  if (inside.sample.size() > half) inside.sample.resize(half);
  return inside;
}

// Three values and one that does not count, which compilers put into two registers.
using Pair = double __attribute__((vector_size(2 * sizeof(double))));
struct Pairs {
  Pair xy{}, z0{};
  void add(const Pairs& other, double weight) {
    xy += other.xy * weight;
    z0 += other.z0 * weight;
  }
};
Vec3d vector_of(const Pairs& pairs) { return {pairs.xy[0], pairs.xy[1], pairs.z0[0]}; }

Pairs place_in(const Places& places, std::size_t i) {
  const double x = places.x[i], y = places.y[i], z = places.z[i];
  return {Pair{x, y}, Pair{z, 0}};
}

// What a particle has moved in common with those near it: the value at it of the function, linear
// in the place, that is nearest to how far they have moved (weighted least squares).
Vec3d common_motion(std::size_t i, const std::int32_t* near, std::size_t count,
                    const Places& before, const Places& after, double reach) {
  const Pairs own = place_in(after, i);
  double weights = 0;
  Pairs place_sum, motion_sum;                // weighted sums, places from here in reaches
  std::array<Pairs, 3> moment_sums, by_sums;  // sums of places' products, and of motions by x, y, z
  for (const std::int32_t* const end = near + count; near < end; ++near) {
    const std::size_t j = static_cast<std::size_t>(*near);
    const Pairs at = place_in(after, j), was = place_in(before, j);
    const Pairs moved{at.xy - was.xy, at.z0 - was.z0},
        to{(at.xy - own.xy) / reach, (at.z0 - own.z0) / reach};
    const Pair squares = to.xy * to.xy;
    const double squared = squares[0] + squares[1] + to.z0[0] * to.z0[0];
    const double fades = std::max(1 - squared, 0.0), weight = fades * fades;
    const std::array along{weight * to.xy[0], weight * to.xy[1], weight * to.z0[0]};
    weights += weight;
    place_sum.add(to, weight);
    motion_sum.add(moved, weight);
    for (std::size_t k = 0; k < 3; ++k) {
      moment_sums[k].add(to, along[k]);
      by_sums[k].add(moved, along[k]);
    }
  }
  const Vec3d place = vector_of(place_sum), motion = vector_of(motion_sum), mean = place / weights;
  const std::array off{mean.x, mean.y, mean.z};
  std::array<Vec3d, 3> moments, by;
  for (std::size_t k = 0; k < 3; ++k) {
    moments[k] = vector_of(moment_sums[k]) + place * -off[k];
    by[k] = vector_of(by_sums[k]) + motion * -off[k];
  }
  auto& [x, y, z] = moments;
  x.x += kFewNeighbours;
  y.y += kFewNeighbours;
  z.z += kFewNeighbours;
  const Vec3d across = cross(y, z);
  const double per = 1 / dot(x, across);
  return motion / weights - by[0] * (dot(mean, across) * per) -
         by[1] * (dot(x, cross(mean, z)) * per) - by[2] * (dot(x, cross(y, mean)) * per);
}

// Calls each(i, list, length) for all particles of a block that are moved in more than
// kRelaxRounds, with those near each.
template <class Each>
void each_list(const LaneLists::Block& block, Each&& each) {
  std::array<std::vector<std::int32_t>, kListLanes> near;
  for (std::size_t g = 0; g + 1 < block.groups.size(); ++g) {
    const LaneLists::Group& group = block.groups[g];
    if (group.rounds <= kRelaxRounds) continue;
    const std::size_t most = block.groups[g + 1].near - group.near;
    std::array<std::int32_t*, kListLanes> end;
    for (std::size_t lane = 0; lane < kListLanes; ++lane) {
      if (near[lane].size() < most) near[lane].resize(2 * most);
      end[lane] = near[lane].data();
    }
    LaneLists::visit(block, g, [&](std::int32_t place, std::uint32_t lanes) {
      for (std::size_t lane = 0; lane < kListLanes; ++lane) {
        *end[lane] = place;  // no branches, which would be mispredicted
        end[lane] += lanes >> lane & 1;
      }
    });
    for (std::int32_t lane = 0; lane < group.count; ++lane) {
      const std::int32_t* const list = near[static_cast<std::size_t>(lane)].data();
      each(static_cast<std::size_t>(group.first + lane), list,
           static_cast<std::size_t>(end[static_cast<std::size_t>(lane)] - list));
    }
  }
}

// In how many rounds groups are moved: all, and one more where what they move in common is taken
// back. Who lies outside what is wanted is looked at by fewer, each of which looks as far as lists.
void set_rounds(LaneLists::Block& block, const Places& at, const SpaceBox& wanted, double reach) {
  constexpr double kRounding = 0.25;  // particle radii
  for (LaneLists::Group& group : block.groups) {
    double outside = SpaceBox::kFar;
    for (std::int32_t lane = 0; lane < group.count; ++lane) {
      const std::size_t p = static_cast<std::size_t>(group.first + lane);
      outside = std::min(outside, wanted.outside({at.x[p], at.y[p], at.z[p]}) - kRounding);
    }
    const double fewer = std::clamp(std::ceil(outside / reach), 0.0, kRelaxRounds + 1.0);
    group.rounds = kRelaxRounds + 1 - static_cast<int>(fewer);
  }
}

}  // namespace

ParticleOrder measure_order(const Projected& particles, const std::vector<std::int32_t>& sampled,
                            const Cells& cells) {
  const Inside inside = look_inside(particles, sampled, cells);
  const std::vector<Around>& sample = inside.sample;
  if (sample.size() < kFewest) return {};
  ParticleOrder order;
  std::size_t others = 0;
  for (const Around& around : sample) others += around.others;
  constexpr double kVolume = 4.0 / 3 * std::numbers::pi * kRelaxReach * kRelaxReach * kRelaxReach;
  order.spacing =
      cube_root(kVolume * static_cast<double>(sample.size()) / static_cast<double>(others));
  const double far = kDensityReach * order.spacing;
  std::vector<double> nearest, density;
  for (const Around& around : sample) {
    nearest.push_back(around.nearest);
    double sum = 1;
    for (const double squared : std::span(inside.squared).subspan(around.begin, around.others)) {
      const double fades = std::max(1 - squared / (far * far), 0.0);
      sum += fades * fades * fades;
    }
    density.push_back(sum);
  }
  order.distances = variation_of(nearest);
  order.density = variation_of(density);
  return order;
}

ParticleOrder measure_order(const Projected& particles, const Cells& cells) {
  const std::size_t n = particles.size(), every = 1 + n / kOrderSample;
  std::vector<std::int32_t> sampled;
  for (std::size_t i = 0; i < n; i += every) sampled.push_back(static_cast<std::int32_t>(i));
  return measure_order(particles, sampled, cells);
}

double Disorder::unit() const { return between(1, kCoarsestUnit, anywhere()); }

float Disorder::mass() const { return static_cast<float>(1 / (unit() * unit() * unit())); }

double disorder_of(const ParticleOrder& order) {
  return std::min(ramp(kEvenDistances, kUnevenDistances, order.distances),
                  ramp(kEvenDensity, kUnevenDensity, order.density)) +
         std::min(ramp(kCubesDistances, kAnywhereDistances, order.distances),
                  ramp(kCubesDensity, kAnywhereDensity, order.density));
}

Disorder find_disorder(const Projected& particles, const Cells& cells, const Parameters& params) {
  if (params.disorder >= 0) return {.amount = params.disorder};
  const ParticleOrder order = measure_order(particles, cells);
  return {disorder_of(order), order.spacing};
}

void relax(Projected& particles, double spacing, double disorder, const SpaceBox& wanted) {
  const double at_rest = between(kAtRest, kAtRestIrregular, disorder) * spacing;
  const float reach = static_cast<float>(kRelaxReach / 2 * spacing);
  const PairForce force{1 / (reach * reach), static_cast<float>(1 / (at_rest * at_rest)),
                        static_cast<float>(kStep * disorder)};
  Cells cells = lane_cells(particles.x, particles.y, particles.z, kWider * reach);
  LaneLists lists = list_lanes(cells, kWider * reach);
  const auto each_block = [&](const auto& work) {
    parallel_for(lists.blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) work(lists.blocks[b]);
    });
  };
  PushLanes* const push = lane_pushers()[0];
  const Places before{std::move(cells.x), std::move(cells.y), std::move(cells.z)};
  each_block([&](LaneLists::Block& block) { set_rounds(block, before, wanted, kWider * reach); });
  Places after = before, to = before;
  for (int round = 0; round < kRelaxRounds; ++round) {
    each_block([&](const LaneLists::Block& block) { push(block, force, round, after, to); });
    std::swap(after, to);
  }
  // The forces also press drops and sheets together: what neighbours move in common is not noise.
  each_block([&](const LaneLists::Block& block) {
    each_list(block, [&](std::size_t p, const std::int32_t* near, std::size_t count) {
      const Vec3d at = vector_of(place_in(after, p)) -
                       common_motion(p, near, count, before, after, kWider * reach);
      const std::size_t i = static_cast<std::size_t>(cells.item[p]);
      particles.x[i] = static_cast<float>(at.x);
      particles.y[i] = static_cast<float>(at.y);
      particles.z[i] = static_cast<float>(at.z);
    });
  });
}

double relax_influence(const Disorder& disorder) {
  if (disorder.amount == 0) return 0;
  // Each round looks at who was in the list, and so does what is taken back.
  return (kRelaxRounds + 1) * kWider * kRelaxReach / 2 * disorder.spacing / disorder.unit();
}

void even_out(Projected& particles, const Disorder& disorder, const SpaceBox& wanted) {
  if (disorder.amount == 0) return;
  relax(particles, disorder.spacing / disorder.unit(), disorder.within_cubes(), wanted);
}

RegionParams for_disorder(RegionParams params, const Disorder& disorder) {
  const double level = between(0.34, 0.29, disorder.anywhere());
  params.blob_density =
      std::max(params.blob_density, between(params.blob_density, level, disorder.within_cubes()));
  return params;
}

double lone_factor(const RegionParams& params, const Disorder& disorder) {
  const double at_its_radius = disorder.mass() * density_of_one(1 / disorder.unit());
  return for_disorder(params, disorder).blob_density /
         between(params.blob_density, at_its_radius, disorder.within_cubes());
}

Parameters for_disorder(Parameters params, const Disorder& disorder) {
  const double within_cubes = disorder.within_cubes();
  params.disorder = disorder.amount;
  FitParams& fit = params.fit;
  params.region = for_disorder(params.region, disorder);
  fit.offset -= 0.04 * within_cubes + 0.55 * (disorder.unit() - 1);
  fit.tau += 0.8 * within_cubes;
  fit.normal_sigma += 0.25 * within_cubes;
  fit.round_support += 1.5 * within_cubes - 1.75 * disorder.anywhere();
  fit.least_support = std::max(fit.least_support, between(fit.least_support, 0.8, within_cubes));
  params.fairing *= between(1, 1.5, within_cubes);
  return params;
}

}  // namespace meniscus
