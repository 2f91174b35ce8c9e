// What runtimes are known to do wrong (docs/runtime_flaws): whether a device does it, too.
#pragma once

#include <string_view>
#include <vector>

#include "verify/run.hpp"

namespace meniscus::verify {

/// An item for each flaw. Nothing of ours rests on them.
std::vector<Item> flaw_items();

}  // namespace meniscus::verify

namespace meniscus {

/// The text of the file in docs/runtime_flaws with that name.
std::string_view flaw_file(std::string_view name);

}  // namespace meniscus
