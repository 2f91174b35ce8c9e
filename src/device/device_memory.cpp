// What a device's state does with memory: buffers taken, filled, written and read.
#include <algorithm>

#include "base/rounded_up.hpp"
#include "device/device.hpp"
#include "device/kernels.hpp"

namespace meniscus {
namespace {

// Vector loads may reach past the last value by up to one vector of sixteen.
constexpr std::size_t kPadding = 64 * 16;

// From this many bytes on all processors of a CPU fill: PoCL's command is left to one.
constexpr std::size_t kManyToFill = std::size_t{1} << 18;

}  // namespace

void DeviceMemory::add(std::uint64_t bytes) {
  const std::uint64_t now = now_ += bytes;
  std::uint64_t peak = peak_;
  while (now > peak && !peak_.compare_exchange_weak(peak, now)) {
  }
}

std::size_t Device::State::most_bytes() const {
  return info.largest_buffer < 2 * kPadding ? 0 : (info.largest_buffer - kPadding) / 64 * 64;
}

std::size_t Device::State::padded(std::size_t bytes) const {
  if (bytes > most_bytes())
    throw OutOfDeviceMemory("a buffer of " + std::to_string(bytes) + " bytes is needed but \"" +
                            info.name + "\" allows " + std::to_string(most_bytes()) +
                            " (use a smaller image or another " + setting("device") + ")");
  return rounded_up(bytes, 64) + kPadding;
}

std::size_t Device::State::part_bytes(std::size_t bytes) {
  // A multiple of what any device asks for where a part begins.
  return rounded_up(bytes, kPadding) + kPadding;
}

HostMemory Device::State::host_bytes(std::size_t bytes) {
  const std::size_t size = padded(bytes);
  try {
    if (is_in_place()) return pool->take_host(size);
    return staging->take(queue, (size + Uploads::kGrain - 1) / Uploads::kGrain * Uploads::kGrain);
  } catch (const cl::Error& error) {
    fail("waiting for uploads", error);
  }
}

Memory Device::State::done_bytes(HostMemory memory) {
  const std::size_t size = memory.size;
  try {
    if (!is_in_place() && memory.bytes.get_deleter().chunk) {
      Memory buffer = uploads_.add(*pool, info.largest_buffer, std::move(memory));
      if (uploads_.is_enough()) counts.uploads += uploads_.send(queue);
      return buffer;
    }
    ++counts.uploads;
    if (is_in_place()) return pool->share(std::move(memory));
    Memory buffer = pool->take(size);
    queue.enqueueWriteBuffer(buffer, CL_TRUE, 0, size, memory.bytes.get());
    return buffer;
  } catch (const cl::Error& error) {
    fail("uploading " + std::to_string(size) + " bytes", error);
  }
}

void Device::State::send_uploads() {
  try {
    counts.uploads += uploads_.send(queue);
  } catch (const cl::Error& error) {
    fail("uploading", error);
  }
}

Memory Device::State::allocate_bytes(std::size_t bytes, bool zeroed) {
  const std::size_t size = padded(bytes);
  try {
    Memory buffer = pool->take(size);
    if (observer || zeroed) enqueue_fill(buffer, cl_uint{0}, 0, size);
    return buffer;
  } catch (const cl::Error& error) {
    fail("allocating " + std::to_string(bytes) + " bytes", error);
  }
}

Memory Device::State::filled_bytes(const void* pattern, std::size_t pattern_bytes,
                                   std::size_t bytes) {
  const auto* values = static_cast<const unsigned char*>(pattern);
  const bool is_zero =
      std::all_of(values, values + pattern_bytes, [](unsigned char v) { return v == 0; });
  // Then what lies beyond is filled with it.
  if (is_zero && (!is_in_place() || bytes < kManyToFill)) return allocate_bytes(bytes, true);
  Memory buffer = allocate_bytes(bytes);
  if (bytes > 0) fill_new(buffer, pattern, pattern_bytes, bytes);
  return buffer;
}

Memory Device::State::constant_bytes(cl_uint pattern, std::size_t bytes) {
  // An observer may write to a launch's buffers, so that none is shared.
  if (observer) return filled_bytes(&pattern, sizeof pattern, bytes);
  Constant& kept = constants_[pattern];
  if (kept.bytes < bytes) kept = {filled_bytes(&pattern, sizeof pattern, bytes), bytes};
  return kept.memory;
}

void Device::State::write_bytes(Memory::Place to, const void* from, std::size_t bytes) {
  send_uploads();
  try {
    queue.enqueueWriteBuffer(to.buffer, CL_TRUE, to.origin, bytes, from);
    ++counts.uploads;
  } catch (const cl::Error& error) {
    fail("uploading " + std::to_string(bytes) + " bytes", error);
  }
}

void Device::State::read_bytes(Memory::Place from, void* to, std::size_t bytes) {
  send_uploads();
  try {
    queue.enqueueReadBuffer(from.buffer, CL_TRUE, from.origin, bytes, to);
    ++counts.reads;
    if (staging) staging->waited();
  } catch (const cl::Error& error) {
    fail("downloading " + std::to_string(bytes) + " bytes", error);
  }
}

HostMemory Device::State::copy_bytes(const Memory& from, std::size_t bytes) {
  HostMemory copy = host_bytes(bytes);
  read_bytes(from, copy.bytes.get(), bytes);
  return copy;
}

void* Device::State::map_bytes(const Memory& memory, std::size_t bytes) {
  send_uploads();
  try {
    ++counts.reads;
    return queue.enqueueMapBuffer(memory, CL_TRUE, CL_MAP_READ, 0, bytes);
  } catch (const cl::Error& error) {
    fail("mapping " + std::to_string(bytes) + " bytes", error);
  }
}

void Device::State::unmap(const Memory& memory, void* mapped) noexcept {
  try {
    queue.enqueueUnmapMemObject(static_cast<const cl::Buffer&>(memory), mapped);
  } catch (const cl::Error& error) {
    unmap_error_ = error;
  }
}

void Device::State::fill_bytes(const Memory& memory, const void* pattern, std::size_t pattern_bytes,
                               std::size_t bytes) {
  send_uploads();
  fill_new(memory, pattern, pattern_bytes, bytes);
}

void Device::State::fill_new(const Memory& memory, const void* pattern, std::size_t pattern_bytes,
                             std::size_t bytes) {
  if (pattern_bytes != 1 && pattern_bytes != 4)
    throw DeviceError("fill patterns are one or four bytes");
  try {
    if (!is_in_place()) {
      if (pattern_bytes == 4)
        enqueue_fill(memory, *static_cast<const cl_uint*>(pattern), 0, bytes);
      else
        enqueue_fill(memory, *static_cast<const cl_uchar*>(pattern), 0, bytes);
      return;
    }
    // Sixteen words at a time: PoCL stores a pattern at a time.
    cl_uint16 words;
    for (std::size_t k = 0; k < sizeof words; k += pattern_bytes)
      std::copy_n(static_cast<const char*>(pattern), pattern_bytes,
                  reinterpret_cast<char*>(&words) + k);
    const std::size_t number = bytes / sizeof words, whole = number * sizeof words;
    if (bytes >= kManyToFill) {
      BuiltKernel& fill_words =
          kernel(meniscus::kernels::fill_words.file, meniscus::kernels::fill_words.name,
                 meniscus::kernels::fill_words.number, 1);
      fill_words.kernel.setArg(0, static_cast<const cl::Buffer&>(memory));
      fill_words.kernel.setArg(1, words.s[0]);
      fill_words.kernel.setArg(2, static_cast<cl_int>(number));
      counts.arguments += 3;
      enqueue(fill_words, {number});
    } else if (whole > 0) {
      enqueue_fill(memory, words, 0, whole);
    }
    if (whole == bytes) return;
    if (pattern_bytes == 4)
      enqueue_fill(memory, words.s[0], whole, bytes - whole);
    else
      enqueue_fill(memory, static_cast<cl_uchar>(words.s[0] & 255), whole, bytes - whole);
  } catch (const cl::Error& error) {
    fail("filling " + std::to_string(bytes) + " bytes", error);
  }
}

}  // namespace meniscus
