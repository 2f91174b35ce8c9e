#include "prepare/velocities.hpp"

namespace meniscus {

void VelocityCheck::report(const std::string& among, const Parameters& params,
                           Notices& notices) const {
  UsableCheck::report({.code = Code::bad_velocities,
                       .text = std::to_string(bad_) + " of " + std::to_string(seen_) + " " + among +
                               " have NaN, infinite or absurd velocities"},
                      params, notices);
}

}  // namespace meniscus
