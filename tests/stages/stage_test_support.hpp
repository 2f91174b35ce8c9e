// What the tests of stages share: devices, and the inputs of verify.
#pragma once

#include <gtest/gtest.h>

#include <cctype>
#include <ostream>
#include <string>
#include <vector>

#include "device/device.hpp"
#include "stages/view.hpp"
#include "verify/stage_cases.hpp"
#include "verify/stage_cases/inputs.hpp"

namespace meniscus {

/// Looked for once in a process.
inline const std::vector<DeviceInfo>& usable_devices() {
  static const std::vector<DeviceInfo> usable = [] {
    std::vector<DeviceInfo> some = list_devices();
    std::erase_if(some, [](const DeviceInfo& device) { return !device.usable; });
    return some;
  }();
  return usable;
}

/// How GoogleTest shows the device of a test.
inline void PrintTo(const DeviceInfo& device, std::ostream* out) {
  *out << "device " << device.index << ", " << device.name;
}

inline std::string device_test_name(const testing::TestParamInfo<DeviceInfo>& test) {
  std::string name = "Device" + std::to_string(test.param.index) + "_";
  for (const char c : test.param.name)
    if (std::isalnum(static_cast<unsigned char>(c))) name += c;
  return name;
}

/// A test that runs on every usable device.
class OnDevice : public testing::TestWithParam<DeviceInfo> {
 protected:
  Device device_{GetParam()};

  void use_width(int width) { device_.state().vector_width = width; }
};

/// What stages compute is as near to double precision as it may be.
inline void expect_within(const std::vector<verify::ReferenceError>& errors) {
  EXPECT_FALSE(errors.empty());
  for (const verify::ReferenceError& error : errors)
    EXPECT_LE(error.ulp, error.allowed) << error.kernel << ", " << error.output;
}

#define MENISCUS_ON_EVERY_DEVICE(suite)                                                         \
  INSTANTIATE_TEST_SUITE_P(EveryDevice, suite, testing::ValuesIn(::meniscus::usable_devices()), \
                           ::meniscus::device_test_name)

}  // namespace meniscus
