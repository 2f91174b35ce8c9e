// A whole input file in memory, and the errors that readers throw.
#pragma once

#include <cstddef>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

#include "meniscus/error.hpp"

namespace meniscus {

struct InputFile {
  std::string name;   // as the user gave it: every message begins with it
  std::string bytes;  // the whole content
  std::size_t size() const { return bytes.size(); }
};

/// An open file; closed with its owner.
using OpenFile = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

/// Opens a file for reading. Throws InputError when it is missing, unreadable, or no regular file:
/// a pipe or a device may make the program wait for ever.
OpenFile open_input(const std::string& path);

/// Reads a whole file. Throws InputError as open_input does, and where it is empty.
InputFile read_file(const std::string& path);

/// Throws InputError "name: place: message"; an empty place is left out.
[[noreturn]] void fail(const InputFile& file, const std::string& place, const std::string& message);

/// "byte 120": a place for fail().
std::string byte_place(std::size_t offset);

/// Text for a message: in quotes, at most 40 characters, unprintable ones as \xNN.
std::string in_quotes(std::string_view text);

/// A name in a file for a message: printable, at most 40 characters.
std::string shown(std::string_view name);

/// A number for a message, as short as %g has it.
std::string shown(double value);

std::string lower_case(std::string_view text);

inline bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace meniscus
