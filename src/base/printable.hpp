// Text from files, drivers and names, made fit to be shown: it may hold anything.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace meniscus {

/// A character of UTF-8 text.
struct Character {
  char32_t code;     // kNoCharacter: the byte is part of none
  std::size_t size;  // bytes
};
inline constexpr char32_t kNoCharacter = 0xffffffff;

/// The character that begins at a byte of `text`.
Character character_at(std::string_view text, std::size_t at);

/// For a terminal: what could steer it (control characters, and so escape sequences; marks that
/// turn the direction of writing) and what is no UTF-8 as \xNN. At most `most` characters, then
/// "...".
std::string printable(std::string_view text, std::size_t most);

/// For XML, HTML and JSON: what one of them does not allow (most control characters, what is no
/// UTF-8) becomes U+FFFD. Markup is left as it is.
std::string well_formed(std::string_view text);

/// For text between tags of XML and HTML and in their attributes: well-formed, without markup.
std::string escaped(std::string_view text);

}  // namespace meniscus
