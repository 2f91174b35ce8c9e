// What verify finds out, row by row.
#pragma once

#include <functional>
#include <string>

namespace meniscus::verify {

enum class Result { pass, fail, skip };

/// One thing that was checked on one device.
struct Row {
  std::string group{};    // "probe", "limit", "kernel", "reference", "frame", "flaw" or "program"
  std::string device{};   // its name; filled in by who runs the checks
  std::string kernel{};   // the kernel, the probe's name, or the method
  std::string variant{};  // "width 8", "width 1, groups of 32"; empty: there is but one
  std::string size{};     // what it ran on
  Result result = Result::pass;
  double ulp = -1;        // largest error in units in the last place; -1: none to tell
  std::string reason{};   // why it failed or was skipped, or what was measured
  double ms = 0;          // wall time
  bool required = true;   // whether a failure makes the device fail
  std::string section{};  // of the OpenCL specification that the check rests on; may be empty
};

/// Receives every row, as soon as it is known.
using Report = std::function<void(Row)>;

}  // namespace meniscus::verify
