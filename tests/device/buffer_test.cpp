// Buffers of an opened device, seen from the host.
#include <gtest/gtest.h>

#include "device/device.hpp"

namespace meniscus {
namespace {

class DeviceBuffer : public testing::Test {
 protected:
  Device device_;
};

TEST_F(DeviceBuffer, ViewsShowWhatWasWritten) {
  std::vector<int> values(1000);
  for (int k = 0; k < 1000; ++k) values[static_cast<std::size_t>(k)] = 3 * k;
  const auto buffer = upload(device_, values);
  {
    const HostView view(device_, buffer);
    ASSERT_EQ(view.size(), values.size());
    EXPECT_EQ(std::vector<int>(view.data(), view.data() + view.size()), values);
    EXPECT_EQ(view[999], 2997);
  }
  EXPECT_EQ(download(device_, buffer), values);  // and again when the view is gone
}

TEST_F(DeviceBuffer, ViewsOfOtherKindsOfDevicesAreCopies) {
  const auto buffer = upload(device_, std::vector<float>{1, 2, 3});
  device_.state().info.kind = DeviceKind::gpu;
  const HostView view(device_, buffer);
  EXPECT_EQ(std::vector<float>(view.data(), view.data() + view.size()),
            (std::vector<float>{1, 2, 3}));
}

TEST_F(DeviceBuffer, UploadsHoldWhatTheHostWroteAndZerosBehind) {
  for (const DeviceKind kind : {device_.info().kind, DeviceKind::gpu}) {
    device_.state().info.kind = kind;
    for (const std::size_t size : {0u, 1u, 16u, 1000u}) {
      Upload<int> values(device_, size);
      for (std::size_t k = 0; k < size; ++k) values[k] = 7 - static_cast<int>(k);
      const auto buffer = values.done();
      ASSERT_EQ(buffer.size, size);
      std::vector<int> all(size + 16, -1);
      device_.state().read_bytes(buffer.memory, all.data(), all.size() * sizeof(int));
      for (std::size_t k = 0; k < all.size(); ++k)
        ASSERT_EQ(all[k], k < size ? 7 - static_cast<int>(k) : 0) << k << " of " << size;
    }
  }
}

TEST_F(DeviceBuffer, AreFilledToTheLastValue) {
  for (const std::size_t size : {1u, 15u, 16u, 100u, 65535u, 65536u, 65537u, 300001u}) {
    const auto words = filled<cl_int>(device_, size, -1234567);
    EXPECT_EQ(download(device_, words), std::vector<cl_int>(size, -1234567)) << size;
    const auto bytes = filled<cl_uchar>(device_, 4 * size + 1, 7);
    EXPECT_EQ(download(device_, bytes), std::vector<cl_uchar>(4 * size + 1, 7)) << size;
    for (const cl::Buffer& buffer : {cl::Buffer(words.memory), cl::Buffer(bytes.memory)}) {
      cl_uchar next = 1;
      const std::size_t end = buffer() == cl::Buffer(words.memory)() ? 4 * size : 4 * size + 4;
      device_.state().queue.enqueueReadBuffer(buffer, CL_TRUE, end, 1, &next);
      EXPECT_EQ(next, 0) << "nothing behind the values is filled, " << size;
    }
  }
}

TEST_F(DeviceBuffer, ViewsOfNothingAreEmpty) {
  const auto buffer = upload(device_, std::vector<float>{});
  EXPECT_EQ(HostView(device_, buffer).size(), 0u);
}

}  // namespace
}  // namespace meniscus
