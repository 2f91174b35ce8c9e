#include "prepare/velocities.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "meniscus/error.hpp"

namespace meniscus {

Vec3 VelocityCheck::checked(const Vec3& v, std::int64_t place) {
  constexpr float kMost = 1e30f;
  ++seen_;
  if (std::abs(v.x) < kMost && std::abs(v.y) < kMost && std::abs(v.z) < kMost) return v;
  ++bad_;
  first_bad_ = std::min(first_bad_, place);
  return kNoVelocity;
}

void VelocityCheck::add(const VelocityCheck& other) {
  seen_ += other.seen_;
  bad_ += other.bad_;
  first_bad_ = std::min(first_bad_, other.first_bad_);
}

void VelocityCheck::report(const std::string& among, const Parameters& params,
                           std::vector<Notice>& notices) const {
  if (bad_ == 0) return;
  Notice notice{.code = Code::bad_velocities,
                .text = std::to_string(bad_) + " of " + std::to_string(seen_) + " " + among +
                        " have NaN, infinite or absurd velocities (the first is particle " +
                        std::to_string(first_bad_) + ")",
                .place = first_bad_,
                .count = bad_,
                .of = seen_};
  notice.text += params.strict ? "; leave " + setting("strict") + " away to do without them"
                               : ", which were left out";
  if (params.strict) throw InputError(notice);
  notices.push_back(std::move(notice));
}

}  // namespace meniscus
