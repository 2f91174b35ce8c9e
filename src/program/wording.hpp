// What the library says, in the program's words.
#pragma once

#include <string>

#include "meniscus/error.hpp"
#include "meniscus/notice.hpp"

namespace meniscus {

/// A notice's line; settings are options: --particle-radius.
std::string words_of(const Notice& notice);

/// The line of an error, of the library or not.
std::string words_of(const std::exception& error);

}  // namespace meniscus
