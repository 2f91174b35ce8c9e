#include "io/text_cursor.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace meniscus {
namespace {

bool is_blank(char c) {
  return c == ' ' || c == '\n' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

std::string_view without_plus(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  return text;
}

}  // namespace

void split_at_blanks(std::string_view line, Words& words) {
  words.clear();
  for (std::size_t at = 0; (at = line.find_first_not_of(" \t", at)) != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(" \t", at), line.size());
    words.push_back(line.substr(at, end - at));
    at = end;
  }
}

std::optional<double> parse_real(std::string_view text) {
  text = without_plus(text);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

bool exceeds_double(std::string_view text) {
  text = without_plus(text);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc::result_out_of_range && end == text.data() + text.size();
}

std::optional<std::int64_t> parse_integer(std::string_view text) {
  text = without_plus(text);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc()) return std::nullopt;
  if (end == text.data() + text.size()) return value;
  const std::optional<double> real = parse_real(text);
  if (!real || !(std::abs(*real) < 0x1p63) || *real != std::trunc(*real)) return std::nullopt;
  return static_cast<std::int64_t>(*real);
}

std::optional<std::string_view> TextCursor::next_line() {
  token_line_ = line_;
  const std::string_view rest = std::string_view(file_.bytes).substr(at_);
  if (rest.empty()) return std::nullopt;
  const std::size_t end = rest.find_first_of("\r\n");
  line_was_ended_ = end != std::string_view::npos;
  if (!line_was_ended_) {
    at_ = file_.size();
    return rest;
  }
  const bool two = rest[end] == '\r' && end + 1 < rest.size() && rest[end + 1] == '\n';
  at_ += end + (two ? 2 : 1);
  ++line_;
  return rest.substr(0, end);
}

void TextCursor::require_line_end() const {
  if (!line_was_ended_)
    fail(file_, place(),
         "the last line has no end (truncated? if it is complete, end it with a new line)");
}

void TextCursor::skip_blanks() {
  const std::string& bytes = file_.bytes;
  for (; at_ < bytes.size() && is_blank(bytes[at_]); ++at_)
    if (bytes[at_] == '\n' ||
        (bytes[at_] == '\r' && (at_ + 1 == bytes.size() || bytes[at_ + 1] != '\n')))
      ++line_;
}

std::string_view TextCursor::next_token() {
  const std::string_view token = peek_token();
  at_ += token.size();
  return token;
}

std::string_view TextCursor::peek_token() {
  skip_blanks();
  token_line_ = line_;
  const std::string& bytes = file_.bytes;
  std::size_t end = at_;
  while (end < bytes.size() && !is_blank(bytes[end])) ++end;
  return std::string_view(bytes).substr(at_, end - at_);
}

std::string_view TextCursor::number_token(std::string_view what) {
  const std::string_view token = next_token();
  if (token.empty())
    fail(file_, place(), "the file ends here, wanted " + std::string(what) + " (truncated?)");
  if (at_ == file_.size())
    fail(file_, place(),
         "the file ends right after " + in_quotes(token) + ", wanted " + std::string(what) +
             " and a line end (truncated? if it is complete, end its last line)");
  return token;
}

double TextCursor::real(std::string_view what) { return real_of(number_token(what), what); }

std::int64_t TextCursor::integer(std::string_view what) {
  return integer_of(number_token(what), what);
}

double TextCursor::real_of(std::string_view word, std::string_view what) const {
  const std::optional<double> value = parse_real(word);
  if (!value)
    fail(file_, place(), "found " + in_quotes(word) + ", wanted a number for " + std::string(what));
  return *value;
}

std::int64_t TextCursor::integer_of(std::string_view word, std::string_view what) const {
  const std::optional<std::int64_t> value = parse_integer(word);
  if (!value)
    fail(
        file_, place(),
        "found " + in_quotes(word) + ", wanted a whole number of 64 bits for " + std::string(what));
  return *value;
}

std::size_t TextCursor::count(std::string_view what) {
  const std::int64_t value = integer(what);
  if (value < 0)
    fail(file_, place(),
         "found " + std::to_string(value) + " for " + std::string(what) + ", must be >= 0");
  return static_cast<std::size_t>(value);
}

}  // namespace meniscus
