// Whole numbers in JSON.
#pragma once

#include <cmath>
#include <concepts>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

namespace meniscus {

/// The number that `value` is, or nothing where it is no whole number that an Integer holds: the
/// library's own conversions cut it off without a word. 64.0 is 64: some programs write all
/// numbers with a point.
template <std::integral Integer, class Json>
std::optional<Integer> whole_number(const Json& value) {
  if (value.is_number_float()) {
    constexpr double kExact = 0x1p53;
    const auto number = value.template get<double>();
    if (!(std::abs(number) <= kExact) || number != std::trunc(number)) return std::nullopt;
    const auto whole = static_cast<std::int64_t>(number);
    return std::in_range<Integer>(whole) ? std::optional(static_cast<Integer>(whole))
                                         : std::nullopt;
  }
  const bool fits =
      value.is_number_unsigned()
          ? std::in_range<Integer>(value.template get<std::uint64_t>())
          : value.is_number_integer() && std::in_range<Integer>(value.template get<std::int64_t>());
  return fits ? std::optional(value.template get<Integer>()) : std::nullopt;
}

}  // namespace meniscus
