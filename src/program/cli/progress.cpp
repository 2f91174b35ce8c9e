#include "program/cli/progress.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "base/elapsed.hpp"
#include "base/printable.hpp"
#include "base/printed.hpp"
#include "program/cli/terminal.hpp"

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

Working::Working(std::size_t programs, bool quiet, std::chrono::milliseconds between_lines)
    : programs_(programs), quiet_(quiet), shown_(!quiet && isatty(STDERR_FILENO) == 1) {
  if (quiet_) return;
  thread_ = std::jthread([this, every = shown_ ? kRedrawn : between_lines] {
    std::unique_lock lock(mutex_);
    while (!ended_.wait_for(lock, every, [this] { return over_; })) {
      if (shown_ && (!phase_.empty() || begun_ > 0) && Clock::now() - start_ > kPatience) draw();
      if (!shown_ && !phase_.empty()) say();
    }
  });
}

Working::~Working() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
    hide();
  }
  ended_.notify_all();
}

void Working::phase(const std::string& what) {
  const std::lock_guard lock(mutex_);
  hide();
  phase_ = what;
  share_ = 0;
  start_ = Clock::now();
}

void Working::reached(double share) {
  const std::lock_guard lock(mutex_);
  share_ = share;
}

void Working::building(int begun) {
  const std::lock_guard lock(mutex_);
  begun_ = std::max(begun_, begun);
  if (quiet_ || shown_ || std::exchange(said_, true)) return;
  print_line(stderr, printed("%-10s building %s, once per device", "kernels",
                             programs_ > 0 ? counted(programs_, "program").c_str() : "them"));
}

void Working::built() {
  const std::lock_guard lock(mutex_);
  hide();
  begun_ = 0;
}

void Working::past(const std::function<void()>& print) {
  const std::lock_guard lock(mutex_);
  hide();
  print();
}

void Working::hide() {
  if (std::exchange(drawn_, false)) {
    std::fputs("\r\x1b[K", stderr);
    std::fflush(stderr);
  }
}

std::string Working::how_far() const {
  const double seconds = seconds_since(start_);
  const std::string far = share_ > 0 ? printed("%.0f %%, ", 100 * share_) : "";
  return printed("%s, %s%.0f s", phase_.c_str(), far.c_str(), seconds);
}

void Working::say() { print_line(stderr, printed("%-10s ", "working") + how_far()); }

void Working::draw() {
  drawn_ = true;
  if (begun_ == 0) return draw_over(how_far());
  if (programs_ == 0) return draw_over(printed("building kernels, once per device (%d)", begun_));
  constexpr std::size_t kShort = 20;  // characters
  const std::size_t done = static_cast<std::size_t>(begun_ - 1);
  const std::string bar(std::min(kShort, kShort * done / programs_), '#');
  draw_over(printed("building kernels, once per device (%d of %zu) [%-*s]", begun_, programs_,
                    static_cast<int>(kShort), bar.c_str()));
}

}  // namespace meniscus::cli
