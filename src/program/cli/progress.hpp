// A line on the terminal that says how far long work is.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace meniscus::cli {

/// How often a line is drawn again, at most.
inline constexpr std::chrono::milliseconds kRedrawn{100};

/// How often there is a line that stays, where standard error is no terminal.
inline constexpr std::chrono::milliseconds kBetweenLines{30'000};

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

/// "extracting   12 s", or "writing a.png, 35 %, 2 s" where it is known how far that is; or, while
/// kernels are built for the first time on a device, "building kernels, once per device (7 of 19)
/// [#######      ]": one line on standard error, from half a second on, kept up to date by a thread
/// of its own. Where standard error is no terminal, the building of kernels is one line that stays,
/// and what goes on is one after each `between_lines`. All functions may be called by several
/// threads.
class Working {
 public:
  /// `programs` there are in all; 0: that is not known.
  Working(std::size_t programs, bool quiet,
          std::chrono::milliseconds between_lines = kBetweenLines);
  ~Working();  // removes the line
  Working(const Working&) = delete;
  Working& operator=(const Working&) = delete;

  void phase(const std::string& what);  // begins; empty: nothing that takes long is under way
  void reached(double share);           // of the phase, 0 to 1
  void building(int begun);             // so many programs, the last one of them now
  void built();                         // no more are
  void past(const std::function<void()>& print);  // lets it print lines that stay

 private:
  using Clock = std::chrono::steady_clock;
  void draw();
  void say();
  void hide();
  std::string how_far() const;  // the phase

  std::size_t programs_;
  bool quiet_, shown_, drawn_ = false, said_ = false, over_ = false;
  std::string phase_;
  int begun_ = 0;
  double share_ = 0;
  Clock::time_point start_ = Clock::now();
  std::mutex mutex_;
  std::condition_variable ended_;
  std::jthread thread_;
};

}  // namespace meniscus::cli
