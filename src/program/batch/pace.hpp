// How fast a batch runs now, for the time that is left.
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>

namespace meniscus {

/// Frames a second, told from those that ended last. What came before the first one, such as the
/// building of kernels, counts only while few have ended, and frames of long ago do not count, so
/// that the time left follows a simulation whose frames grow.
class Pace {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// at_once  frames that are under way at the same time, and so may end together
  Pace(Time begin, std::size_t at_once);

  /// Work on the frames begins only now: what went on before was no part of them.
  void begin(Time when);

  /// A frame ended. Times ascend.
  void ended(Time when);

  /// 0: not known, as long as none has ended.
  double frames_per_second() const;

 private:
  Time begin_;
  std::size_t few_;         // so many are too few to leave out the start
  std::size_t all_ = 0;     // that have ended
  std::deque<Time> ended_;  // those of the last while, and at least `few_` and one before them
};

}  // namespace meniscus
