#include "program/batch/warnings.hpp"

namespace meniscus {
namespace {

// The message with # for each row of digits.
std::string kind_of(const std::string& message) {
  std::string kind;
  for (const char c : message)
    if (c < '0' || c > '9')
      kind += c;
    else if (kind.empty() || kind.back() != '#')
      kind += '#';
  return kind;
}

}  // namespace

std::string FrameWarning::message() const {
  return first + (same ? "" : " (the first; the others differ in their numbers)");
}

bool FrameWarnings::add(std::int64_t frame, const std::string& message) {
  const auto [at, is_new] = known_.emplace(kind_of(message), kinds_.size());
  if (is_new) kinds_.push_back({message, {}});
  FrameWarning& kind = kinds_[at->second];
  kind.same = kind.same && kind.first == message;
  if (kind.frames.empty() || kind.frames.back() != frame) kind.frames.push_back(frame);
  return tell(message);
}

bool FrameWarnings::tell(const std::string& message) {
  return told_.insert(kind_of(message)).second;
}

}  // namespace meniscus
