// Runs the program `meniscus` as a user would, and looks at what it leaves behind.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "io/temporary_folder.hpp"

namespace meniscus::test {

/// Words of a command line.
using Words = std::vector<std::string>;
inline Words operator+(Words words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

struct Outcome {
  int exit_code = -1;  // 128 + signal when a signal ended it, as a shell has it
  std::string out, err;
};

struct Conditions {
  std::vector<std::pair<std::string, std::string>> environment;  // set; an empty value unsets
  long file_size_limit = 0;                                      // bytes; 0: none
  std::vector<std::string> launcher = {};                        // before the program: mpirun -n 2
  std::string program = MENISCUS_PROGRAM;
};

/// Where it is killed when it has not ended in time.
inline Conditions in_time(int seconds) {
  return {{}, 0, {"/usr/bin/env", "timeout", "-s", "KILL", std::to_string(seconds)}};
}

/// A test with a folder of its own, in which the program runs.
class Program : public testing::Test {
 protected:
  virtual Outcome run(const Words& arguments, const Conditions& conditions = {}) const;

  /// The same of a command that is to succeed.
  Outcome run_well(const Words& arguments, const Conditions& conditions = {}) const;

  /// The same with standard error on a terminal of so many columns: `err` is what was shown there.
  Outcome run_on_terminal(int columns, const std::vector<std::string>& arguments) const;

  /// Starts the program and returns its process id; `wait_for` collects it.
  int start(const std::vector<std::string>& arguments, const Conditions& conditions = {}) const;
  Outcome wait_for(int process) const;

  std::string path(const std::string& name) const { return folder_ / name; }
  bool exists(const std::string& name) const { return std::filesystem::exists(folder_ / name); }
  std::string read(const std::string& name) const;
  void write(const std::string& name, const std::string& bytes) const;

  /// Bytes of the files whose names begin so, by name.
  std::map<std::string, std::string> outputs(const std::string& stem) const;

  /// Names in the folder, sorted, but for the program's captured streams.
  std::vector<std::string> files() const;

  /// An ascii PLY with the header's particle radius 0.1 (0: without one), and with one velocity for
  /// all particles where it is given.
  void write_particles(const std::string& name, const std::vector<std::array<double, 3>>& points,
                       double radius = 0.1, const std::string& velocity = "") const;

 private:
  TemporaryFolder folder_;
};

/// n x n x n particles, 0.2 apart, around the origin.
std::vector<std::array<double, 3>> block(int n);

/// The bars that a terminal showed, without what erases the rest of their lines.
std::vector<std::string> bars_in(const std::string& shown);

/// Expects exit code `code` and, beside those of a batch's frames, one line on standard error that
/// begins as all errors do and contains each of `parts`; it is the last one.
void expect_error(const Outcome& outcome, int code, const std::vector<std::string>& parts);

}  // namespace meniscus::test
