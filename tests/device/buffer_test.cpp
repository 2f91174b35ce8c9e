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

TEST_F(DeviceBuffer, ViewsOfNothingAreEmpty) {
  const auto buffer = upload(device_, std::vector<float>{});
  EXPECT_EQ(HostView(device_, buffer).size(), 0u);
}

}  // namespace
}  // namespace meniscus
