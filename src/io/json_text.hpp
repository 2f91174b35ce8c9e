// JSON from files, and why it cannot be read, for people.
#pragma once

#include <array>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>

#include "io/input_file.hpp"
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

/// A value in quotes; text has its own.
template <class Json>
std::string in_quotes_of(const Json& value) {
  return in_quotes(value.is_string() ? value.template get<std::string>() : value.dump());
}

/// Parses a whole file or line. Refuses what nests deeper than all that Meniscus reads, as the
/// library copies and prints a value by recursion, and objects of more keys than any of those, as
/// it finds a key in its order by looking at all before it. Throws InputError with the reason
/// alone, to which the caller adds the place.
template <class Json>
Json parse_json(const std::string& text) {
  constexpr std::size_t kDeepest = 32, kMostKeys = 1000;
  std::array<std::size_t, kDeepest + 2> keys{};  // of the object at each depth
  const auto check = [&](int depth, nlohmann::json::parse_event_t event, const Json&) {
    using Event = nlohmann::json::parse_event_t;
    const auto level = static_cast<std::size_t>(depth);
    if (level > kDeepest)
      throw InputError("it nests deeper than " + std::to_string(kDeepest) + " levels");
    if (event == Event::object_start) keys[level + 1] = 0;
    if (event == Event::key && ++keys[level] > kMostKeys)
      throw InputError("an object in it has more than " + std::to_string(kMostKeys) + " keys");
    return true;
  };
  try {
    return Json::parse(text, check);
  } catch (const nlohmann::json::exception& error) {
    throw InputError(reason_of(error));
  }
}

}  // namespace meniscus
