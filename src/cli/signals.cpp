#include "cli/signals.hpp"

#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <thread>

#include "io/output_file.hpp"

namespace meniscus::cli {
namespace {

std::atomic<bool> gentle{false};
std::atomic<int> kept{0};

}  // namespace

void handle_signals() {
  // Writes that fail instead: to a file that is too large, and to who has stopped listening. A
  // batch whose progress nobody reads any more goes on.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  // All threads inherit the blocked signals, so only the one that waits for them gets them, and it
  // may do what a signal handler must not.
  sigset_t stop;
  sigemptyset(&stop);
  for (int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction now;
    if (sigaction(signal, nullptr, &now) == 0 && now.sa_handler == SIG_IGN) continue;  // nohup
    sigaddset(&stop, signal);
  }
  pthread_sigmask(SIG_BLOCK, &stop, nullptr);
  std::thread([stop] {
    for (int signal = 0; sigwait(&stop, &signal) == 0;) {
      if (gentle && kept.exchange(signal) == 0) {
        std::fputs("\nmeniscus: stopping when the frames under way are done (again: at once)\n",
                   stderr);
        continue;
      }
      remove_pending_outputs();
      ::_exit(128 + signal);
    }
  }).detach();
}

GentleStop::GentleStop() {
  kept = 0;
  gentle = true;
}
GentleStop::~GentleStop() { gentle = false; }

const std::atomic<int>& GentleStop::signal() const { return kept; }

}  // namespace meniscus::cli
