// What the program does when it is told to stop, when a file grows beyond a limit, and when it
// crashes.
#pragma once

#include <atomic>

namespace meniscus::cli {

/// From here on SIGINT, SIGTERM and SIGHUP remove the outputs' temporary files and end the program
/// with 128 + signal, and a file that exceeds its size limit is a write error instead of a signal.
/// A crash removes the temporary files, too, and says in one line what may help; so does a library
/// that ends the process. Call before any thread is started.
void handle_signals();

/// The end of the program, when all that it has is written and closed. Nothing runs at exit: PoCL's
/// threads let go of a command a moment after they have said that it is done, and what runs at exit
/// would take PoCL, LLVM and oneTBB apart under them. (Returns `code` under the sanitizers, which
/// look for leaks at exit.)
int end_with(int code);

/// While one of these lives, the first such signal is only kept in `signal()`, so that the work
/// under way can be finished; a second one, a third of a
/// second later or more, ends the program. `what_now` is what the first one is
/// answered with: a literal, without "meniscus: ".
class GentleStop {
 public:
  explicit GentleStop(const char* what_now);
  ~GentleStop();
  GentleStop(const GentleStop&) = delete;
  GentleStop& operator=(const GentleStop&) = delete;

  /// 0: none so far.
  const std::atomic<int>& signal() const;
};

}  // namespace meniscus::cli
