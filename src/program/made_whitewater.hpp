// Whitewater for a frame of water, made and not simulated: what examples, tests and measurements
// are drawn with, without a solver.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "meniscus/types.hpp"

namespace meniscus {

/// Foam lies on the surface where the water is fast, spray about drops and splash, bubbles in water
/// whose particles move differently from those around. (After the potentials of Ihmsen, Akinci,
/// Akinci and Teschner 2012, for one frame alone: nothing is advected.)
class MadeWhitewater {
 public:
  static constexpr std::int64_t kMost = 1'000'000'000;

  /// `water` has velocities and a particle radius. Throws InvalidArgument unless it does and has
  /// places for this type, and 1 <= particles <= kMost.
  MadeWhitewater(const Particles& water, WhitewaterType type, std::int64_t particles,
                 std::uint64_t seed);

  /// Hands out all particles in order, x y z, vx vy vz and radius (world units) of at most kBlock
  /// at a time, and keeps none. The same for the same arguments on every machine.
  static constexpr std::size_t kBlock = std::size_t{1} << 14;
  static constexpr std::size_t kValues = 7;  // of a particle
  void emit(const std::function<void(std::span<const float>)>& take) const;

 private:
  struct Source {  // a particle of water
    Vec3 at, velocity, outward;
  };
  void add(const Vec3& at, const Vec3& velocity, const Vec3& outward, double weight);

  WhitewaterType type_;
  std::int64_t particles_;
  std::uint64_t seed_;
  double radius_;  // of the water's particles
  std::vector<Source> sources_;
  std::vector<double> up_to_;  // sums of their weights
};

}  // namespace meniscus
