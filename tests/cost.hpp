// What an action costs: hostile files are small and must stay so.
#pragma once

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>
#include <stdexcept>

namespace meniscus {

struct Cost {
  double seconds = 0;    // of the processor, whatever else runs
  double megabytes = 0;  // the most that the process had at a time
};

// What sanitizers without optimization make of a second.
#if defined(__SANITIZE_ADDRESS__)
inline constexpr double kSlower = 4;
#elif defined(__has_feature)
inline constexpr double kSlower = __has_feature(address_sanitizer) ? 4 : 1;
#else
inline constexpr double kSlower = 1;
#endif

/// Runs `action` in a process of its own, which is ended after a minute.
inline Cost cost_of(const std::function<void()>& action) {
  const pid_t child = fork();
  if (child == 0) {
    alarm(60);
    try {
      action();
    } catch (...) {
      _exit(1);
    }
    _exit(0);
  }
  int status = 0;
  rusage usage{};
  if (wait4(child, &status, 0, &usage) != child) throw std::runtime_error("wait4 failed");
  if (status != 0) throw std::runtime_error("the action crashed, threw or took a minute");
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return {(seconds(usage.ru_utime) + seconds(usage.ru_stime)) / kSlower,
          static_cast<double>(usage.ru_maxrss) / 1024};
}

}  // namespace meniscus
