#include "device/uploads.hpp"

#include <algorithm>
#include <bit>
#include <utility>

namespace meniscus {

Memory Uploads::add(MemoryPool& pool, std::size_t largest, HostMemory memory) {
  // Blocks of a few frames' uploads, each larger than the one before: small frames take little, and
  // oclgrind goes through all of a block after each kernel. What is large has a command and a block
  // to itself.
  constexpr std::size_t kLeast = 1 << 20, kMost = 16 << 20;
  const std::size_t size = memory.size;
  bytes_ += size;
  // Also where a block is nearly full and nothing waits: what goes together should not be parted.
  const std::size_t room = block_size_ - used_;
  if (room < size || (waiting_.empty() && room < block_size_ / 4)) {
    const std::size_t grown =
        std::max(std::clamp(2 * block_size_, kLeast, kMost), std::bit_ceil(size));
    const std::size_t wanted = size >= kEnough ? size : std::min(grown, largest);
    Memory block = pool.take(wanted);
    if (wanted == size) {
      waiting_.push_back({std::move(memory), block, 0});
      return block;
    }
    block_ = std::move(block);
    block_size_ = wanted;
    used_ = 0;
  }
  Memory part = MemoryPool::part_of(block_, used_, size);
  waiting_.push_back({std::move(memory), block_, used_});
  used_ += size;
  return part;
}

int Uploads::send(const cl::CommandQueue& queue) {
  int commands = 0;
  const auto end_of = [](const Waiting& one) {
    return static_cast<const char*>(one.from.bytes.get()) + one.from.size;
  };
  for (std::size_t first = 0, last = 0; first < waiting_.size(); first = last) {
    const Waiting& begin = waiting_[first];
    std::size_t size = 0;
    do {
      size += waiting_[last].from.size;
      ++last;
    } while (last < waiting_.size() && waiting_[last].origin == begin.origin + size &&
             same_memory(waiting_[last].block, begin.block) &&
             end_of(waiting_[last - 1]) == waiting_[last].from.bytes.get());
    const cl::Buffer& to = begin.block;
    queue.enqueueWriteBuffer(to, CL_FALSE, begin.origin, size, begin.from.bytes.get());
    ++commands;
  }
  waiting_.clear();
  bytes_ = 0;
  return commands;
}

}  // namespace meniscus
