// How many threads the host's loops of a frame may use.
#pragma once

#include "meniscus/device.hpp"

namespace meniscus {

/// Those of a part of a device, where it is one of several; 0: all there are.
inline unsigned host_threads(const DeviceInfo& device) {
  return device.is_part ? device.compute_units : 0;
}

}  // namespace meniscus
