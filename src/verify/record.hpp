// Recording canonical bits.
#pragma once

#include <functional>
#include <string>

#include "device/device.hpp"
#include "verify/canonical.hpp"

namespace meniscus::verify {

/// What this device computes, as canonical bits of all cases, with its name and the references'
/// verdict as their origin. Throws when two vector widths differ in a frame's result, or a result
/// is farther from double precision than allowed. Several devices: agreed(). `say` is told of each
/// step.
Canonical record_canonical(Device& device, const std::function<void(const std::string&)>& say);

}  // namespace meniscus::verify
