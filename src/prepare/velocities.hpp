// Velocities of particles on their way in: which of them can be used.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "meniscus/notice.hpp"
#include "meniscus/parameters.hpp"
#include "meniscus/types.hpp"

namespace meniscus {

/// What a particle has whose velocity cannot be used: the others around it speak for it.
inline constexpr Vec3 kNoVelocity{std::numeric_limits<float>::quiet_NaN(),
                                  std::numeric_limits<float>::quiet_NaN(),
                                  std::numeric_limits<float>::quiet_NaN()};
inline bool is_known(const Vec3& velocity) { return velocity.x == velocity.x; }

/// Looks at velocities one by one and counts those that cannot be used.
class VelocityCheck {
 public:
  /// The velocity of the particle `place` of the file, or kNoVelocity where a component is NaN,
  /// infinite, or so large (1e30) that sums of some may overflow.
  Vec3 checked(const Vec3& velocity, std::int64_t place);

  /// Adds what another one counted.
  void add(const VelocityCheck& other);

  /// Warns if there were any. Throws InputError when params.strict.
  ///
  ///   among  whose velocities they are: "particles"
  void report(const std::string& among, const Parameters& params,
              std::vector<Notice>& notices) const;

 private:
  std::int64_t seen_ = 0, bad_ = 0, first_bad_ = std::numeric_limits<std::int64_t>::max();
};

}  // namespace meniscus
