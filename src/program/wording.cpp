#include "program/wording.hpp"

namespace meniscus {

std::string words_of(const Notice& notice) {
  return worded(notice.text, [](const std::string& name) { return "--" + name; });
}

std::string words_of(const std::exception& error) {
  const auto* const ours = dynamic_cast<const Error*>(&error);
  return ours ? words_of(ours->notice) : error.what();
}

}  // namespace meniscus
