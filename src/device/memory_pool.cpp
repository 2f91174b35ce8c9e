#include "device/memory_pool.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstdlib>
#include <new>
#include <thread>
#include <utility>

#include "base/rounded_up.hpp"
#include "device/device.hpp"
#include "device/opencl_error.hpp"

namespace meniscus {

// Memory of the host under a buffer; goes back to the shelf with it.
struct SharedBytes {
  SharedBytes(HostMemory memory, std::shared_ptr<MemoryPool::Shelf> from)
      : host(std::move(memory)), shelf(std::move(from)) {
    const std::lock_guard lock(shelf->mutex);
    shelf->shared += host.size;
    shelf->most_shared = std::max(shelf->most_shared, shelf->shared);
  }
  ~SharedBytes() {
    const std::lock_guard lock(shelf->mutex);
    const std::size_t size = host.size;
    shelf->shared -= size;
    if (!shelf->reuse || shelf->shared + shelf->idle_shared + size > shelf->most_shared) return;
    try {
      shelf->host.emplace(size, std::move(host));
      shelf->idle_shared += size;
    } catch (const std::bad_alloc&) {
      // Then the host has it back.
    }
  }
  SharedBytes(const SharedBytes&) = delete;
  SharedBytes& operator=(const SharedBytes&) = delete;

  HostMemory host;
  std::shared_ptr<MemoryPool::Shelf> shelf;
};

namespace {

// Sizes that blocks have: sixteen between one power of two and the next, so that at most a
// sixteenth is wasted; and the largest one, for what comes near it.
std::size_t block_size(std::size_t bytes, std::size_t largest) {
  const std::size_t step = std::max<std::size_t>(256, std::bit_floor(bytes) / 16);
  return std::max(bytes, std::min(rounded_up(bytes, step), largest));
}

// Counts a buffer until the driver frees it, which may be after the Device is gone, and keeps what
// is under it so long.
struct CountedBytes {
  std::shared_ptr<DeviceMemory> memory;
  std::uint64_t bytes;
  std::unique_ptr<SharedBytes> host;
};

void CL_CALLBACK count_freed(cl_mem, void* counted) {
  const std::unique_ptr<CountedBytes> freed(static_cast<CountedBytes*>(counted));
  freed->host.reset();  // who sees that it is not in use any more finds it on the shelf
  freed->memory->remove(freed->bytes);
}

void count_while_it_lives(const std::shared_ptr<DeviceMemory>& memory, cl::Buffer& buffer,
                          std::uint64_t bytes, std::unique_ptr<SharedBytes> host = nullptr) {
  std::unique_ptr<CountedBytes> counted(new CountedBytes{memory, bytes, std::move(host)});
  buffer.setDestructorCallback(count_freed, counted.get());
  memory->add(counted.release()->bytes);
}

}  // namespace

struct Memory::Block {
  Block(cl::Buffer&& memory, std::size_t bytes, bool use_again,
        std::shared_ptr<MemoryPool::Shelf> from)
      : buffer(std::move(memory)), size(bytes), again(use_again), shelf(std::move(from)) {}
  // A part of another one.
  Block(std::shared_ptr<const Block> of, std::size_t from, std::size_t bytes)
      : whole(std::move(of)), origin(from), size(bytes), again(false) {}
  ~Block() {
    if (whole) return;
    const std::lock_guard lock(shelf->mutex);
    shelf->used -= size;
    if (!shelf->reuse || !again) return;
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

  std::shared_ptr<const Block> whole;  // that this one is a part of, from `origin` on
  std::size_t origin = 0;              // bytes
  mutable cl::Buffer buffer;           // of a part: none before somebody asks for it
  std::size_t size;                    // bytes
  bool again;                          // goes back to the shelf
  std::shared_ptr<MemoryPool::Shelf> shelf;
};

Memory::operator const cl::Buffer&() const {
  static const cl::Buffer kNone;
  if (!block_) return kNone;
  if (block_->whole && !block_->buffer()) {
    const cl_buffer_region region{block_->origin, block_->size};
    cl_int error = CL_SUCCESS;
    block_->buffer = cl::Buffer(clCreateSubBuffer(block_->whole->buffer(), CL_MEM_READ_WRITE,
                                                  CL_BUFFER_CREATE_TYPE_REGION, &region, &error));
    if (error != CL_SUCCESS) throw cl::Error(error, "clCreateSubBuffer");
  }
  return block_->buffer;
}

Memory::Place Memory::place() const {
  if (block_ && block_->whole) return {block_->whole->buffer, block_->origin};
  return {*this, 0};
}

std::uint64_t MemoryPool::Shelf::most() const {
  constexpr std::uint64_t kAlways = 64 << 20, kAlwaysElsewhere = 256 << 20;
  return in_place ? std::max(kAlways, most_used) : std::max(kAlwaysElsewhere, 2 * most_used);
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
                       std::size_t largest, bool in_place, std::function<void()> wait)
    : context_(std::move(context)),
      count_(std::move(count)),
      largest_(largest),
      wait_(std::move(wait)) {
  shelf_->in_place = in_place;
}

// What make_buffer() makes; where there is no memory for it, once more without what lies idle.
template <class Make>
cl::Buffer MemoryPool::make(std::size_t size, const Make& make_buffer) {
  {
    const std::lock_guard lock(shelf_->mutex);
    shelf_->shrink(std::max(shelf_->most(), shelf_->used + size) - size);
  }
  try {
    return make_buffer();
  } catch (const cl::Error& error) {
    if (!is_out_of_memory(error.err())) throw;
    drop_idle();
    return make_buffer();
  }
}

Memory MemoryPool::hand_out(cl::Buffer&& buffer, std::size_t size, bool again) {
  Memory memory;
  memory.block_ = std::make_shared<Memory::Block>(std::move(buffer), size, again, shelf_);
  const std::lock_guard lock(shelf_->mutex);
  shelf_->used += size;
  shelf_->most_used = std::max(shelf_->most_used, shelf_->used);
  return memory;
}

Memory MemoryPool::take(std::size_t bytes) {
  const std::size_t size = block_size(bytes, largest_);
  cl::Buffer buffer;
  {
    const std::lock_guard lock(shelf_->mutex);
    if (const auto found = shelf_->blocks.find(size); found != shelf_->blocks.end()) {
      // The latest one given back: its pages are most likely in a cache.
      const auto latest = std::prev(found->second.end());
      buffer = std::move(latest->second);
      found->second.erase(latest);
      if (found->second.empty()) shelf_->blocks.erase(found);
      shelf_->idle -= size;
    }
  }
  if (!buffer()) {
    buffer = make(size, [&] { return cl::Buffer(context_, CL_MEM_READ_WRITE, size); });
    count_while_it_lives(count_, buffer, size);
  }
  return hand_out(std::move(buffer), size, true);
}

HostMemory MemoryPool::take_host(std::size_t bytes) {
  constexpr std::size_t kAlignment = 128;  // of the widest vectors; divides block sizes
  const std::size_t size = block_size(rounded_up(bytes, kAlignment), largest_);
  {
    const std::lock_guard lock(shelf_->mutex);
    if (const auto found = shelf_->host.find(size); found != shelf_->host.end()) {
      HostMemory memory = std::move(found->second);
      shelf_->host.erase(found);
      shelf_->idle_shared -= size;
      return memory;
    }
  }
  HostMemory memory;
  memory.bytes.reset(std::aligned_alloc(kAlignment, size));
  if (!memory.bytes) throw std::bad_alloc();
  memory.size = size;
  return memory;
}

Memory MemoryPool::share(HostMemory memory) {
  const std::size_t size = memory.size;
  cl::Buffer buffer = make(size, [&] {
    return cl::Buffer(context_, CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, size, memory.bytes.get());
  });
  count_while_it_lives(count_, buffer, size,
                       std::make_unique<SharedBytes>(std::move(memory), shelf_));
  return hand_out(std::move(buffer), size, false);
}

Memory MemoryPool::part_of(const Memory& whole, std::size_t origin, std::size_t bytes) {
  // OpenCL has no parts of parts.
  const bool is_part = whole.block_->whole != nullptr;
  const std::shared_ptr<const Memory::Block>& all = is_part ? whole.block_->whole : whole.block_;
  Memory memory;
  memory.block_ = std::make_shared<Memory::Block>(all, whole.block_->origin + origin, bytes);
  return memory;
}

void MemoryPool::reuse(bool on) {
  const std::lock_guard lock(shelf_->mutex);
  shelf_->reuse = on;
  if (on) return;
  shelf_->shrink(0);
  shelf_->host.clear();
  shelf_->idle_shared = 0;
}

void MemoryPool::drop_idle() {
  wait_();  // with the shelf unlocked: what the driver lets go of comes back to it
  std::uint64_t used = 0;
  {
    const std::lock_guard lock(shelf_->mutex);
    shelf_->shrink(0);
    used = shelf_->used;
  }
  // PoCL's threads let go of a command's memory a moment after they have said that it is done.
  for (int ms = 0; ms < 100 && count_->now() > used; ++ms)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  const std::lock_guard lock(shelf_->mutex);
  shelf_->host.clear();
  shelf_->idle_shared = 0;
  shelf_->most_shared = shelf_->shared;
}

}  // namespace meniscus
