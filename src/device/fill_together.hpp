// Buffers that begin with the same value everywhere, filled by one command.
#pragma once

#include <array>
#include <utility>

#include "device/together.hpp"

namespace meniscus {

/// Buffers of so many values each, in one piece of memory, all filled with `value`.
template <std::size_t N>
std::array<Buffer<float>, N> filled_together(Device& device, float value,
                                             const std::array<std::size_t, N>& sizes) {
  std::array<std::size_t, N> origin{};
  std::size_t bytes = 0;
  for (std::size_t k = 0; k < N; ++k) {
    origin[k] = bytes;
    bytes += Device::State::part_bytes(sizes[k] * sizeof(float));
  }
  Device::State& state = device.state();
  const Memory whole = state.filled_bytes(&value, sizeof value, bytes);
  return [&]<std::size_t... K>(std::index_sequence<K...>) {
    return std::array<Buffer<float>, N>{
        Buffer<float>{state.part_of(whole, origin[K], sizes[K] * sizeof(float)), sizes[K]}...};
  }
  (std::make_index_sequence<N>());
}

}  // namespace meniscus
