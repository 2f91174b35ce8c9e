// Lists in messages.
#pragma once

#include <functional>
#include <string>

namespace meniscus {

/// "a, b, c": the text of each thing; another separator where one is given.
template <class Things, class Text = std::identity>
std::string comma_separated(const Things& things, const Text& text_of = {},
                            const char* separator = ", ") {
  std::string list;
  for (const auto& thing : things) {
    if (!list.empty()) list += separator;
    list += std::invoke(text_of, thing);
  }
  return list;
}

}  // namespace meniscus
