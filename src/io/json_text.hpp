// JSON from files, and why it cannot be read, for people.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "meniscus/error.hpp"

namespace meniscus {

/// What `error` says without the library's own words: "parse error at line 2, column 1: ..." or
/// "key 'device' not found".
inline std::string reason_of(const nlohmann::json::exception& error) {
  if (dynamic_cast<const nlohmann::json::type_error*>(&error))
    return "a value is of another type than the one wanted";
  const std::string text = error.what();  // begins with "[json.exception. ...] "
  const std::size_t prefix = text.find("] ");
  return text.substr(prefix == std::string::npos ? 0 : prefix + 2);
}

/// Parses a whole file or line. What nests deeper than all that Meniscus reads is refused: the
/// library copies and prints a value by recursion. Throws InputError with the reason alone, to
/// which the caller adds the place.
template <class Json>
Json parse_json(const std::string& text) {
  constexpr int kDeepest = 32;
  const auto check_depth = [](int depth, nlohmann::json::parse_event_t, const Json&) {
    if (depth > kDeepest)
      throw InputError("it nests deeper than " + std::to_string(kDeepest) + " levels");
    return true;
  };
  try {
    return Json::parse(text, check_depth);
  } catch (const nlohmann::json::exception& error) {
    throw InputError(reason_of(error));
  }
}

}  // namespace meniscus
