// Memory of the host through which values go to and from a device with memory of its own.
#pragma once

#include <memory>
#include <vector>

#include "device/memory_pool.hpp"

namespace meniscus {

/// Page-locked memory: the device copies from and to it by itself, several times as fast as other
/// memory, and nobody waits for what is on its way to the device. Locking pages takes a driver a
/// millisecond for every two megabytes, so that they are kept and parts of them handed out again
/// when the device has been waited for. For the one thread that gives a device its work.
class Staging {
 public:
  explicit Staging(cl::Context context);
  ~Staging();

  /// `bytes` with any content, aligned for every vector; of their own, from the heap, where more
  /// than 512 MB would be locked or the driver locks none. Throws std::bad_alloc, and cl::Error
  /// where waiting for `queue` fails.
  HostMemory take(const cl::CommandQueue& queue, std::size_t bytes);

  /// All commands so far are done: what was given back is used again.
  void waited();

 private:
  bool add_chunk(const cl::CommandQueue& queue, std::size_t bytes);

  cl::Context context_;
  std::vector<std::unique_ptr<StagingChunk>> chunks_;
  std::size_t locked_ = 0;  // bytes
  bool refused_ = false;    // by the driver
};

}  // namespace meniscus
