// Why JSON cannot be read, for people.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

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

}  // namespace meniscus
