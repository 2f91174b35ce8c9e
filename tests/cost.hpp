// What an action costs: hostile files are small and must stay so.
#pragma once

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <stdexcept>

namespace meniscus {

struct Cost {
  double seconds = 0;
  double megabytes = 0;  // the most that the process had at a time
};

/// Runs `action` in a process of its own, which is ended after a minute.
inline Cost cost_of(const std::function<void()>& action) {
  const auto begin = std::chrono::steady_clock::now();
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
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
  return {time.count(), static_cast<double>(usage.ru_maxrss) / 1024};
}

}  // namespace meniscus
