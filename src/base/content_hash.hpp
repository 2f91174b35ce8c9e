// One number for what a frame shows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "meniscus/types.hpp"

namespace meniscus {

/// XXH3 (64 bits) of the surface's maps and mesh: the same on every machine and device for the same
/// bits, whatever file they are written to and however it is compressed.
std::uint64_t content_hash(const Surface& surface);

/// The same hash of a text.
std::uint64_t content_hash(const std::string& text);

/// The same hash of bytes.
std::uint64_t content_hash(const void* bytes, std::size_t size);

/// As 16 hex digits.
std::string hex_digits(std::uint64_t number);

}  // namespace meniscus
