#include "prepare/crowds.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <compare>
#include <cstdint>
#include <cstdlib>

#include "base/parallel.hpp"
#include "base/position_hash.hpp"
#include "base/printed.hpp"
#include "prepare/canonical_order.hpp"
#include "prepare/radius_estimate.hpp"
#include "stages/frame/cells.hpp"

namespace meniscus {
namespace {

// Where particles lie as they should a cube holds up to 4 of them, 1.2 on average; where the radius
// is twice too large, up to 15, and 7.
constexpr std::uint32_t kOrdinary = 4, kCrowd = 16;

constexpr std::size_t kGrain = 8192;  // particles that are worth a thread

struct Cube {
  std::int32_t x, y, z;
  auto operator<=>(const Cube&) const = default;
};

// Whether it stands for all of space behind it, too, where particles may be far from each other.
bool is_beyond(const Cube& cube) {
  return std::max({std::abs(cube.x), std::abs(cube.y), std::abs(cube.z)}) == kFarthestCell;
}

Cube cube_of(const BorrowedParticles& p, std::size_t i, float inverse) {
  return {cell_of(p.x[i], inverse), cell_of(p.y[i], inverse), cell_of(p.z[i], inverse)};
}

// Some particles, and the cubes they are in: loops over them become vectors.
constexpr std::size_t kBlock = 256;
struct Coordinates {
  std::array<float, kBlock> x{}, y{}, z{};
};
struct Cubes {
  std::array<std::int32_t, kBlock> x, y, z;
};

Cubes cubes_of(const Coordinates& at, float inverse) {
  Cubes cubes;
  for (std::size_t k = 0; k < kBlock; ++k) {
    cubes.x[k] = cell_of(at.x[k], inverse);
    cubes.y[k] = cell_of(at.y[k], inverse);
    cubes.z[k] = cell_of(at.z[k], inverse);
  }
  return cubes;
}

// Where a cube is counted. bucket_of() would crowd cubes into a quarter of a table of 2^14 or 2^15,
// where its factors are 159 and -73; searches, whose cells hold several particles, hardly notice.
std::uint32_t count_of(const Cube& cube, std::uint32_t mask) {
  return (static_cast<std::uint32_t>(cube.x) + (static_cast<std::uint32_t>(cube.y) * 2654435761u ^
                                                static_cast<std::uint32_t>(cube.z) * 3266489917u)) &
         mask;
}

// A particle that may be in a crowd.
struct Member {
  Cube cube;
  std::uint32_t hash;
  std::size_t place;  // in the order
  auto operator<=>(const Member&) const = default;
};

// How many particles the cubes hold, in buckets that seldom are of several.
class Census {
 public:
  Census(const BorrowedParticles& p, double side)
      : particles_(p),
        inverse_(static_cast<float>(1 / side)),
        held_(std::bit_ceil(2 * p.size() + 1)) {
    for (std::size_t i = 0; i < p.size(); ++i)
      if (const Cube cube = cube_of(i); !is_beyond(cube)) ++held_[bucket_at(cube)];
  }

  Cube cube_of(std::size_t i) const { return meniscus::cube_of(particles_, i, inverse_); }
  std::uint32_t held_with(const Cube& cube) const { return held_[bucket_at(cube)]; }
  void leave_out(const Cube& cube) { --held_[bucket_at(cube)]; }

  /// The upper quartile of those that hold any: at a surface they hold fewer than inside.
  std::uint32_t mostly_held() const {
    std::vector<std::uint32_t> held = held_;
    std::erase(held, 0);
    if (held.empty()) return 0;
    const auto quartile = held.begin() + static_cast<std::ptrdiff_t>(3 * held.size() / 4);
    std::nth_element(held.begin(), quartile, held.end());
    return *quartile;
  }

 private:
  std::uint32_t bucket_at(const Cube& cube) const {
    return count_of(cube, static_cast<std::uint32_t>(held_.size() - 1));
  }
  const BorrowedParticles& particles_;
  float inverse_;
  std::vector<std::uint32_t> held_;
};

// Whether there is no crowd for certain, and the radius does not seem too large: a census in bytes,
// a quarter of the memory of the other, and all that most frames need.
bool is_ordinary(const BorrowedParticles& p, double side) {
  const float inverse = static_cast<float>(1 / side);
  std::vector<std::uint8_t> held(std::bit_ceil(2 * p.size() + 1));
  const auto mask = static_cast<std::uint32_t>(held.size() - 1);
  std::atomic<bool> crowded = false;  // counts go no farther then
  parallel_for(p.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    Coordinates at;
    for (std::size_t from = begin; from < end && !crowded; from += kBlock) {
      const std::size_t count = std::min(kBlock, end - from);
      p.x.copy(from, count, at.x.data());
      p.y.copy(from, count, at.y.data());
      p.z.copy(from, count, at.z.data());
      const Cubes cubes = cubes_of(at, inverse);
      for (std::size_t k = 0; k < count; ++k) {
        const Cube cube{cubes.x[k], cubes.y[k], cubes.z[k]};
        if (is_beyond(cube)) continue;
        std::atomic_ref here(held[count_of(cube, mask)]);
        if (here.fetch_add(1, std::memory_order_relaxed) >= kCrowd) crowded = true;
      }
    }
  });
  if (crowded) return false;
  // The upper quartile, as below.
  const auto empty = static_cast<std::size_t>(std::ranges::count(held, 0));
  const auto more = static_cast<std::size_t>(
      std::ranges::count_if(held, [](std::uint8_t count) { return count > kOrdinary; }));
  const std::size_t all = held.size() - empty;
  return all == 0 || 3 * all / 4 < all - more;
}

// Particles in a cube, by x as the order is, and those of them that lie far enough from its walls.
struct Sample {
  std::vector<Vec3d> inside;
  std::vector<std::size_t> inner;  // places in `inside`
};

constexpr double kSampleSide = 16, kSampleMargin = 3;  // radii
constexpr std::size_t kMostInner = 8;

// No more of a cube than may be the nearest to its first inner ones.
Sample sample_in(const Cube& cube, const BorrowedParticles& p,
                 const std::vector<std::size_t>& order, double radius, float inverse) {
  const auto is_inner = [&](double x, std::int32_t cell) {
    const double from_wall = x / radius - kSampleSide * cell;
    return from_wall >= kSampleMargin && from_wall <= kSampleSide - kSampleMargin;
  };
  const auto is_before = [&](std::size_t i, std::int32_t x) {
    return cell_of(p.x[i], inverse) < x;
  };
  Sample sample;
  auto& [inside, inner] = sample;
  for (auto k = std::lower_bound(order.begin(), order.end(), cube.x, is_before); k != order.end();
       ++k) {
    const Vec3d at{p.x[*k], p.y[*k], p.z[*k]};
    if (inner.size() == kMostInner && at.x - inside[inner.back()].x > kSampleMargin * radius) break;
    const Cube own = cube_of(p, *k, inverse);
    if (own.x != cube.x) break;
    if (own != cube) continue;
    if (inner.size() < kMostInner && is_inner(at.x, cube.x) && is_inner(at.y, cube.y) &&
        is_inner(at.z, cube.z))
      inner.push_back(inside.size());
    inside.push_back(at);
  }
  return sample;
}

// The square of the distance from one of some places, which are by x, to the nearest other; `most`
// where there is none as near.
double least_square(const std::vector<Vec3d>& places, std::size_t i, double most) {
  double least = most;
  const auto is_apart = [&](const Vec3d& other) {  // and so are those behind it
    const double dx = places[i].x - other.x, dy = places[i].y - other.y, dz = places[i].z - other.z;
    least = std::min(least, dx * dx + dy * dy + dz * dz);
    return dx * dx > least;
  };
  for (std::size_t j = i + 1; j < places.size() && !is_apart(places[j]);) ++j;
  for (std::size_t j = i; j > 0 && !is_apart(places[j - 1]);) --j;
  return least;
}

// Whether the particles around some of them have no neighbour as near as fluid has: in cubes of 16
// radii, the first by x that lie far enough from the walls. There are hardly any of these where the
// radius is far too small. A quick look, which a large radius passes: no more cubes are looked at
// than decide.
bool seem_lonely(const BorrowedParticles& p, const std::vector<std::size_t>& order, double radius) {
  constexpr std::size_t kCubes = 8;
  constexpr double kLonely = 2.4;  // radii; neighbours of fluid: up to 2
  const float inverse = static_cast<float>(1 / (kSampleSide * radius));
  std::array<Cube, kCubes> cubes{};
  for (std::size_t k = 0; k < kCubes; ++k)
    cubes[k] = cube_of(p, order[(2 * k + 1) * order.size() / (2 * kCubes)], inverse);
  std::size_t looked_at = 0, accompanied = 0;  // particles; those of them that are not lonely
  for (auto cube = cubes.begin(); cube != cubes.end(); ++cube) {
    if (std::find(cubes.begin(), cube, *cube) != cube) continue;
    const Sample sample = sample_in(*cube, p, order, radius, inverse);
    for (const std::size_t i : sample.inner) {
      const double most = kSampleMargin * radius * kSampleMargin * radius;
      if (std::sqrt(least_square(sample.inside, i, most)) / radius <= kLonely) ++accompanied;
    }
    looked_at += sample.inner.size();
    if (2 * accompanied > kCubes * kMostInner) return false;
  }
  return looked_at < kMostInner || accompanied <= looked_at / 2;  // the median is lonely
}

// How much larger the radius is than half the particles' spacing; 1 where they do not tell.
double times_too_large(const BorrowedParticles& p, const std::vector<std::size_t>& order,
                       double radius) {
  constexpr std::size_t kSamples = 128;
  const RadiusEstimate estimate = estimate_radius(p, order, kSamples);
  return estimate.is_dense ? radius / estimate.radius : 1;
}

// The particles of the order in cubes that hold too many, cube by cube. Some are in buckets of
// several cubes.
std::vector<Member> members_of_crowds(const BorrowedParticles& p,
                                      const std::vector<std::size_t>& order, const Census& census) {
  std::vector<Member> members;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::size_t i = order[k];
    const Cube cube = census.cube_of(i);
    if (census.held_with(cube) <= kCrowd || is_beyond(cube)) continue;
    // The sums with 0 make both zeros one.
    members.push_back({cube, position_hash(p.x[i] + 0.0f, p.y[i] + 0.0f, p.z[i] + 0.0f), k});
  }
  std::sort(members.begin(), members.end());
  return members;
}

}  // namespace

Notice radius_misfit(double radius, double fitting) {
  return {
      .code = fitting > radius ? Code::radius_too_small : Code::radius_too_large,
      .text = printed("a particle radius of %.6g means a spacing of %.6g, but the particles lie "
                      "about %.3g apart: %.3g would fit (check ",
                      radius, 2 * radius, 2 * fitting, fitting) +
              setting("particle-radius") + ")",
      .found = radius,
      .wanted = fitting};
}

Notice crowded(std::size_t largest, std::size_t dropped, std::size_t had, double radius) {
  return {.code = Code::crowded,
          .text = printed("up to %zu particles crowd into a cube of one particle spacing, %.6g: "
                          "%zu of %zu were dropped",
                          largest, 2 * radius, dropped, had),
          .count = static_cast<std::int64_t>(dropped),
          .of = static_cast<std::int64_t>(had),
          .found = static_cast<double>(largest),
          .wanted = 2 * radius};
}

std::vector<std::size_t> without_crowds(const BorrowedParticles& p, std::vector<std::size_t> order,
                                        double radius, Notices& notices) {
  if (is_ordinary(p, 2 * radius)) {
    const double factor = order.size() >= kTelling && seem_lonely(p, order, radius)
                              ? 1 / times_too_large(p, order, radius)
                              : 1;
    if (factor > kTooSmall) notices.add(radius_misfit(radius, factor * radius));
    return order;
  }

  Census census(p, 2 * radius);
  const std::size_t had = order.size();
  const std::vector<std::size_t> all = order;
  constexpr std::size_t kDropped = ~std::size_t{0};
  const std::vector<Member> members = members_of_crowds(p, order, census);
  std::size_t largest = 0;
  for (auto first = members.begin(), last = first; first != members.end(); first = last) {
    last =
        std::find_if(first, members.end(), [&](const Member& m) { return m.cube != first->cube; });
    const std::size_t count = static_cast<std::size_t>(last - first);
    if (count <= kCrowd) continue;
    largest = std::max(largest, count);
    // From behind, so that of those at one position the last stays, which is the largest.
    std::vector<Member> apart;
    for (auto next = last; next != first; --next) {
      const Member& member = *(next - 1);
      if (apart.empty() || !at_one_position(p, order[member.place], order[apart.back().place])) {
        apart.push_back(member);
        continue;
      }
      order[member.place] = kDropped;
      census.leave_out(member.cube);
    }
    if (apart.size() > kCrowd)
      for (std::size_t k = kOrdinary; k < apart.size(); ++k) order[apart[k].place] = kDropped;
  }
  const std::size_t dropped = std::erase(order, kDropped);

  if (const std::uint32_t held = census.mostly_held(); held > kOrdinary && had >= kTelling) {
    // Cubes far from each other may share a bucket all the same, as those of a lattice in another
    // unit do. Of those that do not tell, what the cubes hold: 16 at most.
    const double told = times_too_large(p, all, radius);
    const double factor =
        told * kTooSmall < 1 ? told : std::max(told, std::cbrt(static_cast<double>(held)));
    notices.add(radius_misfit(radius, radius / factor));
  }
  if (dropped > 0) notices.add(crowded(largest, dropped, had, radius));
  return order;
}

}  // namespace meniscus
