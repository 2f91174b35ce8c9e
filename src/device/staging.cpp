#include "device/staging.hpp"

#include <algorithm>
#include <cstdlib>
#include <new>
#include <utility>

#include "base/rounded_up.hpp"

namespace meniscus {

struct StagingChunk {
  cl::CommandQueue queue;  // that it was mapped by
  cl::Buffer buffer;
  char* bytes = nullptr;
  std::size_t size = 0, used = 0;  // bytes
  int parts = 0;                   // in somebody's hands
};

void FreeBytes::operator()(void* bytes) const {
  if (chunk)
    --chunk->parts;
  else
    std::free(bytes);
}

Staging::Staging(cl::Context context) : context_(std::move(context)) {}

Staging::~Staging() {
  for (const auto& chunk : chunks_) {
    // Errors have been reported by now.
    clEnqueueUnmapMemObject(chunk->queue(), chunk->buffer(), chunk->bytes, 0, nullptr, nullptr);
    clFinish(chunk->queue());
  }
}

bool Staging::add_chunk(const cl::CommandQueue& queue, std::size_t bytes) {
  // As much again each time: small frames lock little, large ones few chunks.
  constexpr std::size_t kLeast = 1 << 20, kMost = 512 << 20;
  const std::size_t left = kMost - locked_, wanted = rounded_up(bytes, kLeast);
  const std::size_t size = std::max(std::min(std::max(kLeast, locked_), left), wanted);
  if (refused_ || size > left) return false;
  try {
    auto chunk = std::make_unique<StagingChunk>();
    chunk->queue = queue;
    chunk->buffer = cl::Buffer(context_, CL_MEM_READ_WRITE | CL_MEM_ALLOC_HOST_PTR, size);
    chunk->bytes = static_cast<char*>(
        queue.enqueueMapBuffer(chunk->buffer, CL_TRUE, CL_MAP_READ | CL_MAP_WRITE, 0, size));
    chunk->size = size;
    chunks_.push_back(std::move(chunk));
  } catch (const cl::Error&) {
    refused_ = true;
    return false;
  }
  locked_ += size;
  return true;
}

HostMemory Staging::take(const cl::CommandQueue& queue, std::size_t bytes) {
  constexpr std::size_t kAlignment = 128;  // of the widest vectors
  const std::size_t size = rounded_up(bytes, kAlignment);
  const auto has_room = [&](const auto& chunk) { return chunk->size - chunk->used >= size; };
  // The last chunk first, which is the largest: what is taken one after the other lies side by
  // side, so that one command uploads it (uploads.hpp).
  auto found = std::find_if(chunks_.rbegin(), chunks_.rend(), has_room);
  if (found == chunks_.rend()) {
    const auto has_room_then = [&](const auto& chunk) {
      return chunk->parts == 0 && chunk->size >= size;
    };
    if (!add_chunk(queue, size) && std::any_of(chunks_.begin(), chunks_.end(), has_room_then)) {
      queue.finish();
      waited();
    }
    found = std::find_if(chunks_.rbegin(), chunks_.rend(), has_room);
  }
  HostMemory memory;
  memory.size = size;
  if (found != chunks_.rend()) {
    StagingChunk& chunk = **found;
    memory.bytes = {chunk.bytes + chunk.used, FreeBytes{&chunk}};
    chunk.used += size;
    ++chunk.parts;
  } else {
    memory.bytes.reset(std::aligned_alloc(kAlignment, std::max(size, kAlignment)));
    if (!memory.bytes) throw std::bad_alloc();
  }
  return memory;
}

void Staging::waited() {
  for (const auto& chunk : chunks_)
    if (chunk->parts == 0) chunk->used = 0;
}

}  // namespace meniscus
