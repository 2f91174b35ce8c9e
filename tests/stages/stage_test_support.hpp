// What the tests of stages share: devices, views, random numbers.
#pragma once

#include <gtest/gtest.h>

#include <cctype>
#include <cfloat>
#include <random>
#include <string>
#include <vector>

#include "device/device.hpp"
#include "meniscus/camera.hpp"
#include "stages/view.hpp"

namespace meniscus {

/// The largest relative error of one rounding to float.
inline constexpr double kEpsilon = FLT_EPSILON / 2;

inline std::vector<DeviceInfo> usable_devices() {
  std::vector<DeviceInfo> usable;
  for (const DeviceInfo& device : list_devices())
    if (device.usable) usable.push_back(device);
  return usable;
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

#define MENISCUS_ON_EVERY_DEVICE(suite)                                                         \
  INSTANTIATE_TEST_SUITE_P(EveryDevice, suite, testing::ValuesIn(::meniscus::usable_devices()), \
                           ::meniscus::device_test_name)

/// A perspective camera 10 world units in front of the origin, seen at an angle.
inline Camera perspective_camera(int width, int height) {
  return look_at({3, 2, 9}, {0.1, -0.2, 0}, {0, 1, 0}, 45, width, height);
}

/// The same with the image shifted by a quarter of its width and a tenth of its height (a lens
/// shift) and sheared by a little.
inline Camera off_centre_camera(int width, int height) {
  Camera camera = perspective_camera(width, height);
  camera.projection[1] = 0.05;
  camera.projection[2] = 0.5;
  camera.projection[6] = -0.2;
  return camera;
}

/// An orthographic camera with the same view; the image's height shows 8 world units.
inline Camera orthographic_camera(int width, int height) {
  Camera camera = perspective_camera(width, height);
  camera.projection = {
      0.25 * height / width, 0, 0, 0.1, 0, 0.25, 0, -0.05, 0, 0, -0.02, -1.02, 0, 0, 0, 1};
  return camera;
}

/// Uniform in [low, high), the same on every platform.
class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double operator()(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_()) / 4294967296.0;
  }

 private:
  std::mt19937 engine_;
};

}  // namespace meniscus
