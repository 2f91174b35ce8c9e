// This program once more, as a child: for what may crash, or needs another environment.
#pragma once

#include <sys/types.h>

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace meniscus {

/// "signal 11 (Segmentation fault)".
std::string name_of_signal(int signal);

/// A child that runs this program. It is ended with its parent, and with this. Where
/// MENISCUS_LAUNCHER is set, its words are put in front: an emulator, or a debugger ("valgrind
/// -q").
class ChildProcess {
 public:
  /// `arguments` follow the program's name. Its standard error goes to this process's, or is kept
  /// for last_words(). Throws Error when the system has no process or pipe to spare.
  ChildProcess(const std::vector<std::string>& arguments, bool keep_errors);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  enum class Read { line, end, late };
  /// The next line of its standard output, without the newline, when it comes within `seconds`.
  Read read_line(std::string& line, double seconds);

  /// Everything it writes from now on, until it closes its standard output.
  std::string read_all();

  void kill();

  /// Waits for its end. Empty after exit code 0, else "exit code 3" or "signal 11 (Segmentation
  /// fault)".
  std::string wait();

  /// The last line it wrote to standard error; empty: none, or they were not kept.
  std::string last_words() const;

 private:
  pid_t child_ = -1;
  int output_ = -1;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> errors_{nullptr, &std::fclose};
  std::string buffer_;  // read, but not yet asked for
};

}  // namespace meniscus
