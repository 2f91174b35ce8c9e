#include "base/printable.hpp"

#include <cstdio>

namespace meniscus {
namespace {

bool is_control(char32_t c) { return c < 0x20 || (c >= 0x7f && c < 0xa0); }

// Embeddings, overrides and isolates of the Unicode bidirectional algorithm.
bool turns_direction(char32_t c) {
  return (c >= 0x202a && c <= 0x202e) || (c >= 0x2066 && c <= 0x2069);
}

// The characters of XML 1.0, section 2.2.
bool is_xml(char32_t c) {
  return c == '\t' || c == '\n' || c == '\r' || (c >= 0x20 && c < 0xfffe) ||
         (c >= 0x10000 && c <= 0x10ffff);
}

std::string spelled_out(std::string_view bytes) {
  std::string text;
  for (const char c : bytes) {
    char escaped[8];
    std::snprintf(escaped, sizeof escaped, "\\x%02x", static_cast<unsigned char>(c));
    text += escaped;
  }
  return text;
}

}  // namespace

Character character_at(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[at + k]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return {first, 1};
  const std::size_t size = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  constexpr Character kNone{kNoCharacter, 1};
  if (first < 0xc2 || first > 0xf4 || size > text.size() - at) return kNone;
  char32_t code = first & (0x7fu >> size);
  for (std::size_t k = 1; k < size; ++k) {
    if ((byte(k) & 0xc0) != 0x80) return kNone;
    code = code << 6 | (byte(k) & 0x3fu);
  }
  constexpr char32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};  // of so many bytes
  const bool surrogate = code >= 0xd800 && code < 0xe000;
  return code < kLeast[size] || code > 0x10ffff || surrogate ? kNone : Character{code, size};
}

std::string printable(std::string_view text, std::size_t most) {
  std::string result;
  for (std::size_t at = 0, count = 0; at < text.size(); ++count) {
    if (count == most) return result + "...";
    const auto [code, size] = character_at(text, at);
    const std::string_view bytes = text.substr(at, size);
    if (code == kNoCharacter || is_control(code) || turns_direction(code))
      result += spelled_out(bytes);
    else
      result += bytes;
    at += size;
  }
  return result;
}

std::string well_formed(std::string_view text) {
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const auto [code, size] = character_at(text, at);
    if (is_xml(code))
      result += text.substr(at, size);
    else
      result += "\xef\xbf\xbd";
    at += size;
  }
  return result;
}

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : well_formed(text)) switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  return result;
}

}  // namespace meniscus
