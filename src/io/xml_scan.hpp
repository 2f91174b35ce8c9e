// The tags of an XML text, one after the other, without a tree: what a file nests or repeats takes
// no memory. Knows what VTK's files have: elements, attributes, comments and instructions.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace meniscus {

struct XmlTag {
  std::string name;
  bool closes = false;          // </name>
  bool is_empty = false;        // <name ... />
  std::size_t at = 0, end = 0;  // of the tag in the text
  std::vector<std::pair<std::string, std::string>> attributes;

  /// The value of an attribute, or `otherwise`.
  std::string attribute(const std::string& key, const std::string& otherwise) const;
};

class XmlScan {
 public:
  /// Of a text that outlives the scan; `file` names it in messages.
  XmlScan(std::string_view text, std::string file) : text_(text), file_(std::move(file)) {}
  /// The next tag; nothing at the end. Throws InputError.
  std::optional<XmlTag> next();

 private:
  /// Goes to the next tag, past comments and the like; false at the end.
  bool go_to_tag();
  [[noreturn]] void fail_at(std::size_t at, const std::string& message) const;
  std::string_view text_;
  std::string file_;
  std::size_t at_ = 0;
};

}  // namespace meniscus
