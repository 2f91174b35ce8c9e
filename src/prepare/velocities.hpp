// Velocities of particles on their way in: which of them can be used.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "base/notices.hpp"
#include "meniscus/parameters.hpp"
#include "meniscus/types.hpp"
#include "prepare/usable.hpp"

namespace meniscus {

/// Of a particle whose own velocity cannot be used: it gets the mean of those around it.
inline constexpr Vec3 kNoVelocity{std::numeric_limits<float>::quiet_NaN(),
                                  std::numeric_limits<float>::quiet_NaN(),
                                  std::numeric_limits<float>::quiet_NaN()};
inline bool is_known(const Vec3& velocity) { return velocity.x == velocity.x; }

class VelocityCheck : public UsableCheck {
 public:
  /// The velocity of the particle `place` of the file, or kNoVelocity where it cannot be used.
  Vec3 checked(const Vec3& velocity, std::int64_t place) {
    return usable(place, velocity.x, velocity.y, velocity.z) ? velocity : kNoVelocity;
  }

  /// Warns if there were any. Throws InputError when params.strict.
  ///
  ///   among  whose velocities they are: "particles"
  void report(const std::string& among, const Parameters& params, Notices& notices) const;
};

}  // namespace meniscus
