// Buffers of an opened device, seen from the host.
#include <gtest/gtest.h>

#include <algorithm>

#include "device/device.hpp"
#include "device/stage_clock.hpp"
#include "device/together.hpp"

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
  device.state().send_uploads();  // they may lie in the memory that goes
  device.state().take_times();    // which waits for them
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

TEST_F(DeviceBuffer, UploadsHoldWhatTheHostWrote) {
  for (const bool staged : {false, true}) {
    stage(device_, staged);
    for (const std::size_t size : {0u, 1u, 16u, 1000u}) {
      Upload<int> values(device_, size);
      for (std::size_t k = 0; k < size; ++k) values[k] = 7 - static_cast<int>(k);
      const auto buffer = values.done();
      ASSERT_EQ(buffer.size, size);
      const std::vector<int> all = download(device_, buffer);
      for (std::size_t k = 0; k < size; ++k)
        ASSERT_EQ(all[k], 7 - static_cast<int>(k)) << k << " of " << size;
    }
  }
}

// Arrays of different types in one piece of memory: each begins where its own values do, whether
// the host writes them or reads what kernels wrote.
TEST_F(DeviceBuffer, ArraysAreWrittenAndReadTogether) {
  for (const bool staged : {false, true}) {
    stage(device_, staged);
    const std::vector<float> x{1, 2, 3};
    const std::vector<cl_uchar> bytes(4099, 7);
    const std::vector<cl_uint> none;
    const auto [a, b, c] = upload_together(device_, x, bytes, none);
    EXPECT_EQ(download(device_, a), x);
    EXPECT_EQ(download(device_, b), bytes);
    EXPECT_EQ(c.size, 0u);

    const Together<cl_uint, cl_uchar, cl_uint> both(device_, {128, 5, 64});
    fill(device_, both.part<0>(), 7u);
    fill(device_, both.part<1>(), cl_uchar{3});
    fill(device_, both.part<2>(), 0xffffffffu);
    launch(device_, "probe.cl", "lower_words", {64}, "", both.part<2>(), cl_uint{63});
    const CommandCounts before = device_.state().counts;
    const ViewTogether view(device_, both);
    EXPECT_EQ(device_.state().counts.since(before).reads, 1);
    EXPECT_TRUE(
        std::all_of(view.data<0>(), view.data<0>() + 128, [](cl_uint v) { return v == 7; }));
    EXPECT_TRUE(std::all_of(view.data<1>(), view.data<1>() + 5, [](cl_uchar v) { return v == 3; }));
    EXPECT_TRUE(std::all_of(view.data<2>(), view.data<2>() + 64,
                            [](cl_uint v) { return v < 0xffffffffu; }));
  }
}

// Some of the arrays that lie side by side are filled and read without the others, whether they
// share a piece of memory or there is none so large.
TEST_F(DeviceBuffer, SomeArraysAreFilledAndReadTogether) {
  std::size_t& largest = device_.state().info.largest_buffer;
  const std::size_t before = largest;
  for (const bool shared : {true, false}) {
    stage(device_, true);
    largest = shared ? before : 8 << 10;
    const Together<float, float, cl_uchar, cl_int, float> all(device_, {1000, 3, 5, 20, 7});
    EXPECT_EQ(all.whole.size > 0, shared);
    fill(device_, all.part<0>(), 1.0f);
    fill(device_, all.part<3>(), 9);
    fill(device_, all.part<4>(), 4.0f);
    const CommandCounts at_first = device_.state().counts;
    all.fill_some<1, 1>(device_, 2.5f);
    all.fill_some<2, 3>(device_, 0);
    EXPECT_EQ(device_.state().counts.since(at_first).fills, shared ? 2 : 3);
    const auto some = all.some<1, float, cl_uchar>(device_);
    EXPECT_TRUE(same_memory(some.part<1>().memory, all.part<2>().memory));
    const CommandCounts filled = device_.state().counts;
    const ViewTogether view(device_, some);
    EXPECT_EQ(device_.state().counts.since(filled).reads, shared ? 1 : 2);
    EXPECT_EQ(std::vector<float>(view.data<0>(), view.data<0>() + 3), std::vector<float>(3, 2.5f));
    EXPECT_EQ(std::vector<cl_uchar>(view.data<1>(), view.data<1>() + 5), std::vector<cl_uchar>(5));
    EXPECT_EQ(download(device_, all.part<0>()), std::vector<float>(1000, 1.0f));
    EXPECT_EQ(download(device_, all.part<3>()), std::vector<cl_int>(20));
    EXPECT_EQ(download(device_, all.part<4>()), std::vector<float>(7, 4.0f));
  }
  largest = before;
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

// What was uploaded between two commands goes by one, arrays in one piece of memory among it; what
// is large does not wait.
TEST_F(DeviceBuffer, UploadsBetweenTwoCommandsGoByOne) {
  stage(device_, true);
  const std::vector<cl_uint> words(1000, 0xffffffffu);
  const std::vector<float> few{1, 2, 3};
  const std::vector<cl_uchar> bytes(5000, 4);
  const auto count = [&](const CommandCounts& before) {
    return device_.state().counts.since(before).uploads;
  };
  CommandCounts before = device_.state().counts;
  const auto first = upload(device_, words), second = upload(device_, words);
  const auto [a, b, c] = upload_together(device_, few, bytes, words);
  EXPECT_EQ(count(before), 0);
  launch(device_, "probe.cl", "lower_words", {1000}, "", second, cl_uint{63});
  EXPECT_EQ(count(before), 1);
  EXPECT_EQ(download(device_, first), words);
  EXPECT_NE(download(device_, second), words);
  EXPECT_EQ(download(device_, a), few);
  EXPECT_EQ(download(device_, b), bytes);
  EXPECT_EQ(download(device_, c), words);
  EXPECT_EQ(count(before), 1);

  // One that a fill is to change comes before it.
  const auto filled_later = upload(device_, words);
  fill(device_, filled_later, 5u);
  EXPECT_EQ(download(device_, filled_later), std::vector<cl_uint>(1000, 5));

  before = device_.state().counts;
  const auto large = upload(device_, std::vector<float>(2000000, 0.5f));
  EXPECT_EQ(count(before), 1);
  EXPECT_EQ(download(device_, large), std::vector<float>(2000000, 0.5f));

  // Also where the first page-locked memory has room for one of them alone, and what was locked
  // later for both.
  const std::vector<cl_uint> many(200000, 7);
  EXPECT_EQ(download(device_, upload(device_, many)), many);
  before = device_.state().counts;
  const auto one = upload(device_, many), other = upload(device_, many);
  EXPECT_EQ(download(device_, one), many);
  EXPECT_EQ(count(before), 1);
  EXPECT_EQ(download(device_, other), many);
}

// Blocks that uploads share are given up one after the other, and parts stay whole.
TEST_F(DeviceBuffer, UploadsOutliveTheNextOnes) {
  stage(device_, true);
  std::vector<Buffer<int>> buffers;
  for (int k = 0; k < 100; ++k) {
    buffers.push_back(upload(device_, std::vector<int>(100000, k)));
    if (k % 7 == 3) buffers.erase(buffers.begin());
    if (k % 5 == 4) download(device_, buffers.front());
  }
  for (const auto& buffer : buffers) {
    const std::vector<int> found = download(device_, buffer);
    ASSERT_EQ(found, std::vector<int>(100000, found[0]));
  }
  EXPECT_EQ(download(device_, buffers.back())[0], 99);
}

TEST_F(DeviceBuffer, ConstantsAreKept) {
  const auto many = constant(device_, 1000, 1.0f);
  const CommandCounts before = device_.state().counts;
  const auto few = constant(device_, 10, 1.0f);
  EXPECT_EQ(device_.state().counts.since(before).fills, 0);
  EXPECT_TRUE(same_memory(many.memory, few.memory));
  const auto more = constant(device_, 70000, 1.0f);
  const auto other = constant(device_, 5, -2);
  EXPECT_EQ(download(device_, many), std::vector<float>(1000, 1.0f));
  EXPECT_EQ(download(device_, few), std::vector<float>(10, 1.0f));
  EXPECT_EQ(download(device_, more), std::vector<float>(70000, 1.0f));
  EXPECT_EQ(download(device_, other), std::vector<int>(5, -2));
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

TEST_F(DeviceBuffer, AStageThatFailedLeavesNoTimesToTheNextFrame) {
  const auto words = filled<cl_uint>(device_, 64, 7u);
  std::vector<StageTime> times;
  EXPECT_THROW(
      {
        StageClock clock(device_, &times);
        clock.start("fit");
        launch(device_, "probe.cl", "lower_words", {64}, "", words, cl_uint{63});
        throw DeviceError("stopped");
      },
      DeviceError);
  EXPECT_TRUE(times.empty());
  EXPECT_TRUE(device_.state().take_times().empty());
  EXPECT_EQ(device_.state().stage, "");
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
