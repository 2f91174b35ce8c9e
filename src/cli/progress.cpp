#include "cli/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

namespace meniscus::cli {
namespace {

constexpr std::chrono::milliseconds kPatience{500}, kInterval{100};
constexpr int kWidth = 30;  // of the bar, characters

}  // namespace

Progress::Progress(std::string what, std::string unit, std::int64_t total, bool quiet)
    : what_(std::move(what)),
      unit_(std::move(unit)),
      total_(std::max<std::int64_t>(1, total)),
      shown_(!quiet && isatty(STDERR_FILENO) == 1),
      next_(start_ + kPatience) {}

Progress::~Progress() {
  if (drawn_) std::fputs("\r\x1b[K", stderr);
}

void Progress::reached(std::int64_t done) {
  if (!shown_) return;
  const auto now = Clock::now();
  if (now < next_) return;
  next_ = now + kInterval;
  drawn_ = true;
  const double share =
      std::clamp(static_cast<double>(done) / static_cast<double>(total_), 0.0, 1.0);
  const double seconds = std::chrono::duration<double>(now - start_).count();
  const std::string bar(static_cast<std::size_t>(share * kWidth), '#');
  std::fprintf(stderr, "\r%-10s [%-*s] %3.0f %%, %.1f M %s/s\x1b[K", what_.c_str(), kWidth,
               bar.c_str(), 100 * share, 1e-6 * static_cast<double>(done) / seconds, unit_.c_str());
  std::fflush(stderr);
}

}  // namespace meniscus::cli
