// Draws particles by where they are, whatever their order.
#pragma once

#include <bit>
#include <cstdint>

namespace meniscus {

/// A hash of a position's bits; which of equal hashes a particle has does not depend on its place.
inline std::uint32_t position_hash(float x, float y, float z) {
  std::uint32_t h = std::bit_cast<std::uint32_t>(x) * 0x9e3779b1u ^
                    std::bit_cast<std::uint32_t>(y) * 0x85ebca77u ^
                    std::bit_cast<std::uint32_t>(z) * 0xc2b2ae3du;
  h = (h ^ (h >> 15)) * 0x2c1b3c6du;
  h = (h ^ (h >> 12)) * 0x297a2d39u;
  return h ^ (h >> 15);
}

}  // namespace meniscus
