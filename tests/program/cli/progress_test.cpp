#include "program/cli/progress.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <stdlib.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <thread>

namespace meniscus::cli {
namespace {

using testing::ContainsRegex;
using testing::IsEmpty;
using namespace std::chrono_literals;

/// Standard error is a pipe while one of these lives, as where a program's output is kept, or a
/// terminal.
class Listener {
 public:
  explicit Listener(bool terminal = false) : kept_(dup(STDERR_FILENO)) {
    if (terminal)
      open_terminal();
    else if (pipe(ends_) != 0)
      ADD_FAILURE() << "no pipe can be made";
    dup2(ends_[1], STDERR_FILENO);
    close(ends_[1]);
  }
  ~Listener() {
    hang_up();
    close(ends_[0]);
  }

  /// Waits for the next line; empty where none comes in a minute, or nobody can write any more.
  std::string line() {
    std::string line;
    pollfd there{ends_[0], POLLIN, 0};
    for (char c; poll(&there, 1, 60'000) > 0 && read(ends_[0], &c, 1) == 1 && c != '\n';) line += c;
    return line;
  }

  void hang_up() {
    if (kept_ < 0) return;
    dup2(kept_, STDERR_FILENO);
    close(kept_);
    kept_ = -1;
  }

 private:
  void open_terminal() {
    ends_[0] = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (ends_[0] < 0 || grantpt(ends_[0]) != 0 || unlockpt(ends_[0]) != 0)
      ADD_FAILURE() << "no terminal can be made";
    ends_[1] = open(ptsname(ends_[0]), O_RDWR | O_NOCTTY | O_CLOEXEC);
  }
  int kept_, ends_[2];
};

TEST(Working, SaysAgainAndAgainWhatGoesOnWhereThereIsNoTerminal) {
  Listener listener;
  Working working(0, false, 1ms);
  working.phase("fits");
  EXPECT_THAT(listener.line(), ContainsRegex("^working    fits, [0-9]+ s$"));
  EXPECT_THAT(listener.line(), ContainsRegex("^working    fits, [0-9]+ s$"));
  working.reached(0.35);
  std::string line;
  do line = listener.line();  // those before are in the pipe
  while (!line.empty() && line.find('%') == std::string::npos);
  EXPECT_THAT(line, ContainsRegex("^working    fits, 35 %, [0-9]+ s$"));
  working.phase("writing a.png");
  do line = listener.line();
  while (!line.empty() && line.find("fits") != std::string::npos);
  EXPECT_THAT(line, ContainsRegex("^working    writing a.png, [0-9]+ s$"));
}

TEST(Working, LetsLinesPastTheOneOnATerminal) {
  Listener listener(true);
  Working working(0, false);
  working.phase("fits");
  std::this_thread::sleep_for(900ms);  // the line comes after half a second, ten times each
  working.past([] { std::fputs("a warning\n", stderr); });
  // What erases the line goes before; a terminal begins lines with a carriage return.
  EXPECT_THAT(listener.line(), ContainsRegex("^(\r?fits, [0-9]+ s.\\[K)+\r.\\[Ka warning\r?$"));
}

TEST(Working, SaysNothingOfWhatIsOverSoonerOrIsQuiet) {
  Listener listener;
  {
    Working soon(0, false, 1h), quiet(0, true, 1ms), no_phase(0, false, 1ms);
    soon.phase("fits");
    quiet.phase("fits");
    std::this_thread::sleep_for(10ms);  // time in which it could say something
  }
  listener.hang_up();
  EXPECT_THAT(listener.line(), IsEmpty());
}

}  // namespace
}  // namespace meniscus::cli
