// What the user sees while a sequence runs.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>

#include "program/batch/record.hpp"
#include "program/batch/warnings.hpp"

namespace meniscus::cli {

/// On a terminal one line with a bar, the rate, the time left and what the time goes into; else a
/// line for every frame. Failures and the first warning of each kind are lines of their own in both
/// cases; at the end, the frames that share one are named. Standard error.
class BatchProgress {
 public:
  BatchProgress(std::size_t frames, bool quiet);
  ~BatchProgress();  // removes the bar
  BatchProgress(const BatchProgress&) = delete;
  BatchProgress& operator=(const BatchProgress&) = delete;

  /// A frame is over.
  void over(const FrameRecord& record);

  double seconds() const;

 private:
  using Clock = std::chrono::steady_clock;

  void draw();
  void clear();

  std::size_t frames_, over_ = 0, worked_ = 0;  // all; over; of these, not skipped
  FrameWarnings warnings_;
  std::array<double, 3> ms_{};  // spent reading, extracting, writing
  bool quiet_, bar_;
  Clock::time_point begin_ = Clock::now(), next_ = begin_;
};

}  // namespace meniscus::cli
