// Walking through text: tokens, lines and numbers, with the line number for messages.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/input_file.hpp"

namespace meniscus {

/// The whole of `text` as a number; nan and inf in any case and a leading + are numbers. Nothing
/// where it is none or exceeds a double.
std::optional<double> parse_real(std::string_view text);

/// Whether `text` is a number, but one that exceeds a double.
bool exceeds_double(std::string_view text);

/// The whole of `text` as a whole number of 64 bits; also written as 12.0 or 1e3.
std::optional<std::int64_t> parse_integer(std::string_view text);

using Words = std::vector<std::string_view>;

/// The words of a line between blanks and tabs, in place of what `words` held.
void split_at_blanks(std::string_view line, Words& words);

class TextCursor {
 public:
  explicit TextCursor(const InputFile& file, std::size_t offset = 0, std::size_t line = 1)
      : file_(file), at_(offset), line_(line) {}

  /// The rest of this line without its end (\n, \r\n or \r); nothing at the end of the file.
  std::optional<std::string_view> next_line();

  /// Whether the line that next_line gave last had an end.
  bool line_was_ended() const { return line_was_ended_; }

  /// Fails unless it had: the last line of a table may be cut.
  void require_line_end() const;

  /// The next token between blanks and line ends; empty at the end of the file.
  std::string_view next_token();

  /// The next token, left where it is.
  std::string_view peek_token();

  /// The next token as a number. `what` names it in the message. A number that touches the end of
  /// the file is an error too: it may have lost digits.
  double real(std::string_view what);
  std::int64_t integer(std::string_view what);

  /// A word of the token or line that was read last as a number. `what` names it in the message.
  double real_of(std::string_view word, std::string_view what) const;
  std::int64_t integer_of(std::string_view word, std::string_view what) const;

  /// The next token as a count >= 0.
  std::size_t count(std::string_view what);

  void skip_blanks();
  std::size_t offset() const { return at_; }
  std::size_t line() const { return line_; }
  std::size_t remaining() const { return file_.size() - at_; }
  void move_to(std::size_t offset) { at_ = offset; }

  /// "line 12", the line of the token or line that was read last.
  std::string place() const { return "line " + std::to_string(token_line_); }

 private:
  std::string_view number_token(std::string_view what);

  const InputFile& file_;
  std::size_t at_;
  std::size_t line_;            // of at_, counted from 1
  std::size_t token_line_ = 1;  // of what was read last
  bool line_was_ended_ = false;
};

}  // namespace meniscus
