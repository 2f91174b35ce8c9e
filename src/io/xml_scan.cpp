#include "io/xml_scan.hpp"

#include "io/input_file.hpp"

namespace meniscus {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";
constexpr std::size_t kMostAttributes = 256;

std::string without_entities(std::string_view text) {
  static const std::pair<std::string_view, char> kEntities[] = {
      {"&lt;", '<'}, {"&gt;", '>'}, {"&amp;", '&'}, {"&quot;", '"'}, {"&apos;", '\''}};
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    char c = text[at];
    std::size_t length = 1;
    for (const auto& [entity, stands_for] : kEntities)
      if (text.substr(at).starts_with(entity)) {
        c = stands_for;
        length = entity.size();
      }
    result += c;
    at += length;
  }
  return result;
}

}  // namespace

std::string XmlTag::attribute(const std::string& key, const std::string& otherwise) const {
  for (const auto& [name, value] : attributes)
    if (name == key) return value;
  return otherwise;
}

void XmlScan::fail_at(std::size_t at, const std::string& message) const {
  throw InputError(file_ + ": " + byte_place(at) + ": " + message);
}

bool XmlScan::go_to_tag() {
  const auto behind = [&](std::string_view end, std::size_t from) {
    const std::size_t found = text_.find(end, from);
    if (found == std::string_view::npos)
      fail_at(at_, "the text ends before " + std::string(end) + " (truncated?)");
    return found + end.size();
  };
  while ((at_ = text_.find('<', at_)) != std::string_view::npos) {
    const std::string_view rest = text_.substr(at_);
    if (rest.starts_with("<!--"))
      at_ = behind("-->", at_ + 4);
    else if (rest.starts_with("<![CDATA["))
      at_ = behind("]]>", at_);
    else if (rest.starts_with("<?") || rest.starts_with("<!"))
      at_ = behind(">", at_);
    else
      return true;
  }
  at_ = text_.size();
  return false;
}

std::optional<XmlTag> XmlScan::next() {
  if (!go_to_tag()) return std::nullopt;
  XmlTag tag;
  tag.at = at_;
  std::size_t at = at_ + 1;
  const auto peek = [&] {
    if (at >= text_.size()) fail_at(tag.at, "the text ends inside a tag (truncated?)");
    return text_[at];
  };
  const auto skip_blanks = [&] {
    while (kBlanks.find(peek()) != std::string_view::npos) ++at;
  };
  const auto name = [&] {
    const std::size_t first = at;
    while (std::string_view(" \t\r\n=/><\"'").find(peek()) == std::string_view::npos) ++at;
    if (at == first) fail_at(at, "found " + in_quotes(text_.substr(at, 1)) + ", wanted a name");
    return std::string(text_.substr(first, at - first));
  };
  if (peek() == '/') {
    tag.closes = true;
    ++at;
  }
  tag.name = name();
  for (skip_blanks(); peek() != '>'; skip_blanks()) {
    if (peek() == '/' && !tag.closes) {
      ++at;
      if (peek() != '>') fail_at(at, "found / inside a tag, wanted />");
      tag.is_empty = true;
      continue;
    }
    std::string key = name();
    skip_blanks();
    if (peek() != '=') fail_at(at, "attribute " + shown(key) + " has no value");
    ++at;
    skip_blanks();
    const char quote = peek();
    if (quote != '"' && quote != '\'')
      fail_at(at, "the value of " + shown(key) + " is not in quotes");
    const std::size_t end = text_.find(quote, at + 1);
    if (end == std::string_view::npos)
      fail_at(at, "the value of " + shown(key) + " has no end (truncated?)");
    if (tag.attributes.size() == kMostAttributes) fail_at(at, "a tag has too many attributes");
    tag.attributes.emplace_back(std::move(key),
                                without_entities(text_.substr(at + 1, end - at - 1)));
    at = end + 1;
  }
  at_ = tag.end = at + 1;
  return tag;
}

}  // namespace meniscus
