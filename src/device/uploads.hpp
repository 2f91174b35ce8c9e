// What the host has written for a device with memory of its own and the device has not got yet.
#pragma once

#include <vector>

#include "device/memory_pool.hpp"

namespace meniscus {

/// Uploads wait here for the next command that may read them. Those that lie side by side, in the
/// host's memory and in the device's, go by one command: each costs a driver some microseconds.
class Uploads {
 public:
  /// Bytes of a multiple of this lie side by side in the device's memory.
  static constexpr std::size_t kGrain = 1024;

  /// Memory of the device for what the host wrote, which is page-locked (staging.hpp). Throws
  /// cl::Error.
  Memory add(MemoryPool& pool, std::size_t largest, HostMemory memory);

  /// Whether so much waits that it should be on its way: the device's copies go on beside the host.
  bool is_enough() const { return bytes_ >= kEnough; }

  /// Enqueues what waits; returns how many commands that took. Throws cl::Error.
  int send(const cl::CommandQueue& queue);

 private:
  static constexpr std::size_t kEnough = 4 << 20;  // bytes
  struct Waiting {
    HostMemory from;
    Memory block;
    std::size_t origin;  // bytes in the block
  };
  std::vector<Waiting> waiting_;
  std::size_t bytes_ = 0;                  // of these
  Memory block_;                           // that the next ones go to
  std::size_t block_size_ = 0, used_ = 0;  // bytes
};

}  // namespace meniscus
