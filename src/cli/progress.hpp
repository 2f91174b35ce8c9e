// A line on the terminal that says how far long work is.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>

namespace meniscus::cli {

/// How often a line is drawn again, at most.
inline constexpr std::chrono::milliseconds kRedrawn{100};

/// How wide the terminal is, standard error.
std::size_t columns();

/// Draws a line over the one on the terminal, standard error; no more of it than fits: what went on
/// in the next line would stay there.
void draw_over(const std::string& line);

/// "what  [#####.....]  52 %, 12.3 M particles/s" on standard error, from half a second on, ten
/// times a second at most; or with the name of the step under way, whenever one begins. Silent when
/// standard error is no terminal.
class Progress {
 public:
  /// `unit` is what is counted, in the plural; empty: steps, whose names are shown instead of a
  /// rate.
  Progress(std::string what, std::string unit, std::int64_t total, bool quiet);
  ~Progress();  // removes the line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void reached(std::int64_t done, const std::string& step = "");
  void hide();  // so that a line can be printed; the next call of reached() draws it again
  bool shown() const { return shown_; }

 private:
  using Clock = std::chrono::steady_clock;
  std::string what_, unit_;
  std::int64_t total_;
  bool shown_;  // whether it is to be shown at all
  bool drawn_ = false;
  Clock::time_point start_ = Clock::now(), next_;
};

}  // namespace meniscus::cli
