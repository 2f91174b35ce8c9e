// Numbers as people read them.
#pragma once

#include <cstdint>
#include <string>

namespace meniscus {

/// 35937 -> "35,937".
inline std::string grouped(std::int64_t number) {
  std::string text = std::to_string(number);
  for (int at = static_cast<int>(text.size()) - 3; at > (number < 0 ? 1 : 0); at -= 3)
    text.insert(static_cast<std::size_t>(at), 1, ',');
  return text;
}

}  // namespace meniscus
