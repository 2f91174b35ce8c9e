#include "program/cli/signals.hpp"

#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <thread>

#include "io/output_file.hpp"

namespace meniscus::cli {
namespace {

std::atomic<bool> gentle{false};
std::atomic<int> kept{0};

// PoCL aborts where it gets no memory or cannot make sense of its cache, at every run anew, and
// loading what a full disk has cut off is a bus error. Then one line says what to do, and the
// signal ends the program as it would have. Async-signal-safe.
void say_what_to_do(int signal) {
  remove_pending_outputs();
  const auto say = [](const char* text) {
    if (::write(STDERR_FILENO, text, std::strlen(text)) < 0) return;
  };
  // As PoCL looks for it.
  const char *folder = std::getenv("POCL_CACHE_DIR"), *below = "";
  if (!folder) folder = std::getenv("XDG_CACHE_HOME"), below = "/pocl";
  if (!folder) folder = std::getenv("HOME"), below = "/.cache/pocl";
  say("meniscus: error: ended by ");
  say(signal == SIGABRT ? "an abort" : signal == SIGBUS ? "a bus error" : "a segmentation fault");
  say(", most likely in the OpenCL runtime: for lack of memory (use a smaller image, or fewer "
      "frames "
      "at once), or because what it has compiled before is damaged or its disk full (remove ");
  say(folder ? folder : "");
  say(folder ? below : "its cache");
  say(", or set POCL_CACHE_DIR to an empty folder)\n");
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

}  // namespace

void handle_signals() {
  // Writes that fail instead: to a file that is too large, and to who has stopped listening. A
  // batch whose progress nobody reads any more goes on.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  for (int signal : {SIGABRT, SIGBUS, SIGSEGV}) {
    struct sigaction now;
    if (sigaction(signal, nullptr, &now) != 0 || now.sa_handler != SIG_DFL)
      continue;  // a sanitizer
    now.sa_handler = say_what_to_do;
    now.sa_flags = static_cast<int>(SA_RESETHAND);
    sigaction(signal, &now, nullptr);
  }
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
