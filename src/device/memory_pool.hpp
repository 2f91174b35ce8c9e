// Device memory that is used again from frame to frame.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>

#include "device/opencl.hpp"

namespace meniscus {

class DeviceMemory;
class MemoryPool;

/// A piece of page-locked memory that parts are taken from, one behind the other (staging.hpp).
struct StagingChunk;

struct FreeBytes {
  StagingChunk* chunk = nullptr;  // that it is a part of; null: memory of its own
  void operator()(void* bytes) const;
};
/// Memory of the host that a device is to use.
struct HostMemory {
  std::unique_ptr<void, FreeBytes> bytes;
  std::size_t size = 0;  // bytes
};

/// A handle to device memory; the last handle gives it back to the pool.
class Memory {
 public:
  Memory() = default;
  /// The buffer; of a part one that is made when it is asked for first, by the thread that gives
  /// the device its work. Throws cl::Error.
  operator const cl::Buffer&() const;

  /// Where it lies, for commands that the host gives: they need no buffer for a part.
  struct Place {
    const cl::Buffer& buffer;
    std::size_t origin;  // bytes
  };
  Place place() const;

 private:
  friend class MemoryPool;
  friend bool same_memory(const Memory& a, const Memory& b);
  struct Block;
  std::shared_ptr<const Block> block_;
};

/// Whether both are handles to the same memory.
inline bool same_memory(const Memory& a, const Memory& b) { return a.block_ == b.block_; }

/// The memory of one device and its queue. Fresh memory costs a page fault for every 4 KB, in every
/// frame; what is given back is used again for buffers of about the same size.
/// All commands on it must go to one in-order queue, or to another after the first is finished:
/// what was given back may still be in use by queued commands, which then come before those of its
/// next user. The pool holds no more than the most that was in use at a time, or 64 MB; on a device
/// with memory of its own twice that, or 256 MB: drivers take as long for a buffer as for a small
/// kernel. Handles may outlive the pool and the device, and may be dropped by any thread.
class MemoryPool {
 public:
  /// `largest`: bytes that one buffer may have. `in_place`: the device uses the host's memory.
  /// `wait`: until no command is left in the queue.
  MemoryPool(cl::Context context, std::shared_ptr<DeviceMemory> count, std::size_t largest,
             bool in_place, std::function<void()> wait);

  /// At least `bytes`, with any content. Throws cl::Error.
  Memory take(std::size_t bytes);

  /// At least `bytes` of the host, with any content, for share(). It is used again once the driver
  /// has let go of it, so that this waits for no command. Throws std::bad_alloc.
  HostMemory take_host(std::size_t bytes);

  /// The same as memory of the device, which uses it in place; from now on it is the device's.
  /// Throws cl::Error.
  Memory share(HostMemory memory);

  /// A part of some memory, which may be a part itself; it keeps the whole. `origin` is a multiple
  /// of what the device asks for. Kernels may be given parts that do not overlap: NVIDIA's driver
  /// crashes when sub-buffers are released that others overlapped, even long before.
  static Memory part_of(const Memory& whole, std::size_t origin, std::size_t bytes);

  /// Whether memory is used again (default). When not, what is given back goes to the driver.
  void reuse(bool on);

  /// Gives what nobody uses back to the driver, and waits until it has it: for all work.
  void drop_idle();

 private:
  friend struct Memory::Block;
  friend struct SharedBytes;

  // What handles share, so that the last can give its block back.
  struct Shelf {
    std::mutex mutex;
    bool reuse = true, in_place = true;
    std::uint64_t used = 0, most_used = 0, idle = 0;  // bytes
    std::uint64_t given_back = 0;                     // blocks so far: the age of idle ones
    std::map<std::size_t, std::map<std::uint64_t, cl::Buffer>> blocks;  // idle: by size, by age

    void shrink(std::uint64_t most);  // drops the oldest until used + idle <= most
    std::uint64_t most() const;

    std::uint64_t shared = 0, most_shared = 0, idle_shared = 0;  // bytes of the host
    std::multimap<std::size_t, HostMemory> host;                 // idle: by size
  };

  template <class Make>
  cl::Buffer make(std::size_t size, const Make& make_buffer);
  Memory hand_out(cl::Buffer&& buffer, std::size_t size, bool again);

  cl::Context context_;
  std::shared_ptr<DeviceMemory> count_;
  std::size_t largest_;
  std::function<void()> wait_;
  std::shared_ptr<Shelf> shelf_ = std::make_shared<Shelf>();
};

}  // namespace meniscus
