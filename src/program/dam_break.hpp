// A breaking dam of any number of particles, made and not simulated: what large frames are measured
// on, without a download.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "meniscus/types.hpp"

namespace meniscus {

/// A column of water that has collapsed in a tank of 3 x 1.5 units (x, z; y is up): waves, a tongue
/// with a roller on it, drops of many particles and spray of lone ones. The shape is the same for
/// every number of particles, up to the seed; their spacing follows.
///
/// Positions are the same for the same arguments on every machine. They sit on the sites of a
/// face-centred cubic lattice, one particle per s^3, in layers below the surface (drops: on
/// shells); the first lies s/2 deep, as in a relaxed fluid. The lattice is bent by .5 s, and each
/// particle is moved by a triangular noise along each axis.
class DamBreak {
 public:
  static constexpr std::int64_t kFewest = 10, kMost = 1'000'000'000;

  /// Standard deviation of the noise, s: as SPH leaves it, and the most there may be. With .29
  /// particles lie as irregularly as those of FLIP and MPM.
  static constexpr double kNoise = 0.05, kMostNoise = 1;

  /// Throws InvalidArgument unless kFewest <= particles <= kMost and 0 <= noise <= kMostNoise.
  /// Takes time: the spacing that gives this number is searched for.
  DamBreak(std::int64_t particles, std::uint64_t seed, double noise = kNoise);

  std::int64_t size() const { return size_; }
  double spacing() const { return spacing_; }
  double particle_radius() const { return spacing_ / 2; }

  /// Where the surface of the body of water lies above (x, z); 0 where the floor is dry.
  double height(double x, double z) const;

  struct Drop {
    std::array<double, 3> centre;
    double radius;
  };
  const std::vector<Drop>& drops() const { return drops_; }

  /// Hands out all particles in order, x y z of at most kBlock at a time, and keeps none.
  static constexpr std::size_t kBlock = std::size_t{1} << 14;
  void emit(const std::function<void(std::span<const float>)>& take) const;
  /// All of them in memory, in order, with the dam's particle radius.
  Particles particles() const;

 private:
  struct Wave {
    double kx, kz, phase, height;  // turns per unit, turns, units
  };
  struct Column;
  class Emission;
  Column column(std::int64_t i, std::int64_t k) const;
  std::int64_t count_at(double spacing);
  void find_spacing(std::int64_t wanted);
  void make_drops();

  std::int64_t size_;
  std::uint64_t seed_;
  double spacing_ = 0, noise_;
  std::int64_t sites_ = 0, spare_ = 0;  // of the body and the drops; left empty
  std::array<double, 7> phase_{};
  std::vector<Wave> waves_;
  std::vector<Drop> drops_;
};

}  // namespace meniscus
