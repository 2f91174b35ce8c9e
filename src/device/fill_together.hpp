// Buffers that begin with the same value everywhere, filled by one command where the device gives a
// buffer for all of them.
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
  if (bytes > state.most_bytes()) {
    std::array<Buffer<float>, N> apart;
    for (std::size_t k = 0; k < N; ++k) apart[k] = filled<float>(device, sizes[k], value);
    return apart;
  }
  const Memory whole = state.filled_bytes(&value, sizeof value, bytes);
  return [&]<std::size_t... K>(std::index_sequence<K...>) {
    return std::array<Buffer<float>, N>{
        Buffer<float>{state.part_of(whole, origin[K], sizes[K] * sizeof(float)), sizes[K]}...};
  }
  (std::make_index_sequence<N>());
}

}  // namespace meniscus
