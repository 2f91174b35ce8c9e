// What the frames of a batch warn of, or fail with, each kind of it once.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace meniscus {

/// One kind of warning.
struct FrameWarning {
  std::string first;                 // message
  std::vector<std::int64_t> frames;  // that have it
  bool same = true;                  // in all of them

  /// For all of them together.
  std::string message() const;
};

/// Warnings that differ in their numbers alone are of one kind.
class FrameWarnings {
 public:
  /// Returns whether it is the first of its kind, and none such was told.
  bool add(std::int64_t frame, const std::string& message);

  /// The same of one that a frame under way has; it is yet to be added.
  bool tell(const std::string& message);

  /// In the order in which they came.
  const std::vector<FrameWarning>& kinds() const { return kinds_; }

 private:
  std::vector<FrameWarning> kinds_;
  std::map<std::string, std::size_t> known_;  // where each kind is
  std::set<std::string> told_;                // kinds
};

}  // namespace meniscus
