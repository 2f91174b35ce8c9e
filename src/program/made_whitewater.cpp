#include "program/made_whitewater.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "meniscus/error.hpp"
#include "meniscus/whitewater.hpp"
#include "program/mixed.hpp"
#include "stages/frame/cells.hpp"

namespace meniscus {
namespace {

constexpr float kReach = 4;         // of what is around, particle radii
constexpr int kSplash = 12;         // fewer particles around are splash, of some 35 in the water
constexpr double kSurface = 0.5;    // their middle is so far away, particle radii: at the surface
constexpr double kOffspring = 1.5;  // how far from its particle whitewater lies, particle radii
constexpr double kSprayWide = 5;

// What is around a particle of water, without itself; lengths in particle radii.
struct Around {
  int count = 0;
  Vec3d middle, velocity;  // means: from the particle; of velocities
};

Around look_around(const Particles& water, const Cells& cells, std::size_t of,
                   const std::vector<std::int32_t>& place) {
  const auto k = static_cast<std::size_t>(place[of]);
  Around around;
  visit_near(cells, cells.x[k], cells.y[k], cells.z[k], [&](std::int32_t p) {
    const auto other = static_cast<std::size_t>(p);
    const Vec3d away{double{cells.x[other]} - cells.x[k], double{cells.y[other]} - cells.y[k],
                     double{cells.z[other]} - cells.z[k]};
    if (other == k || dot(away, away) > kReach * kReach) return true;
    const auto item = static_cast<std::size_t>(cells.item[other]);
    ++around.count;
    around.middle += away;
    around.velocity += Vec3d{water.vx[item], water.vy[item], water.vz[item]};
    return true;
  });
  if (around.count > 0) {
    around.middle = around.middle / around.count;
    around.velocity = around.velocity / around.count;
  }
  return around;
}

double weight_of(WhitewaterType type, const Around& around, const Vec3d& velocity) {
  const bool splash = around.count<kSplash, surface = length(around.middle)> kSurface;
  const Vec3d other = velocity - around.velocity;
  switch (type) {
    case WhitewaterType::spray:
      return splash ? length(velocity) : 0;
    case WhitewaterType::foam:
      return !splash && surface ? dot(velocity, velocity) * dot(velocity, velocity) : 0;
    case WhitewaterType::bubble:
      return !splash && !surface ? dot(other, other) : 0;
  }
  return 0;
}

}  // namespace

MadeWhitewater::MadeWhitewater(const Particles& water, WhitewaterType type, std::int64_t particles,
                               std::uint64_t seed)
    : type_(type), particles_(particles), seed_(seed), radius_(water.particle_radius) {
  require(particles >= 1 && particles <= kMost,
          "whitewater: " + std::to_string(particles) + " particles, must be 1 to 1e9");
  require(!water.vx.empty() && water.particle_radius > 0,
          "whitewater is made of water with velocities and a particle radius");
  std::vector<float> x, y, z;
  for (std::size_t i = 0; i < water.size(); ++i) {
    x.push_back(static_cast<float>(water.x[i] / radius_));
    y.push_back(static_cast<float>(water.y[i] / radius_));
    z.push_back(static_cast<float>(water.z[i] / radius_));
  }
  const Cells cells = make_cells(x, y, z, kReach);
  std::vector<std::int32_t> place(water.size());
  for (std::size_t k = 0; k < place.size(); ++k)
    place[static_cast<std::size_t>(cells.item[k])] = static_cast<std::int32_t>(k);
  for (std::size_t i = 0; i < water.size(); ++i) {
    const Vec3 velocity{water.vx[i], water.vy[i], water.vz[i]};
    const Around around = look_around(water, cells, i, place);
    add({water.x[i], water.y[i], water.z[i]}, velocity,
        static_cast<Vec3>(normalized(-around.middle)), weight_of(type, around, Vec3d(velocity)));
  }
  require(!sources_.empty(), "whitewater: the water has no place for " + to_string(type));
}

void MadeWhitewater::add(const Vec3& at, const Vec3& velocity, const Vec3& outward, double weight) {
  if (!(weight > 0) || !std::isfinite(weight)) return;
  sources_.push_back({at, velocity, outward});
  up_to_.push_back((up_to_.empty() ? 0 : up_to_.back()) + weight);
}

void MadeWhitewater::emit(const std::function<void(std::span<const float>)>& take) const {
  SplitMix random(seed_);
  std::vector<float> block;
  for (std::int64_t n = 0; n < particles_; ++n) {
    const double ticket = random.uniform() * up_to_.back();
    const auto found = std::upper_bound(up_to_.begin(), up_to_.end(), ticket);
    const Source& source =
        sources_[std::min(static_cast<std::size_t>(found - up_to_.begin()), sources_.size() - 1)];
    Vec3d away;  // in a ball
    do away = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    while (dot(away, away) > 1);
    const bool spray = type_ == WhitewaterType::spray;
    away = away * (spray ? kSprayWide * random.uniform() : kOffspring);
    if (type_ == WhitewaterType::foam) {  // on the surface, a radius above its particles
      const Vec3d out(source.outward);
      away = away + out * (1 + 0.2 * random.uniform(-1, 1) - dot(away, out));
    }
    const Vec3d at = Vec3d(source.at) + away * radius_;
    const double slower = spray ? random.uniform(0.8, 1) : 1, size = random.uniform();
    for (const double value :
         {at.x, at.y, at.z, slower * source.velocity.x, slower * source.velocity.y,
          slower * source.velocity.z, radius_ * (0.03 + 0.12 * size * size * size)})
      block.push_back(static_cast<float>(value));
    if (block.size() < kValues * kBlock && n + 1 < particles_) continue;
    take(block);
    block.clear();
  }
}

}  // namespace meniscus
