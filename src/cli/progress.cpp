#include "cli/progress.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "printable.hpp"
#include "printed.hpp"

namespace meniscus::cli {
namespace {

constexpr std::chrono::milliseconds kPatience{500};
constexpr int kBar = 30;                // of the bar, characters
constexpr std::size_t kMostWords = 44;  // characters of a step

}  // namespace

std::size_t columns() {
  constexpr std::size_t kUsual = 80, kLeast = 20;
  winsize size{};
  const bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? std::max<std::size_t>(kLeast, size.ws_col) : kUsual;
}

void draw_over(const std::string& line) {
  const std::size_t most = columns() - 1;
  std::fprintf(stderr, "\r%s\x1b[K", printable(line, most).substr(0, most).c_str());
  std::fflush(stderr);
}

Progress::Progress(std::string what, std::string unit, std::int64_t total, bool quiet)
    : what_(std::move(what)),
      unit_(std::move(unit)),
      total_(std::max<std::int64_t>(1, total)),
      shown_(!quiet && isatty(STDERR_FILENO) == 1),
      next_(start_ + kPatience) {}

Progress::~Progress() { hide(); }

void Progress::hide() {
  if (std::exchange(drawn_, false)) std::fputs("\r\x1b[K", stderr);
}

void Progress::reached(std::int64_t done, const std::string& step) {
  if (!shown_) return;
  const auto now = Clock::now();
  if (now < (step.empty() ? next_ : start_ + kPatience)) return;
  next_ = now + kRedrawn;
  drawn_ = true;
  const double share =
      std::clamp(static_cast<double>(done) / static_cast<double>(total_), 0.0, 1.0);
  const double seconds = std::chrono::duration<double>(now - start_).count();
  const std::string bar(static_cast<std::size_t>(share * kBar), '#');
  const std::string words =
      unit_.empty() ? step.substr(0, kMostWords)
                    : printed("%.1f M ", 1e-6 * static_cast<double>(done) / seconds) + unit_ + "/s";
  draw_over(printed("%-10s [%-*s] %3.0f %%, %s", what_.c_str(), kBar, bar.c_str(), 100 * share,
                    words.c_str()));
}

}  // namespace meniscus::cli
