// What there is to say about a frame, told as soon as it is known.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "meniscus/notice.hpp"

namespace meniscus {

/// The notices of a frame, in the order in which they become known.
class Notices {
 public:
  /// Nobody hears of them but who asks for all().
  Notices() = default;
  /// `tell` is called with each as it is added.
  explicit Notices(std::function<void(const Notice&)> tell) : tell_(std::move(tell)) {}

  /// Passes on what tell() throws; the notice is kept all the same.
  void add(Notice notice) {
    all_.push_back(std::move(notice));
    if (tell_) tell_(all_.back());
  }
  const std::vector<Notice>& all() const { return all_; }

 private:
  std::vector<Notice> all_;
  std::function<void(const Notice&)> tell_;
};

}  // namespace meniscus
