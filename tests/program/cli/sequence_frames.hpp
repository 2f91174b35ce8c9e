// What the tests of sequences share: frames, the command, and what it leaves behind.
#pragma once

#include <cstdio>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "program/cli/program.hpp"

namespace meniscus::test {

/// A test with the frames of a sequence in its folder.
class Sequence : public Program {
 protected:
  /// d.0000.ply to d.<n-1>.ply: a block that grows.
  void write_sequence(int n) const {
    for (int frame = 0; frame < n; ++frame)
      write_particles(name("d.", frame, ".ply"), block(3 + frame % 3));
  }

  /// "d.0007.ply" of stem "d.", frame 7 and ending ".ply".
  static std::string name(const std::string& stem, int frame, const std::string& ending) {
    char number[16];
    std::snprintf(number, sizeof number, "%04d", frame);
    return stem + number + ending;
  }

  /// The command that extracts them, and more words behind it.
  static std::vector<std::string> words(const std::vector<std::string>& more = {}) {
    return Words{"extract",    "d.####.ply", "--size",     "64x48", "-o",
                 "o.####.exr", "-o",         "o.####.png", "-o",    "o.####.ply"} +
           more;
  }

  /// Bytes of the outputs, by name.
  std::map<std::string, std::string> outputs(const std::string& stem = "o.") const {
    return Program::outputs(stem);
  }

  /// Outputs that are not whole yet.
  std::vector<std::string> temporary_files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(path("")))
      if (entry.path().filename().string().starts_with("."))
        names.push_back(entry.path().filename());
    return names;
  }

  std::vector<nlohmann::json> log(const std::string& file) const {
    std::vector<nlohmann::json> records;
    std::istringstream lines(read(file));
    for (std::string line; std::getline(lines, line);)
      records.push_back(nlohmann::json::parse(line));
    return records;
  }
};

}  // namespace meniscus::test
