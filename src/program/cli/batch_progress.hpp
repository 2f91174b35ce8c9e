// What the user sees while a sequence runs.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>

#include "program/batch/pace.hpp"
#include "program/batch/plan.hpp"
#include "program/batch/record.hpp"
#include "program/batch/warnings.hpp"

namespace meniscus::cli {

/// On a terminal one line with a bar, the rate, the time left and what the time goes into; else a
/// line for every frame, with the time left. Failures and the first warning of each kind, as soon
/// as it is known, are lines of their own in both cases; at the end, the frames that share one are
/// named. Standard error.
class BatchProgress {
 public:
  /// at_once  frames that are under way at the same time
  BatchProgress(std::size_t frames, std::size_t at_once, bool quiet);
  ~BatchProgress();  // removes the bar
  BatchProgress(const BatchProgress&) = delete;
  BatchProgress& operator=(const BatchProgress&) = delete;

  /// A kernel is being built, which is no part of the frames' time. From any thread.
  void building() { built_ = Clock::now(); }

  /// A frame that is under way has a warning. From any thread.
  void warned(const FrameJob& job, const std::string& warning);

  /// A frame is over. By one thread at a time.
  void over(const FrameRecord& record);

  double seconds() const;

 private:
  using Clock = std::chrono::steady_clock;

  std::string left() const;  // "3:20 left", where the pace is known
  void draw();
  void clear();
  void warn_of(std::int64_t frame, const std::string& input, const std::string& warning);

  std::size_t frames_, over_ = 0;  // all; over
  FrameWarnings warnings_;
  std::mutex mutex_;            // of all that changes, but for built_
  std::array<double, 3> ms_{};  // spent reading, extracting, writing
  bool quiet_, bar_;
  Clock::time_point begin_ = Clock::now(), next_ = begin_;
  std::atomic<Clock::time_point> built_ = begin_;  // when a kernel's building last began
  Pace pace_;
};

}  // namespace meniscus::cli
