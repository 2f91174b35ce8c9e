// Device memory that is used again.
#include "device/memory_pool.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "device/device.hpp"
#include "device/memory_left.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kMany = 1 << 20;

cl_mem handle_of(const Buffer<float>& buffer) {
  return static_cast<const cl::Buffer&>(buffer.memory)();
}

TEST(MemoryPool, GivesWhatWasGivenBackToTheNextOfThatSize) {
  Device device;
  const auto& memory = *device.state().memory;
  Buffer<float> one = allocate<float>(device, kMany);
  const Buffer<float> same = one;
  const cl_mem first = handle_of(one);
  one = {};
  EXPECT_NE(handle_of(allocate<float>(device, kMany)), first) << "a handle is left";
  const std::uint64_t held = memory.now();
  {
    const Buffer<float> gone = same;
    one = allocate<float>(device, 2 * kMany);
    EXPECT_GT(memory.now(), held) << "another size";
  }
  const std::uint64_t after = memory.now();
  for (int frame = 0; frame < 10; ++frame) {
    const Buffer<float> a = allocate<float>(device, kMany), b = allocate<float>(device, kMany - 7);
    EXPECT_NE(handle_of(a), handle_of(b));
    EXPECT_NE(handle_of(a), first);
    EXPECT_NE(handle_of(b), first);
    if (frame > 0) {
      EXPECT_EQ(memory.now(), after + 4 * kMany + 4 * kMany / 16) << "no more from frame to frame";
    }
  }
}

// The next user's commands come after those that are queued.
TEST(MemoryPool, WhatIsQueuedIsDoneBeforeMemoryIsUsedAgain) {
  Device device;
  std::vector<float> values(kMany);
  std::iota(values.begin(), values.end(), 0.0f);
  for (int frame = 0; frame < 20; ++frame) {
    Buffer<float> first = filled(device, kMany, 1.0f);
    const cl_mem memory = handle_of(first);
    const Buffer<float> copy = allocate<float>(device, kMany);
    device.state().queue.enqueueCopyBuffer(first.memory, copy.memory, 0, 0, 4 * kMany);
    first = {};
    const Buffer<float> second = allocate<float>(device, kMany);
    device.state().write_bytes(second.memory, values.data(), 4 * kMany);
    EXPECT_EQ(handle_of(second), memory);
    EXPECT_EQ(download(device, copy), std::vector<float>(kMany, 1.0f));
    EXPECT_EQ(download(device, second), values);
  }
}

TEST(MemoryPool, HoldsNoMoreThanWasUsedAtATime) {
  Device device;
  const auto& memory = *device.state().memory;
  constexpr std::size_t kHalf = 10 * kMany;  // 40 MB
  for (std::size_t frame = 0; frame < 8; ++frame) {
    const auto a = allocate<char>(device, 4 * kHalf + frame * 8 * kMany);
    const auto b = allocate<char>(device, 4 * kHalf);
    device.state().queue.finish();
    std::uint64_t most = (8 * kHalf + frame * 8 * kMany) * 17 / 16 + 4096;
    if (!device.state().is_in_place()) most = std::max<std::uint64_t>(2 * most, 256 << 20);
    EXPECT_LE(memory_left(memory, most), most) << frame;
  }
  device.state().pool->reuse(false);
  device.state().queue.finish();
  EXPECT_EQ(memory_left(memory), 0u);
}

// Commands keep the memory they use: a frame that fits into memory once has to fit every time.
TEST(MemoryPool, WhatIsDroppedIsFreeAtOnce) {
  Device device;
  const auto& memory = *device.state().memory;
  for (int frame = 0; frame < 20; ++frame) {
    const Buffer<float> left = allocate<float>(device, 1000);
    {
      const Buffer<float> from = filled(device, 4 * kMany, 1.0f);
      const Buffer<float> shared = upload(device, std::vector<float>(kMany, 2.0f));
      const Buffer<float> to = allocate<float>(device, 4 * kMany);
      for (int copy = 0; copy < 10; ++copy) {
        device.state().queue.enqueueCopyBuffer(from.memory, to.memory, 0, 0, 16 * kMany);
        device.state().queue.enqueueCopyBuffer(shared.memory, to.memory, 0, 0, 4 * kMany);
      }
    }
    device.state().pool->drop_idle();
    EXPECT_LT(memory.now(), kMany) << frame;
  }
}

// What is queued may still read it when its last handle goes; then the driver lets go of it.
TEST(MemoryPool, SharedMemoryLivesAsLongAsItIsUsed) {
  Device device;
  const auto& memory = *device.state().memory;
  device.state().pool->reuse(false);
  const Buffer<float> copy = allocate<float>(device, kMany);
  device.state().queue.finish();
  const std::uint64_t before = memory.now();
  for (int frame = 0; frame < 20; ++frame) {
    HostMemory host = device.state().host_bytes(4 * kMany);
    std::fill_n(static_cast<float*>(host.bytes.get()), kMany, static_cast<float>(frame));
    Memory shared = device.state().done_bytes(std::move(host));
    EXPECT_GE(memory.now(), before + 4 * kMany);
    device.state().queue.enqueueCopyBuffer(shared, copy.memory, 0, 0, 4 * kMany);
    shared = {};
    EXPECT_EQ(download(device, copy), std::vector<float>(kMany, static_cast<float>(frame)));
    EXPECT_EQ(memory_left(memory, before), before);
  }
}

TEST(MemoryPool, SharedMemoryIsUsedAgainWhenNobodyReadsItAnyMore) {
  Device device;
  if (!device.state().is_in_place()) GTEST_SKIP() << "the device has memory of its own";
  const auto& memory = *device.state().memory;
  void *first = nullptr, *other = nullptr;
  {
    HostMemory one = device.state().host_bytes(4 * kMany);
    HostMemory two = device.state().host_bytes(4 * kMany);
    first = one.bytes.get();
    other = two.bytes.get();
    EXPECT_NE(first, other);
    const Memory shared = device.state().done_bytes(std::move(one));
    const Memory more = device.state().done_bytes(std::move(two));
  }
  EXPECT_EQ(memory_left(memory), 0u);
  const HostMemory again = device.state().host_bytes(4 * kMany);
  EXPECT_TRUE(again.bytes.get() == first || again.bytes.get() == other);
}

TEST(MemoryPool, HandlesMayOutliveTheDevice) {
  std::shared_ptr<DeviceMemory> memory;
  Buffer<float> left;
  {
    Device device;
    memory = device.state().memory;
    left = filled(device, kMany, 1.0f);
    filled(device, 3 * kMany, 1.0f);
    device.state().queue.finish();
  }
  EXPECT_GE(memory->now(), 4 * kMany);
  left = {};
  EXPECT_EQ(memory_left(*memory), 0u) << "nothing is left behind";
}

}  // namespace
}  // namespace meniscus
