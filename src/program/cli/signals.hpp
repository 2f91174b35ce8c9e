// What the program does when it is told to stop, when a file grows beyond a limit, and when it
// crashes.
#pragma once

#include <atomic>

namespace meniscus::cli {

/// From here on SIGINT, SIGTERM and SIGHUP remove the outputs' temporary files and end the program
/// with 128 + signal, and a file that exceeds its size limit is a write error instead of a signal.
/// A crash removes the temporary files, too, and says in one line what may help. Call before any
/// thread is started.
void handle_signals();

/// While one of these lives, the first such signal is only kept in `signal()`, so that the frames
/// under way can be finished; a second one ends the program.
class GentleStop {
 public:
  GentleStop();
  ~GentleStop();
  GentleStop(const GentleStop&) = delete;
  GentleStop& operator=(const GentleStop&) = delete;

  /// 0: none so far.
  const std::atomic<int>& signal() const;
};

}  // namespace meniscus::cli
