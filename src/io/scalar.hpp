// Scalars of any type and byte order in a binary file.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <utility>

namespace meniscus {

enum class Scalar { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };

inline std::size_t size_of(Scalar type) {
  constexpr unsigned char kSizes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return kSizes[static_cast<int>(type)];
}

/// The type that a format calls `name`, among the names that it has.
template <std::size_t N>
std::optional<Scalar> scalar_named(const std::pair<const char*, Scalar> (&names)[N],
                                   const std::string& name) {
  for (const auto& [known, type] : names)
    if (name == known) return type;
  return std::nullopt;
}

inline bool is_whole(Scalar type) { return type < Scalar::float32; }

/// One T stored at `from`, little or big endian.
template <class T>
T load(const char* from, std::endian order) {
  unsigned char bytes[sizeof(T)];
  std::memcpy(bytes, from, sizeof(T));
  if (order != std::endian::native)
    for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(bytes[i], bytes[sizeof(T) - 1 - i]);
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

/// Calls visit(value) with the scalar at `from` in its own type.
template <class Visit>
auto visit_scalar(const char* from, Scalar type, std::endian order, Visit visit) {
  switch (type) {
    case Scalar::int8:
      return visit(load<std::int8_t>(from, order));
    case Scalar::uint8:
      return visit(load<std::uint8_t>(from, order));
    case Scalar::int16:
      return visit(load<std::int16_t>(from, order));
    case Scalar::uint16:
      return visit(load<std::uint16_t>(from, order));
    case Scalar::int32:
      return visit(load<std::int32_t>(from, order));
    case Scalar::uint32:
      return visit(load<std::uint32_t>(from, order));
    case Scalar::int64:
      return visit(load<std::int64_t>(from, order));
    case Scalar::uint64:
      return visit(load<std::uint64_t>(from, order));
    case Scalar::float32:
      return visit(load<float>(from, order));
    default:
      return visit(load<double>(from, order));
  }
}

/// The scalar at `from` as float or double; beyond the range of a float it becomes infinite.
template <class Real>
Real load_real(const char* from, Scalar type, std::endian order) {
  return visit_scalar(from, type, order, [](auto value) { return static_cast<Real>(value); });
}

/// The scalar at `from`, or nothing where it is not a whole number of 64 bits.
inline std::optional<std::int64_t> load_integer(const char* from, Scalar type, std::endian order) {
  return visit_scalar(from, type, order, [](auto value) -> std::optional<std::int64_t> {
    if constexpr (std::is_floating_point_v<decltype(value)>) {
      if (!(std::abs(value) < 0x1p63) || value != std::trunc(value)) return std::nullopt;
    } else if (!std::in_range<std::int64_t>(value)) {
      return std::nullopt;
    }
    return static_cast<std::int64_t>(value);
  });
}

}  // namespace meniscus
