// Whole numbers in JSON.
#pragma once

#include <concepts>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

namespace meniscus {

/// The number that `value` is, or nothing where it is no whole number that an Integer holds: the
/// library's own conversions cut it off without a word.
template <std::integral Integer, class Json>
std::optional<Integer> whole_number(const Json& value) {
  const bool fits =
      value.is_number_unsigned()
          ? std::in_range<Integer>(value.template get<std::uint64_t>())
          : value.is_number_integer() && std::in_range<Integer>(value.template get<std::int64_t>());
  return fits ? std::optional(value.template get<Integer>()) : std::nullopt;
}

}  // namespace meniscus
