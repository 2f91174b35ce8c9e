// Lists in sentences.
#pragma once

#include <string>
#include <vector>

#include "base/comma_separated.hpp"

namespace meniscus {

/// "a, b and c", with `word` before the last.
inline std::string enumerated(std::vector<std::string> names, const std::string& word) {
  if (names.size() < 2) return comma_separated(names);
  const std::string last = names.back();
  names.pop_back();
  return comma_separated(names) + " " + word + " " + last;
}

}  // namespace meniscus
