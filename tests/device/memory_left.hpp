// Device memory that is left once the driver has freed what nobody uses.
#pragma once

#include <chrono>
#include <cstdint>
#include <thread>

#include "device/device.hpp"

namespace meniscus {

/// Bytes in use, at most `most` where that is so within ten seconds. A queue that has finished is
/// not enough: PoCL's threads let go of a command's buffers after they have said that it is done.
inline std::uint64_t memory_left(const DeviceMemory& memory, std::uint64_t most = 0) {
  using Clock = std::chrono::steady_clock;
  const auto until = Clock::now() + std::chrono::seconds(10);
  while (memory.now() > most && Clock::now() < until)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return memory.now();
}

}  // namespace meniscus
