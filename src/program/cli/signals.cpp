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

std::atomic<bool> over{false};

void say(const char* text) {
  if (::write(STDERR_FILENO, text, std::strlen(text)) < 0) return;
}

void say_where_the_cache_is() {
  // As PoCL looks for it.
  const char *folder = std::getenv("POCL_CACHE_DIR"), *below = "";
  if (!folder) folder = std::getenv("XDG_CACHE_HOME"), below = "/pocl";
  if (!folder) folder = std::getenv("HOME"), below = "/.cache/pocl";
  say(folder ? folder : "");
  say(folder ? below : "its cache");
}

// PoCL aborts where it gets no memory or cannot make sense of its cache, at every run anew, and
// loading what a full disk has cut off is a bus error. Then one line says what to do, and the
// signal ends the program as it would have. Async-signal-safe.
void say_what_to_do(int signal) {
  remove_pending_outputs();
  say("meniscus: error: ended by ");
  say(signal == SIGABRT ? "an abort" : signal == SIGBUS ? "a bus error" : "a segmentation fault");
  say(", most likely in the OpenCL runtime: ");
  if (!std::getenv("PATH")) say("because PATH is not set, where PoCL looks for the linker ld, or ");
  say("for lack of memory (use a smaller image, or fewer frames at once), or because what it has "
      "compiled before is damaged or its disk full (remove ");
  say_where_the_cache_is();
  say(", or set POCL_CACHE_DIR to an empty folder)\n");
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

// LLVM ends a process where it cannot write, on whatever thread that is. What would run then waits
// for the other threads, which wait for this one.
void say_who_ended_it() {
  if (over) return;
  remove_pending_outputs();
  say("meniscus: error: ended by a library, most likely the OpenCL runtime, whose words are above: "
      "the disk of ");
  say_where_the_cache_is();
  say(" may be full (free some space, or set POCL_CACHE_DIR to a folder elsewhere)\n");
  ::_exit(1);
}

}  // namespace

int end_with(int code) {
  over = true;
  std::fflush(nullptr);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
  return code;
#endif
#endif
  std::_Exit(code);
#endif
  return code;
}

void handle_signals() {
  // Writes that fail instead: to a file that is too large, and to who has stopped listening. A
  // batch whose progress nobody reads any more goes on.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  std::atexit(say_who_ended_it);
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
