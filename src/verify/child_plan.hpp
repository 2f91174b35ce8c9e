// What `meniscus verify` and the processes that it starts tell each other: a plan goes in as an
// argument, lines of JSON come out.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "verify/devices.hpp"

namespace meniscus::verify {

/// What runtimes print comes in between: a line of ours begins with this.
inline constexpr std::string_view kMark = "\x1bverify ";

/// Prints a line of ours to standard output.
void say(const nlohmann::json& line);

/// A kernel that ended a process, in the item that the next process begins with.
struct Ended {
  std::string kernel;
  std::size_t launch = 0;  // of the item's launches
  std::string how;         // in words
};

/// What a process is to do.
struct ChildPlan {
  int device = 0;
  std::size_t from = 0;           // item
  bool waits = false;             // for each launch
  std::set<std::string> without;  // kernels
  std::set<std::string> without_where_not_required;
  std::vector<Ended> ended;
  int output = -1;  // where a program's buffers go
  Request request;
};

std::string to_text(const ChildPlan& plan);
ChildPlan plan_of(const std::string& text);

}  // namespace meniscus::verify
