// The host's signal handlers, where a library would leave its own.
#pragma once

#include <array>
#include <csignal>
#include <cstddef>
#include <mutex>

namespace meniscus {

/// Runtimes begin LLVM, which takes over the signals of a crash for ever and, when a runtime
/// aborts, says nothing. While one of these lives it may; then the host has the handlers again that
/// it had before.
class HostSignals {
 public:
  HostSignals() {
    const std::scoped_lock lock(mutex_);
    if (users_++ > 0) return;
    for (std::size_t k = 0; k < kCrashes.size(); ++k) sigaction(kCrashes[k], nullptr, &kept_[k]);
  }
  ~HostSignals() {
    const std::scoped_lock lock(mutex_);
    if (--users_ > 0) return;
    for (std::size_t k = 0; k < kCrashes.size(); ++k) sigaction(kCrashes[k], &kept_[k], nullptr);
  }
  HostSignals(const HostSignals&) = delete;
  HostSignals& operator=(const HostSignals&) = delete;

 private:
  static constexpr std::array kCrashes{SIGABRT, SIGBUS, SIGSEGV};
  static inline std::mutex mutex_;  // of several threads, the last that is done gives them back
  static inline int users_ = 0;
  static inline std::array<struct sigaction, kCrashes.size()> kept_;
};

}  // namespace meniscus
