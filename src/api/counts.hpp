// Counts by name.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "meniscus/types.hpp"

namespace meniscus {

using NamedCounts = std::vector<std::pair<std::string, std::int64_t>>;

/// The count of that name in named(). Throws Error where there is none.
std::int64_t Counts::*count_named(const std::string& name);

}  // namespace meniscus
