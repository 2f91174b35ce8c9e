#include "prepare/usable.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "meniscus/error.hpp"

namespace meniscus {

void UsableCheck::add(const UsableCheck& other) {
  seen_ += other.seen_;
  bad_ += other.bad_;
  first_bad_ = std::min(first_bad_, other.first_bad_);
}

void UsableCheck::report(Notice notice, const Parameters& params, Notices& notices) const {
  if (bad_ == 0) return;
  notice.text += " (the first is particle " + std::to_string(first_bad_) + ")";
  notice.text += params.strict ? "; leave " + setting("strict") + " away to do without them"
                               : ", which were left out";
  notice.place = first_bad_;
  notice.count = bad_;
  notice.of = seen_;
  if (params.strict) throw InputError(notice);
  notices.add(std::move(notice));
}

}  // namespace meniscus
