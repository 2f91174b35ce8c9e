// Numbers as people read them.
#pragma once

#include <concepts>
#include <string>

namespace meniscus {

/// 35937 -> "35,937".
std::string grouped(std::integral auto number) {
  std::string text = std::to_string(number);
  for (int at = static_cast<int>(text.size()) - 3; at > (text[0] == '-' ? 1 : 0); at -= 3)
    text.insert(static_cast<std::size_t>(at), 1, ',');
  return text;
}

/// 1 -> "1 frame", 35937 -> "35,937 frames".
std::string counted(std::integral auto number, const std::string& one,
                    const std::string& ending = "s") {
  return grouped(number) + " " + one + (number == 1 ? "" : ending);
}

}  // namespace meniscus
