#include "program/dam_break.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/exact_math.hpp"
#include "base/printed.hpp"
#include "meniscus/error.hpp"
#include "program/mixed.hpp"
#include "stages/vec.hpp"

namespace meniscus {
namespace {

constexpr double kLength = 3, kWidth = 1.5;  // of the tank along x and z
constexpr double kBend = 0.25;               // height of each of the lattice's two bends, s

// Half the side of the lattice's cubic cell in s: its sites are the points (i, j, k) of this
// spacing with an even i + j + k, one for every 2 * kSite^3 = 1 s^3.
constexpr double kSite = 0.7937005259840998;

using Random = SplitMix;

// sin(2 pi t) to 4e-6, with the same bits on every machine: the library's sine has not.
double sine(double t) {
  t -= std::floor(t + 0.5);
  if (t > 0.25) t = 0.5 - t;
  if (t < -0.25) t = -0.5 - t;
  const double q = t * t;
  return t * (6.283185307179586 +
              q * (-41.34170224039975 +
                   q * (81.60524927607504 + q * (-76.70585975306136 + q * 42.05869394489765))));
}

// How many columns of sites fit a side of the tank.
std::int64_t columns_along(double side, double spacing) {
  return std::max<std::int64_t>(1, static_cast<std::int64_t>(side / (kSite * spacing)));
}

}  // namespace

// One column of the body's sites.
struct DamBreak::Column {
  double x, z;                 // units
  double top, step;            // y of the first layer, and from layer to layer
  std::int64_t first, layers;  // it holds every second layer from `first` on
  std::int64_t size() const { return layers > first ? (layers - first + 1) / 2 : 0; }
};

DamBreak::DamBreak(std::int64_t particles, std::uint64_t seed, double noise)
    : size_(particles), seed_(seed), noise_(noise) {
  require(particles >= kFewest && particles <= kMost, "particles is " + std::to_string(particles) +
                                                          ", must be " + std::to_string(kFewest) +
                                                          " to " + std::to_string(kMost));
  require(noise >= 0 && noise <= kMostNoise,
          setting("noise") + printed(" is %g, must be 0 to %g spacings", noise, kMostNoise));
  Random random(seed);
  for (double& phase : phase_) phase = random.uniform();
  // Wavelengths fall from .7 to .09, heights with them: each wave is as steep as the next.
  constexpr int kWaves = 14;
  double wavelength = 0.7;
  for (int k = 0; k < kWaves; ++k, wavelength *= 0.855) {
    const double turn = random.uniform(-0.2, 0.2);  // from the x axis, which most run along
    waves_.push_back({sine(turn + 0.25) / wavelength, sine(turn) / wavelength, random.uniform(),
                      0.013 * wavelength});
  }
  make_drops();
  const std::int64_t spray =
      std::min(size_ / 50, static_cast<std::int64_t>(2 * std::sqrt(static_cast<double>(size_))));
  find_spacing(size_ - spray);
}

double DamBreak::height(double x, double z) const {
  const double front = 2.5 + 0.06 * sine(1.3 * z + phase_[0]) + 0.025 * sine(3.7 * z + phase_[1]);
  const double back = (front - x) / 0.16;  // 1: where the nose begins
  if (!(back > 0)) return 0;
  double h = 0.14 + 0.66 * (1 - smooth_step(0.35, 1.9, x));
  const double roller = (x - 1.95 - 0.08 * sine(0.9 * z + phase_[2])) / 0.22;
  if (roller > -1 && roller < 1) {
    const double hump = 1 - roller * roller;
    h += 0.1 * hump * hump;
  }
  for (const Wave& wave : waves_) h += wave.height * sine(wave.kx * x + wave.kz * z + wave.phase);
  return back < 1 ? h * std::sqrt(back * (2 - back)) : h;
}

void DamBreak::make_drops() {
  constexpr int kDrops = 160;
  constexpr double kSmallest = 0.005, kLargest = 0.03, kGap = 0.012;
  Random random(~seed_);
  while (drops_.size() < kDrops) {
    const double q = random.uniform(), z = random.uniform(0.05, kWidth - 0.05);
    const double x = 1.4 + 1.5 * q;
    const double radius = std::min(kLargest, kSmallest / (1 - 0.9 * random.uniform()));
    const double up = random.uniform();
    const double y = height(x, z) + radius + kGap + 0.5 * up * up * (0.2 + 3.2 * q * (1 - q));
    const bool apart = std::all_of(drops_.begin(), drops_.end(), [&](const Drop& other) {
      const double dx = x - other.centre[0], dy = y - other.centre[1], dz = z - other.centre[2];
      const double least = radius + other.radius + kGap;
      return dx * dx + dy * dy + dz * dz > least * least;
    });
    if (apart) drops_.push_back({{x, y, z}, radius});
  }
}

DamBreak::Column DamBreak::column(std::int64_t i, std::int64_t k) const {
  const double site = kSite * spacing_, bend = kBend * spacing_;
  const double a = static_cast<double>(i), b = static_cast<double>(k);
  // The walls of the tank are flat: the bend fades within so many sites of them.
  constexpr double kFade = 6;
  const auto faded = [&](double along, std::int64_t sites) {
    const double last = static_cast<double>(sites - 1);
    return bend * std::min({1.0, along / kFade, (last - along) / kFade});
  };
  Column c{};
  c.x = (a + 0.5) * site + faded(a, columns_along(kLength, spacing_)) *
                               (sine(a / 13.7 + b / 21.1 + phase_[3]) + sine(b / 9.7 + phase_[4]));
  c.z = (b + 0.5) * site + faded(b, columns_along(kWidth, spacing_)) *
                               (sine(a / 10.3 - b / 18.3 + phase_[5]) + sine(a / 15.1 + phase_[6]));
  const double h = height(c.x, c.z);
  if (h < spacing_ / 2) return c;
  c.first = (i + k) & 1;
  if (h < spacing_) {
    c.layers = 1;
    c.top = h / 2;
    return c;
  }
  c.layers = 1 + static_cast<std::int64_t>(std::floor((h - spacing_) / site + 0.5));
  c.top = h - spacing_ / 2;
  c.step = c.layers > 1 ? (h - spacing_) / static_cast<double>(c.layers - 1) : 0;
  return c;
}

namespace {

// Calls visit(x, y, z), relative to the centre, for the particles of a drop: spirals of equal areas
// on shells, the first s/2 below its surface, one particle per s^3. The smallest drop is one.
template <class Visit>
void visit_drop(double radius, double spacing, Visit&& visit) {
  constexpr double kShell = 0.85;           // from one to the next, s
  constexpr double kGolden = 0.3819660113;  // of a turn
  constexpr double kSphere = 12.566370614359172;
  double turn = 0;
  for (double r = radius - spacing / 2;; r -= kShell * spacing) {
    const auto n =
        static_cast<std::int64_t>(kSphere * kShell * (r / spacing) * (r / spacing) + 0.5);
    if (r < kShell / 2 * spacing || n < 2) {
      if (r >= 0) visit(0.0, 0.0, 0.0);
      return;
    }
    for (std::int64_t i = 0; i < n; ++i, turn += kGolden) {
      const double y = 1 - static_cast<double>(2 * i + 1) / static_cast<double>(n);
      const double ring = r * std::sqrt(1 - y * y);
      visit(ring * sine(turn + 0.25), r * y, ring * sine(turn));
    }
  }
}

}  // namespace

std::int64_t DamBreak::count_at(double spacing) {
  spacing_ = spacing;
  std::int64_t count = 0;
  const std::int64_t nx = columns_along(kLength, spacing), nz = columns_along(kWidth, spacing);
  for (std::int64_t i = 0; i < nx; ++i)
    for (std::int64_t k = 0; k < nz; ++k) count += column(i, k).size();
  for (const Drop& drop : drops_) {
    if (drop.radius < spacing / 2) continue;
    visit_drop(drop.radius, spacing, [&](double, double, double) { ++count; });
  }
  return count;
}

// The largest spacing found with sites for at least `wanted` particles. The number of sites jumps
// by a thousandth and more when another row of columns fits the tank: the surplus stays empty.
void DamBreak::find_spacing(std::int64_t wanted) {
  constexpr int kSteps = 256;
  double volume = 0;
  for (int i = 0; i < kSteps; ++i)
    for (int k = 0; k < kSteps; ++k)
      volume += height((i + 0.5) * kLength / kSteps, (k + 0.5) * kWidth / kSteps);
  volume *= kLength * kWidth / (kSteps * kSteps);
  const double n = static_cast<double>(wanted);
  // Rounded to a float, so that it does not depend on the last bits of the library's cube root.
  double spacing = static_cast<float>(cube_root(volume / n)), best = 0;
  for (int round = 0; round < 6; ++round) {
    const std::int64_t count = count_at(spacing);
    if (count >= wanted && spacing > best) best = spacing;
    const double off = static_cast<double>(count) / n;
    if (count >= wanted && off < 1.0005) break;
    spacing = static_cast<float>(spacing * cube_root(off) * 0.9999);
  }
  if (best == 0)
    for (best = spacing; count_at(best) < wanted; best *= 0.999) {
    }
  sites_ = count_at(best);
  spare_ = sites_ - wanted;
}

// Makes the particles and hands them out.
class DamBreak::Emission {
 public:
  Emission(const DamBreak& dam, const std::function<void(std::span<const float>)>& take)
      : dam_(dam), take_(take) {
    block_.reserve(3 * kBlock);
  }

  void run() {
    emit_body();
    emit_drops();
    emit_spray();
    if (!block_.empty()) take_(block_);
  }

 private:
  struct Noise {
    double x, y, z;
  };

  // Spare sites are spread evenly.
  bool is_spare() {
    const std::int64_t before = site_ * dam_.spare_ / dam_.sites_;
    return ++site_ * dam_.spare_ / dam_.sites_ != before;
  }

  void put(double x, double y, double z) {
    block_.push_back(static_cast<float>(x));
    block_.push_back(static_cast<float>(y));
    block_.push_back(static_cast<float>(z));
    ++made_;
    if (block_.size() < 3 * kBlock) return;
    take_(block_);
    block_.clear();
  }

  // Six fields of ten bits: the sum of two is triangular on [-1, 1], whose deviation is 1/sqrt(6).
  Noise noise() const {
    const double reach = dam_.noise_ * 2.449489742783178 * dam_.spacing_;
    const std::uint64_t bits = mixed(dam_.seed_ ^ mixed(static_cast<std::uint64_t>(made_)));
    const auto field = [&](int k) { return static_cast<double>(bits >> (10 * k) & 1023); };
    const auto triangular = [&](int k) { return reach * ((field(k) + field(k + 1)) / 1023 - 1); };
    return {triangular(0), triangular(2), triangular(4)};
  }

  void emit_body() {
    const std::int64_t nx = columns_along(kLength, dam_.spacing_),
                       nz = columns_along(kWidth, dam_.spacing_);
    const double nearby = dam_.spacing_ / 4;
    for (std::int64_t i = 0; i < nx; ++i)
      for (std::int64_t k = 0; k < nz; ++k) {
        const Column c = dam_.column(i, k);
        if (c.size() == 0) continue;
        // A particle that is moved sideways follows the surface.
        const double h = dam_.height(c.x, c.z);
        const double slope_x = (dam_.height(c.x + nearby, c.z) - h) / nearby;
        const double slope_z = (dam_.height(c.x, c.z + nearby) - h) / nearby;
        for (std::int64_t layer = c.first; layer < c.layers; layer += 2) {
          if (is_spare()) continue;
          const Noise e = noise();
          const double y = c.top - static_cast<double>(layer) * c.step;
          const double share = y / std::max(c.top, 1e-9);  // the floor stays flat
          put(c.x + e.x, y + e.y + share * (slope_x * e.x + slope_z * e.z), c.z + e.z);
        }
      }
  }

  void emit_drops() {
    for (const Drop& drop : dam_.drops_) {
      if (drop.radius < dam_.spacing_ / 2) continue;
      visit_drop(drop.radius, dam_.spacing_, [&](double x, double y, double z) {
        if (is_spare()) return;
        const Noise e = noise();
        put(drop.centre[0] + x + e.x, drop.centre[1] + y + e.y, drop.centre[2] + z + e.z);
      });
    }
  }

  // Lone particles in the air above the tongue, apart from the water and the drops.
  void emit_spray() {
    Random random(dam_.seed_ ^ 0x5ca1ab1eu);
    while (made_ < dam_.size_) {
      const double q = random.uniform(), z = random.uniform(0, kWidth), up = random.uniform();
      const double x = 1.2 + 1.8 * q;
      const double y =
          dam_.height(x, z) + 2 * dam_.spacing_ + 0.6 * up * up * (0.2 + 3.2 * q * (1 - q));
      const bool apart = std::all_of(dam_.drops_.begin(), dam_.drops_.end(), [&](const Drop& drop) {
        const double dx = x - drop.centre[0], dy = y - drop.centre[1], dz = z - drop.centre[2];
        const double least = drop.radius + dam_.spacing_;
        return dx * dx + dy * dy + dz * dz > least * least;
      });
      if (apart) put(x, y, z);
    }
  }

  const DamBreak& dam_;
  const std::function<void(std::span<const float>)>& take_;
  std::vector<float> block_;
  std::int64_t made_ = 0, site_ = 0;
};

void DamBreak::emit(const std::function<void(std::span<const float>)>& take) const {
  Emission(*this, take).run();
}

Particles DamBreak::particles() const {
  Particles particles;
  particles.particle_radius = particle_radius();
  for (std::vector<float>* axis : {&particles.x, &particles.y, &particles.z})
    axis->reserve(static_cast<std::size_t>(size_));
  emit([&](std::span<const float> block) {
    for (std::size_t k = 0; k < block.size(); k += 3) {
      particles.x.push_back(block[k]);
      particles.y.push_back(block[k + 1]);
      particles.z.push_back(block[k + 2]);
    }
  });
  return particles;
}

}  // namespace meniscus
