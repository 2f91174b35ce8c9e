// What is said of what goes wrong.
#pragma once

#include <string>

namespace meniscus {

/// The text of the error that `work` throws, of this kind; "no error" where it throws none.
template <class Thrown, class Work>
std::string text_of_thrown(const Work& work) {
  try {
    work();
  } catch (const Thrown& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace meniscus
