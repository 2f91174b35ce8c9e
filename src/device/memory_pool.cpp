#include "device/memory_pool.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "device/device.hpp"

namespace meniscus {
namespace {

// Sizes that blocks have: sixteen between one power of two and the next, so that at most a
// sixteenth is wasted; and the largest one, for what comes near it.
std::size_t block_size(std::size_t bytes, std::size_t largest) {
  const std::size_t step = std::max<std::size_t>(256, std::bit_floor(bytes) / 16);
  return std::max(bytes, std::min((bytes + step - 1) / step * step, largest));
}

// Counts a buffer until the driver frees it, which may be after the Device is gone.
struct CountedBytes {
  std::shared_ptr<DeviceMemory> memory;
  std::uint64_t bytes;
};

void CL_CALLBACK count_freed(cl_mem, void* counted) {
  const std::unique_ptr<CountedBytes> freed(static_cast<CountedBytes*>(counted));
  freed->memory->remove(freed->bytes);
}

void count_while_it_lives(const std::shared_ptr<DeviceMemory>& memory, cl::Buffer& buffer,
                          std::uint64_t bytes) {
  auto counted = std::make_unique<CountedBytes>(CountedBytes{memory, bytes});
  buffer.setDestructorCallback(count_freed, counted.get());
  memory->add(counted.release()->bytes);
}

}  // namespace

struct Memory::Block {
  Block(cl::Buffer&& memory, std::size_t bytes, std::shared_ptr<MemoryPool::Shelf> from)
      : buffer(std::move(memory)), size(bytes), shelf(std::move(from)) {}
  ~Block() {
    const std::lock_guard lock(shelf->mutex);
    shelf->used -= size;
    if (!shelf->reuse) return;
    try {
      shelf->blocks[size].emplace(shelf->given_back++, std::move(buffer));
      shelf->idle += size;
      shelf->shrink(shelf->most());
    } catch (const std::bad_alloc&) {
      // Then the driver has it back.
    }
  }
  Block(const Block&) = delete;
  Block& operator=(const Block&) = delete;

  cl::Buffer buffer;
  std::size_t size;  // bytes
  std::shared_ptr<MemoryPool::Shelf> shelf;
};

Memory::operator const cl::Buffer&() const {
  static const cl::Buffer kNone;
  return block_ ? block_->buffer : kNone;
}

std::uint64_t MemoryPool::Shelf::most() const {
  constexpr std::uint64_t kAlways = 64 << 20;
  return std::max(kAlways, most_used);
}

void MemoryPool::Shelf::shrink(std::uint64_t most) {
  while (idle > 0 && used + idle > most) {
    auto oldest = blocks.begin();
    for (auto size = blocks.begin(); size != blocks.end(); ++size)
      if (size->second.begin()->first < oldest->second.begin()->first) oldest = size;
    idle -= oldest->first;
    oldest->second.erase(oldest->second.begin());
    if (oldest->second.empty()) blocks.erase(oldest);
  }
}

MemoryPool::MemoryPool(cl::Context context, std::shared_ptr<DeviceMemory> count,
                       std::size_t largest)
    : context_(std::move(context)), count_(std::move(count)), largest_(largest) {}

Memory MemoryPool::take(std::size_t bytes) {
  const std::size_t size = block_size(bytes, largest_);
  const std::lock_guard lock(shelf_->mutex);
  cl::Buffer buffer;
  if (const auto found = shelf_->blocks.find(size); found != shelf_->blocks.end()) {
    // The latest one given back: its pages are most likely in a cache.
    const auto latest = std::prev(found->second.end());
    buffer = std::move(latest->second);
    found->second.erase(latest);
    if (found->second.empty()) shelf_->blocks.erase(found);
    shelf_->idle -= size;
  } else {
    shelf_->shrink(std::max(shelf_->most(), shelf_->used + size) - size);
    try {
      buffer = cl::Buffer(context_, CL_MEM_READ_WRITE, size);
    } catch (const cl::Error&) {
      if (shelf_->idle == 0) throw;
      shelf_->shrink(0);
      buffer = cl::Buffer(context_, CL_MEM_READ_WRITE, size);
    }
    count_while_it_lives(count_, buffer, size);
  }
  shelf_->used += size;
  shelf_->most_used = std::max(shelf_->most_used, shelf_->used);
  Memory memory;
  memory.block_ = std::make_shared<Memory::Block>(std::move(buffer), size, shelf_);
  return memory;
}

void MemoryPool::reuse(bool on) {
  const std::lock_guard lock(shelf_->mutex);
  shelf_->reuse = on;
  if (!on) shelf_->shrink(0);
}

void MemoryPool::drop_idle() {
  const std::lock_guard lock(shelf_->mutex);
  shelf_->shrink(0);
}

}  // namespace meniscus
