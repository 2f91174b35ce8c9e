// How much two words differ.
#pragma once

#include <cstddef>
#include <string_view>

namespace meniscus {

/// How many letters must be put in, taken out or replaced to make one word of the other
/// (Levenshtein's distance).
std::size_t edit_distance(std::string_view from, std::string_view to);

}  // namespace meniscus
