// Both ways to draw discs, on the same device.
#pragma once

#include <utility>

#include "device/device.hpp"

namespace meniscus::verify {

/// How a device draws discs while it lives.
class WithDiscs {
 public:
  WithDiscs(Device& device, DiscForm form)
      : discs_(device.state().discs), before_(std::exchange(discs_, form)) {}
  ~WithDiscs() { discs_ = before_; }
  WithDiscs(const WithDiscs&) = delete;
  WithDiscs& operator=(const WithDiscs&) = delete;

 private:
  DiscForm& discs_;
  DiscForm before_;
};

}  // namespace meniscus::verify
