#include "program/cli/batch_progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "base/elapsed.hpp"
#include "base/printed.hpp"
#include "program/cli/progress.hpp"
#include "program/cli/terminal.hpp"

namespace meniscus::cli {
namespace {

constexpr std::size_t kShortBar = 8, kLongBar = 24;  // characters
constexpr std::size_t kMostRepeated = 20;  // kinds of warnings that are printed again at the end
constexpr std::size_t kNarrow = 96;        // terminals below it have the short one, columns

}  // namespace

BatchProgress::BatchProgress(std::size_t frames, std::size_t at_once, bool quiet)
    : frames_(frames),
      quiet_(quiet),
      bar_(!quiet && isatty(STDERR_FILENO) == 1),
      pace_(begin_, at_once) {
  if (bar_) draw();
}

BatchProgress::~BatchProgress() {
  clear();
  if (frames_ < 2) return;  // a single frame's have just been printed
  const std::vector<FrameWarning>& kinds = warnings_.kinds();
  for (std::size_t k = 0; k < std::min(kMostRepeated, kinds.size()); ++k)
    print_line(stderr,
               "meniscus: warning: " + named_frames(kinds[k].frames) + ": " + kinds[k].message());
  if (kinds.size() > kMostRepeated)
    print_line(stderr, "meniscus: warning: " + std::to_string(kinds.size() - kMostRepeated) +
                           " more kinds of warnings, see above");
}

double BatchProgress::seconds() const { return seconds_since(begin_); }

void BatchProgress::warn_of(std::int64_t frame, const std::string& input,
                            const std::string& warning) {
  clear();
  print_line(stderr, printed("meniscus: warning: frame %lld: %s: %s", static_cast<long long>(frame),
                             input.c_str(), warning.c_str()));
}

void BatchProgress::warned(const FrameJob& job, const std::string& warning) {
  const std::lock_guard lock(mutex_);
  if (warnings_.tell(warning)) warn_of(job.frame, job.input, warning);
}

void BatchProgress::over(const FrameRecord& record) {
  const std::lock_guard lock(mutex_);
  ++over_;
  const long long frame = record.frame;
  for (const std::string& warning : record.warnings)
    if (warnings_.add(record.frame, warning)) warn_of(frame, record.input, warning);
  if (record.status == FrameStatus::failed) {
    clear();
    print_line(stderr, printed("meniscus: error: frame %lld: %s", frame, record.error.c_str()));
  }
  const std::array<double, 3> ms{record.read_ms, record.extract_ms, record.write_ms};
  if (record.status == FrameStatus::skipped) {
    pace_.begin(Clock::now());
  } else {
    pace_.begin(built_);
    pace_.ended(Clock::now());
    for (std::size_t k = 0; k < ms.size(); ++k) ms_[k] += ms[k];
  }
  if (!quiet_ && !bar_ && record.status == FrameStatus::done)
    print_line(stderr,
               printed("frame %lld done (%zu of %zu): %.0f ms read, %.0f extract, %.0f write",
                       frame, over_, frames_, ms[0], ms[1], ms[2]) +
                   (over_ < frames_ && pace_.frames_per_second() > 0 ? "; " + left() : "") +
                   (record.again.empty() ? "" : "; again, since " + record.again));
  if (bar_ && (over_ == frames_ || Clock::now() >= next_)) draw();
}

std::string BatchProgress::left() const {
  return duration(static_cast<double>(frames_ - over_) / pace_.frames_per_second()) + " left";
}

void BatchProgress::draw() {
  next_ = Clock::now() + kRedrawn;
  const double share =
      frames_ > 0 ? static_cast<double>(over_) / static_cast<double>(frames_) : 1.0;
  std::string words = grouped(over_) + " of " + grouped(frames_);
  // A line that is longer than the terminal is wide would stay there at every turn.
  const std::size_t width = columns() < kNarrow ? kShortBar : kLongBar;
  const std::size_t room = columns() - width - std::string("[] ").size() - 1;
  const double all_ms = ms_[0] + ms_[1] + ms_[2];
  if (const double per_second = pace_.frames_per_second(); per_second > 0 && all_ms > 0) {
    for (const std::string& more :
         {", " + frame_rate(per_second) + ", " + left(),
          printed("; read %.0f, extract %.0f, write %.0f %%", 100 * ms_[0] / all_ms,
                  100 * ms_[1] / all_ms, 100 * ms_[2] / all_ms)})
      if (words.size() + more.size() <= room) words += more;
  }
  const std::string bar(static_cast<std::size_t>(share * static_cast<double>(width)), '#');
  draw_over(printed("[%-*s] %s", static_cast<int>(width), bar.c_str(), words.c_str()));
}

void BatchProgress::clear() {
  if (bar_) std::fputs("\r\x1b[K", stderr);
}

}  // namespace meniscus::cli
