// Buffers of an opened device, seen from the host.
#include <gtest/gtest.h>

#include <algorithm>

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

// As if the device had memory of its own, or as if it had none.
void stage(Device& device, bool on) {
  device.state().staging = on ? std::make_unique<Staging>(device.state().context) : nullptr;
}

TEST_F(DeviceBuffer, ViewsOfOtherKindsOfDevicesAreCopies) {
  const auto buffer = upload(device_, std::vector<float>{1, 2, 3});
  stage(device_, true);
  const HostView view(device_, buffer);
  EXPECT_EQ(std::vector<float>(view.data(), view.data() + view.size()),
            (std::vector<float>{1, 2, 3}));
  EXPECT_EQ(download(device_, buffer), (std::vector<float>{1, 2, 3}));
}

TEST_F(DeviceBuffer, UploadsHoldWhatTheHostWroteAndZerosBehind) {
  for (const bool staged : {false, true}) {
    stage(device_, staged);
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

// What is on its way is not written over, however much there is of it; nor what is being looked at.
TEST_F(DeviceBuffer, ManyUploadsWithoutAWaitStayWhole) {
  stage(device_, true);
  constexpr std::size_t kLarge = 3 << 18;  // 3 MB: 300 MB in all, more than is ever staged
  constexpr int kUploads = 150;
  std::vector<Buffer<int>> buffers;
  for (int k = 0; k < kUploads; ++k) {
    Upload<int> values(device_, k % 3 == 2 ? 5 : kLarge);
    std::fill_n(values.data(), values.size(), k);
    buffers.push_back(values.done());
  }
  const HostView first(device_, buffers.front());
  for (int k = 0; k < kUploads; ++k) {
    const std::vector<int> found = download(device_, buffers[static_cast<std::size_t>(k)]);
    ASSERT_EQ(found, std::vector<int>(k % 3 == 2 ? 5 : kLarge, k));
  }
  EXPECT_TRUE(std::all_of(first.data(), first.data() + first.size(), [](int v) { return v == 0; }));
}

// More than is ever staged at a time goes through memory of its own.
TEST_F(DeviceBuffer, WhatIsTooLargeToStageGoesWithoutIt) {
  stage(device_, true);
  const std::size_t size = (std::size_t{260} << 20) / sizeof(int);
  Upload<int> values(device_, size);
  std::fill_n(values.data(), size, 11);
  const auto buffer = values.done();
  const HostView view(device_, buffer);
  EXPECT_EQ(view[0], 11);
  EXPECT_EQ(view[size - 1], 11);
}

TEST_F(DeviceBuffer, LaunchesAreTimedOrNot) {
  const auto words = filled<cl_uint>(device_, 64, 7u);
  const auto launched = [&] {
    launch(device_, "probe.cl", "lower_words", {64}, "", words, cl_uint{63});
    return device_.state().take_times().size();
  };
  EXPECT_EQ(launched(), 1u);
  {
    const TimedKernels untimed(device_, false);
    EXPECT_EQ(launched(), 0u);
    const TimedKernels timed(device_, true);
    EXPECT_EQ(launched(), 1u);
  }
  EXPECT_EQ(launched(), 1u);
}

TEST_F(DeviceBuffer, AreFilledToTheLastValue) {
  for (const std::size_t size : {1u, 15u, 16u, 100u, 65535u, 65536u, 65537u, 300001u}) {
    stage(device_, size % 2 == 1);
    EXPECT_EQ(download(device_, filled(device_, size, 0.0f)), std::vector<float>(size, 0.0f));
    const auto words = filled<cl_int>(device_, size, -1234567);
    EXPECT_EQ(download(device_, words), std::vector<cl_int>(size, -1234567)) << size;
    const auto bytes = filled<cl_uchar>(device_, 4 * size + 1, 7);
    EXPECT_EQ(download(device_, bytes), std::vector<cl_uchar>(4 * size + 1, 7)) << size;
    const auto whole = filled<cl_uchar>(device_, 4 * size + 1, 9);
    const cl_uint two = 0x02020202;
    device_.state().fill_bytes(whole.memory, &two, 4, 4 * size);
    EXPECT_EQ(download(device_, whole).back(), 9)
        << "nothing behind the values is filled, " << size;
  }
}

TEST_F(DeviceBuffer, ViewsOfNothingAreEmpty) {
  const auto buffer = upload(device_, std::vector<float>{});
  EXPECT_EQ(HostView(device_, buffer).size(), 0u);
}

}  // namespace
}  // namespace meniscus
