#include "prepare/check_radius.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "base/exact_math.hpp"
#include "prepare/canonical_order.hpp"
#include "prepare/crowds.hpp"
#include "prepare/radius_estimate.hpp"
#include "stages/vec.hpp"

namespace meniscus {
namespace {

RadiusEstimate estimate_of(const Particles& particles, std::size_t samples) {
  Notices told_before;
  return estimate_radius(particles, canonical_order(particles, {}, told_before), samples);
}

// From the sample's density. It has no order, and so looks denser than it is in some places: this
// is a fifth too small.
double rough_radius(const Survey& survey) {
  Particles some;
  for (const auto& [x, y, z] : survey.sample) add_position(some, {x, y, z});
  constexpr std::size_t kFew = 16;  // every thinned frame pays for them
  return estimate_of(some, kFew).radius *
         cube_root(static_cast<double>(survey.sample.size()) / static_cast<double>(survey.finite));
}

// All particles in cubes around some of the sample.
Particles some_places(const ParticleSource& source, const Survey& survey, double side) {
  constexpr std::size_t kPlaces = 8;
  std::vector<std::array<float, 3>> sample = survey.sample;
  std::sort(sample.begin(), sample.end());
  std::vector<std::array<float, 3>> centres;
  for (std::size_t k = 0; k < kPlaces; ++k)
    centres.push_back(sample[(2 * k + 1) * sample.size() / (2 * kPlaces)]);
  const auto half = static_cast<float>(side / 2);
  return positions_where(source, [&](float x, float y, float z) {
    return std::any_of(centres.begin(), centres.end(), [&](const std::array<float, 3>& centre) {
      return std::abs(x - centre[0]) < half && std::abs(y - centre[1]) < half &&
             std::abs(z - centre[2]) < half;
    });
  });
}

bool fits(double radius, double fitting) {
  return !(fitting > 0) || (radius < kTooSmall * fitting && fitting < kTooSmall * radius);
}

}  // namespace

bool check_radius(const ParticleSource& source, const Survey& survey, double radius,
                  Notices& notices) {
  constexpr double kSpacings = 12;  // along a cube: enough of its particles lie inside
  if (survey.sample.size() < kTelling) return false;
  const double rough = rough_radius(survey);
  if (fits(radius, rough)) return false;
  constexpr std::size_t kMany = 64;
  const RadiusEstimate estimate =
      estimate_of(some_places(source, survey, kSpacings * 2 * rough), kMany);
  if (!estimate.is_dense || fits(radius, estimate.radius)) return false;
  notices.add(radius_misfit(radius, estimate.radius));
  return true;
}

}  // namespace meniscus
