#include "accuracy/particles.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "accuracy/random.hpp"
#include "stages/vec.hpp"

namespace meniscus::accuracy {
namespace {

constexpr double kDepth = 0.5;     // s; no centre is nearer to the surface
constexpr double kSpacing = 1.12;  // s; nearest neighbours in the densest packing of one per s^3
constexpr int kRounds = 60;

/// Points in cells of side kSpacing, so that neighbours lie in the 27 cells around.
class Cells {
 public:
  Cells(const Vec3d& low, const Vec3d& high, const std::vector<Vec3d>& points) : low_(low) {
    const Vec3d extent = high - low;
    const std::array<double, 3> sides{extent.x, extent.y, extent.z};
    for (int k = 0; k < 3; ++k) count_[k] = static_cast<int>(sides[k] / kSpacing) + 1;
    start_.assign(static_cast<std::size_t>(count_[0]) * count_[1] * count_[2] + 1, 0);
    for (const Vec3d& p : points) ++start_[index(cell(p)) + 1];
    for (std::size_t c = 1; c < start_.size(); ++c) start_[c] += start_[c - 1];
    std::vector<int> end(start_.begin(), start_.end() - 1);
    members_.resize(points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
      members_[end[index(cell(points[i]))]++] = static_cast<int>(i);
  }

  template <class Visit>
  void around(const Vec3d& p, const Visit& visit) const {
    const auto [x, y, z] = cell(p);
    for (int k = std::max(z - 1, 0); k <= std::min(z + 1, count_[2] - 1); ++k)
      for (int j = std::max(y - 1, 0); j <= std::min(y + 1, count_[1] - 1); ++j) {
        const std::size_t first = index({std::max(x - 1, 0), j, k});
        const std::size_t last = index({std::min(x + 1, count_[0] - 1), j, k});
        for (int m = start_[first]; m < start_[last + 1]; ++m) visit(members_[m]);
      }
  }

 private:
  std::array<int, 3> cell(const Vec3d& p) const {
    const Vec3d q = (p - low_) / kSpacing;
    return {std::clamp(static_cast<int>(q.x), 0, count_[0] - 1),
            std::clamp(static_cast<int>(q.y), 0, count_[1] - 1),
            std::clamp(static_cast<int>(q.z), 0, count_[2] - 1)};
  }
  std::size_t index(const std::array<int, 3>& c) const {
    return (static_cast<std::size_t>(c[2]) * count_[1] + c[1]) * count_[0] + c[0];
  }

  Vec3d low_;
  std::array<int, 3> count_{};
  std::vector<int> start_, members_;
};

Vec3d pushed_inside(const Scene& scene, Vec3d p) {
  for (int k = 0; k < 40; ++k) {
    const double excess = scene.distance(p) + kDepth;
    if (excess <= 0) break;
    p = p - (excess + 1e-9) * outward(scene.distance, p);
  }
  return p;
}

/// A random point within 4 s of `near` that is deep enough and, where the way there has to stay in
/// the solid, at the end of a straight one.
Vec3d deep_point(const Scene& scene, const Vec3d& near, bool inside_all_the_way, Random& random) {
  constexpr double kNearBy = 4;  // s; half the side of a cube
  constexpr double kStep = 0.5;  // s
  constexpr int kTries = 20000;  // a drop of a few s^3 takes some thousand
  for (int k = 0; k < kTries; ++k) {
    const Vec3d q =
        near + random.in_box({-kNearBy, -kNearBy, -kNearBy}, {kNearBy, kNearBy, kNearBy});
    if (scene.distance(q) > -kDepth) continue;
    const int steps = inside_all_the_way ? static_cast<int>(length(q - near) / kStep) : 0;
    bool inside = true;
    for (int step = 1; step <= steps && inside; ++step)
      inside = scene.distance(near + (1. * step / (steps + 1)) * (q - near)) < 0;
    if (inside) return q;
  }
  return pushed_inside(scene, near);
}

/// Adds points until the mass is that of the volume: what the shell would hold finds room near by,
/// so that thin parts get their mass too.
void fill_up(const Scene& scene, Random& random, std::vector<Vec3d>& points) {
  const auto wanted = static_cast<std::size_t>(std::llround(volume(scene)));
  while (points.size() < wanted) {
    const Vec3d p = random.in_box(scene.low, scene.high);
    const double depth = -scene.distance(p);
    if (depth >= 0 && depth < kDepth) points.push_back(deep_point(scene, p, false, random));
  }
}

/// One round: pairs nearer than kSpacing push each other apart, then all return to their depth.
void relax(const Scene& scene, std::vector<Vec3d>& points) {
  constexpr double kStiffness = 0.25, kLongestMove = 0.3;
  const Cells cells(scene.low, scene.high, points);
  std::vector<Vec3d> moved(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    Vec3d push;
    cells.around(points[i], [&](int j) {
      const Vec3d apart = points[i] - points[j];
      const double distance = length(apart);
      if (distance < kSpacing && distance > 1e-9)
        push += apart * (kStiffness * (kSpacing - distance) / distance);
    });
    const double move = length(push);
    if (move > kLongestMove) push = push * (kLongestMove / move);
    moved[i] = pushed_inside(scene, points[i] + push);
  }
  points.swap(moved);
}

}  // namespace

std::vector<Vec3d> fill(const Scene& scene, std::uint64_t seed) {
  // A rotation whose rows are (2 3 6), (3 -6 2), (6 2 -3) over 7: no axis of the lattice lies
  // along one of the scene.
  const Vec3d a = Vec3d{2, 3, 6} / 7, b = Vec3d{3, -6, 2} / 7, c = Vec3d{6, 2, -3} / 7;
  constexpr double kJitter = 0.15;  // s
  Random random(seed);
  const Vec3d centre = (scene.low + scene.high) / 2 + random.in_box({-.5, -.5, -.5}, {.5, .5, .5});
  const int reach = static_cast<int>(length(scene.high - scene.low) / 2) + 2;
  std::vector<Vec3d> points, shell;
  for (int k = -reach; k <= reach; ++k)
    for (int j = -reach; j <= reach; ++j)
      for (int i = -reach; i <= reach; ++i) {
        const Vec3d jitter =
            random.in_box({-kJitter, -kJitter, -kJitter}, {kJitter, kJitter, kJitter});
        const Vec3d p = centre + i * a + j * b + k * c + jitter;
        const double depth = -scene.distance(p);
        if (depth >= kDepth)
          points.push_back(p);
        else if (depth > 0)
          shell.push_back(p);
      }
  if (scene.use != Use::calm) {
    // Each drop and ligament gets its own mass, to the lattice's chance.
    for (const Vec3d& p : shell) points.push_back(deep_point(scene, p, true, random));
  } else {
    fill_up(scene, random, points);
  }
  for (int round = 0; round < kRounds; ++round) relax(scene, points);
  return points;
}

std::vector<Vec3d> lattice(const Scene& scene, double depth, std::uint64_t seed) {
  Random random(seed);
  const Vec3d first = scene.low - random.in_box({0, 0, 0}, {1, 1, 1});
  std::vector<Vec3d> points;
  for (double z = first.z; z <= scene.high.z; ++z)
    for (double y = first.y; y <= scene.high.y; ++y)
      for (double x = first.x; x <= scene.high.x; ++x)
        if (scene.distance({x, y, z}) <= -depth) points.push_back({x, y, z});
  return points;
}

std::vector<Vec3d> at_random(const Scene& scene, std::uint64_t seed) {
  Random random(seed);
  const Vec3d extent = scene.high - scene.low;
  const auto tries = std::llround(extent.x * extent.y * extent.z);
  std::vector<Vec3d> points;
  for (long long k = 0; k < tries; ++k) {
    const Vec3d p = random.in_box(scene.low, scene.high);
    if (scene.distance(p) < 0) points.push_back(p);
  }
  return points;
}

void add_noise(std::vector<Vec3d>& points, double sigma, std::uint64_t seed) {
  Random random(~seed);  // another stream than the filling's
  for (Vec3d& p : points) {
    p.x += sigma * random.normal();
    p.y += sigma * random.normal();
    p.z += sigma * random.normal();
  }
}

Particles make_particles(const Scene& scene, double noise, std::uint64_t seed, Filling filling) {
  std::vector<Vec3d> points = filling == Filling::relaxed ? fill(scene, seed)
                              : filling == Filling::random
                                  ? at_random(scene, seed)
                                  : lattice(scene, filling == Filling::lattice ? 0 : kDepth, seed);
  if (noise > 0) add_noise(points, noise, seed);
  for (const Piece& piece : scene.splash) points.insert(points.end(), piece.begin(), piece.end());
  Particles particles;
  for (const Vec3d& p : points) add_position(particles, p);
  particles.particle_radius = kParticleRadius;
  return particles;
}

Particles jittered(Particles particles, double sigma, std::uint64_t seed, int frame) {
  Random random(~seed * 5 + static_cast<std::uint64_t>(frame));  // a stream a frame
  for (auto* coordinate : {&particles.x, &particles.y, &particles.z})
    for (float& value : *coordinate) value += static_cast<float>(sigma * random.normal());
  return particles;
}

}  // namespace meniscus::accuracy
