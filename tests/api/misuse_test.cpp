// What extract() says to those who call it wrongly. It throws before anything is computed.
#include <gmock/gmock.h>

#include <cmath>

#include "meniscus/device.hpp"
#include "meniscus/extract.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

class Misuse : public testing::Test {
 protected:
  Misuse() { particles_.x = particles_.y = particles_.z = {0, 0.1f, 0.2f}; }

  void expect_refused(const std::string& why) {
    EXPECT_THAT(
        text_of_thrown<InvalidArgument>([&] { extract(device_, particles_, camera_, params_); }),
        testing::HasSubstr(why));
  }

  Device device_;
  Particles particles_;
  Camera camera_ = look_at({0, 0, 2}, {0, 0, 0}, {0, 1, 0}, 40, 16, 12);
  Parameters params_;
};

TEST_F(Misuse, OfArrays) {
  particles_.radius = {1, -1, 1};
  expect_refused("particles: radius of particle 1 is -1, must be > 0 and finite");
  particles_.radius.clear();
  particles_.z.pop_back();
  expect_refused("particles: x, y and z have 3, 3 and 2 values for 3 particles");
}

TEST_F(Misuse, OfTheCamera) {
  camera_ = {};
  expect_refused("camera: size is 0x0 pixels");
}

TEST_F(Misuse, OfParameters) {
  params_.fit.support = NAN;
  expect_refused("support is nan, must be at least");
  params_ = {};
  params_.particle_radius = -2;
  expect_refused("particle_radius is -2, must be > 0");
  params_ = {};
  params_.method = static_cast<Method>(77);
  expect_refused("method is number 77, must be one of the 10 of method_list()");
}

}  // namespace
}  // namespace meniscus
