#include "cli/signals.hpp"

#include <unistd.h>

#include <csignal>
#include <thread>

#include "io/output_file.hpp"

namespace meniscus::cli {

void handle_signals() {
  std::signal(SIGXFSZ, SIG_IGN);
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
    int signal = 0;
    if (sigwait(&stop, &signal) != 0) return;
    remove_pending_outputs();
    ::_exit(128 + signal);
  }).detach();
}

}  // namespace meniscus::cli
