// Finding and choosing OpenCL devices.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <future>

#include "device/device.hpp"
#include "device/stage_clock.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string error_of(const std::string& selector) {
  return text_of_thrown<DeviceError>([&] { select_device(selector); });
}

// Threads of PoCL do not live in a child: a frame waited for them for ever.
TEST(ForkedProcess, IsToldThatOpenClDoesNotWorkThere) {
  Device device;
  const pid_t child = fork();
  if (child == 0) {
    alarm(20);
    const std::string said =
        text_of_thrown<DeviceError>([] { list_devices(); }) +
        text_of_thrown<DeviceError>([&] { Device(device.info()); }) +
        text_of_thrown<DeviceError>([&] { StageClock(device, {}).start("a"); });
    int told = 0;
    for (std::size_t at = 0; (at = said.find("was forked", at)) != std::string::npos; ++at) ++told;
    _exit(told);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 3);
}

TEST(ListDevices, NumbersThemInOrderAndSaysWhyOneIsUnusable) {
  const auto devices = list_devices();
  ASSERT_FALSE(devices.empty());
  for (std::size_t k = 0; k < devices.size(); ++k) {
    EXPECT_EQ(devices[k].index, static_cast<int>(k));
    EXPECT_FALSE(devices[k].name.empty());
    EXPECT_GT(devices[k].compute_units, 0u);
    EXPECT_GT(devices[k].largest_buffer, 0u);
    EXPECT_EQ(devices[k].usable, devices[k].problem.empty());
  }
}

TEST(SelectDevice, TakesTheFastestKindWhenNothingIsAsked) {
  std::string why;
  const DeviceInfo chosen = select_device("", &why);
  EXPECT_TRUE(chosen.usable);
  EXPECT_THAT(why, HasSubstr("fastest kind found"));
  const auto rank = [](const DeviceInfo& d) {
    return d.kind == DeviceKind::gpu ? 0 : d.kind == DeviceKind::accelerator ? 1 : 2;
  };
  for (const DeviceInfo& other : list_devices())
    if (other.usable) {
      EXPECT_LE(rank(chosen), rank(other));
    }
}

TEST(SelectDevice, TakesAnIndexAndAPartOfANameInAnyCase) {
  for (const DeviceInfo& device : list_devices()) {
    if (!device.usable) continue;
    EXPECT_EQ(select_device(std::to_string(device.index)).index, device.index);
    std::string part = device.name.substr(0, 6);
    for (char& c : part) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    EXPECT_EQ(select_device(part).name.substr(0, 6), device.name.substr(0, 6));
    if (device.kind == DeviceKind::cpu) {
      EXPECT_EQ(select_device("CPU").kind, DeviceKind::cpu);
    }
  }
}

TEST(SelectDevice, NamesTheDevicesThereAreWhenNoneMatches) {
  const std::string first = list_devices().front().name;
  EXPECT_THAT(error_of("no such device"),
              AllOf(HasSubstr("no usable OpenCL device matches \"no such device\""),
                    HasSubstr("0 \"" + first + "\"")));
  EXPECT_THAT(error_of("99"), HasSubstr("matches \"99\""));
  // Too long for a number: looked for among the names.
  EXPECT_THAT(error_of("99999999999999999999"), HasSubstr("no usable OpenCL device matches"));
}

bool has_cpu() {
  const std::vector<DeviceInfo> devices = list_devices();
  return std::any_of(devices.begin(), devices.end(), [](const DeviceInfo& device) {
    return device.kind == DeviceKind::cpu && device.usable;
  });
}

TEST(DividedDevice, HasPartsThatTogetherAreItOrIsItself) {
  if (!has_cpu()) GTEST_SKIP() << "only a CPU can be divided";
  const DeviceInfo whole = select_device("cpu");
  for (const int frames : {1, 2, 3, 5}) {
    const std::vector<DeviceInfo> parts = divided(whole, frames);
    ASSERT_EQ(parts.size(), static_cast<std::size_t>(frames));
    unsigned units = 0, own = 0;
    for (const DeviceInfo& part : parts) {
      EXPECT_EQ(part.name, whole.name);
      EXPECT_EQ(part.is_part, parts[0].is_part);
      if (!part.is_part) {
        EXPECT_EQ(handle_of(part)(), handle_of(whole)());
      } else if (own++ < whole.compute_units) {  // further frames share parts
        EXPECT_NE(handle_of(part)(), handle_of(whole)());
        units += part.compute_units;
      }
    }
    EXPECT_EQ(parts[0].is_part ? units : whole.compute_units, whole.compute_units);
    if (whole.platform == "Portable Computing Language" && whole.compute_units > 1) {
      EXPECT_EQ(parts[0].is_part, frames > 1) << "PoCL can be divided";
    }
  }
}

TEST(DividedDevice, HasAtLeastOnePart) {
  EXPECT_THROW(divided(select_device(), 0), InvalidArgument);
  EXPECT_THROW(divided(select_device(), -1), InvalidArgument);
}

TEST(DividedDevice, PartsOfDifferentFramesComputeAtTheSameTime) {
  if (!has_cpu()) GTEST_SKIP() << "only a CPU can be divided";
  const std::vector<float> values(100'000, 2.5f);
  std::vector<std::future<std::vector<float>>> copies;
  for (const DeviceInfo& part : divided(select_device("cpu"), 3))
    copies.push_back(std::async(std::launch::async, [&values, part] {
      Device device(part);
      return download(device, upload(device, values));
    }));
  for (auto& copy : copies) EXPECT_EQ(copy.get(), values);
}

class OpenDevice : public testing::Test {
 protected:
  Device device_;
};

TEST_F(OpenDevice, RefusesABufferThatIsTooLargeAndNamesTheDevice) {
  const std::size_t bytes = device_.info().largest_buffer + 1;
  EXPECT_THAT(text_of_thrown<DeviceError>([&] { allocate<char>(device_, bytes); }),
              AllOf(HasSubstr(std::to_string(bytes)), HasSubstr(device_.info().name),
                    HasSubstr("another device")));
}

TEST_F(OpenDevice, NamesKernelAndNumberWhenArgumentsDoNotFit) {
  EXPECT_THAT(text_of_thrown<DeviceError>(
                  [&] { launch(device_, "visible.cl", "count_owned", {1}, "", cl_int{1}); }),
              AllOf(HasSubstr("visible.cl: count_owned takes"), HasSubstr("arguments, not 1")));
}

TEST_F(OpenDevice, NamesFileAndErrorWhenAKernelDoesNotBuild) {
  EXPECT_THAT(text_of_thrown<DeviceError>([&] {
                launch(device_, "visible.cl", "count_owned", {1}, "-D cos=( -D int=)", cl_int{1});
              }),
              AllOf(HasSubstr("visible.cl did not build on \""), HasSubstr(device_.info().name),
                    HasSubstr("error")));
}

TEST_F(OpenDevice, NamesAFileThatIsNotThere) {
  EXPECT_THROW(launch(device_, "missing.cl", "nothing", {1}, "", cl_int{1}), DeviceError);
}

TEST_F(OpenDevice, BuffersRoundTripAndAreFilled) {
  for (const std::size_t n : {std::size_t{1}, std::size_t{63}, std::size_t{1000}}) {
    std::vector<float> values(n);
    for (std::size_t k = 0; k < n; ++k) values[k] = static_cast<float>(k) + 0.5f;
    EXPECT_EQ(download(device_, upload(device_, values)), values);
    EXPECT_EQ(download(device_, filled<cl_int>(device_, n, -7)), std::vector<cl_int>(n, -7));
    EXPECT_EQ(download(device_, filled<cl_uchar>(device_, n, 3)), std::vector<cl_uchar>(n, 3));
  }
  EXPECT_TRUE(download(device_, upload(device_, std::vector<float>{})).empty());
}

}  // namespace
}  // namespace meniscus
