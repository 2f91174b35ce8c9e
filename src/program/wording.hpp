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

/// What `work` returns, with the file's name before what it finds wrong with the particles in it. A
/// file that streams names itself.
template <class Work>
auto naming(const std::string& file, const Work& work) -> decltype(work()) {
  try {
    return work();
  } catch (const InputError& error) {
    const std::string words = words_of(error), name = file + ": ";
    throw InputError(words.starts_with(name) ? words : name + words);
  }
}

}  // namespace meniscus
