#include "program/batch/pace.hpp"

#include <algorithm>

namespace meniscus {
namespace {

constexpr std::chrono::seconds kWhile{30};  // frames that ended so long ago do not count
constexpr std::size_t kFew = 12, kFewOfEach = 4;

}  // namespace

Pace::Pace(Time begin, std::size_t at_once)
    : begin_(begin), few_(std::max(kFew, kFewOfEach * at_once)) {}

void Pace::begin(Time when) {
  if (all_ == 0) begin_ = std::max(begin_, when);
}

void Pace::ended(Time when) {
  ++all_;
  ended_.push_back(when);
  while (ended_.size() > few_ + 1 && when - ended_[1] > kWhile) ended_.pop_front();
}

double Pace::frames_per_second() const {
  if (all_ == 0) return 0;
  const bool few = ended_.size() <= few_;
  const std::chrono::duration<double> took = ended_.back() - (few ? begin_ : ended_.front());
  const std::size_t frames = few ? all_ : ended_.size() - 1;
  return took.count() > 0 ? static_cast<double>(frames) / took.count() : 0;
}

}  // namespace meniscus
