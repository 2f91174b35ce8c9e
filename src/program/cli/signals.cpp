#include "program/cli/signals.hpp"

#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <thread>

#include "base/elapsed.hpp"
#include "io/output_file.hpp"

namespace meniscus::cli {
namespace {

std::atomic<const char*> gentle{nullptr};  // what is said; null: signals end the program
std::atomic<int> kept{0};
constexpr double kSameSignal = .3;  // seconds

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
    std::chrono::steady_clock::time_point first;  // when the one that is kept came
    for (int signal = 0; sigwait(&stop, &signal) == 0;) {
      const char* what_now = gentle;
      // Who sends one to a process and to its group, as `timeout` does, means one.
      if (what_now && kept == signal && seconds_since(first) < kSameSignal) continue;
      if (what_now && kept.exchange(signal) == 0) {
        first = std::chrono::steady_clock::now();
        std::fprintf(stderr, "\nmeniscus: %s (again: at once)\n", what_now);
        continue;
      }
      remove_pending_outputs();
      ::_exit(128 + signal);
    }
  }).detach();
}

GentleStop::GentleStop(const char* what_now) {
  kept = 0;
  gentle = what_now;
}
GentleStop::~GentleStop() { gentle = nullptr; }

const std::atomic<int>& GentleStop::signal() const { return kept; }

}  // namespace meniscus::cli
