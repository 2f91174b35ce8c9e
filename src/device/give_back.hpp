// Memory that is not in use, back to the system: a frame that is made in parts would else hold all
// that any of its steps ever took.
#pragma once

#include <cstdlib>  // defines __GLIBC__ where it is that

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "device/device.hpp"

namespace meniscus {

/// Drops what the device and the host's allocator keep for later. Where large arrays of many sizes
/// come and go, that grows to as much as is in use. Waits for the device.
inline void give_back_idle(Device& device) {
  device.state().pool->drop_idle();
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

}  // namespace meniscus
