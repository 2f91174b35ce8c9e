#include "io/input_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <system_error>

#include "base/printable.hpp"

namespace meniscus {

namespace {

constexpr std::size_t kLongest = 40;  // of a text in a message, characters

}  // namespace

OpenFile open_input(const std::string& path) {
  const InputFile named{path, {}};
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (is_directory(status)) fail(named, "", "is a directory, wanted a file");
  if (is_other(status)) fail(named, "", "is a pipe or a device, wanted a file");
  OpenFile file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (file) return file;
  const int why = errno;
  const std::string text = path + ": cannot be opened: " + std::generic_category().message(why);
  if (why != ENOENT) throw InputError(text);
  throw InputError(Notice{.code = Code::missing_file, .text = text, .subject = path});
}

InputFile read_file(const std::string& path) {
  InputFile file{path, {}};
  const OpenFile stream = open_input(path);
  std::error_code error;
  const auto stated = std::filesystem::file_size(path, error);
  constexpr std::size_t kChunk = 1 << 20;
  std::size_t length = 0;
  // One byte more than the file is stated to have, so that the first read already meets its end.
  file.bytes.resize(error ? kChunk : static_cast<std::size_t>(stated) + 1);
  for (;;) {
    length += std::fread(file.bytes.data() + length, 1, file.bytes.size() - length, stream.get());
    if (length < file.bytes.size()) break;
    file.bytes.resize(file.bytes.size() + std::max(kChunk, length / 2));
  }
  if (std::ferror(stream.get()))
    fail(file, byte_place(length), "cannot be read: " + std::generic_category().message(errno));
  if (length == 0) fail(file, "", "is empty (0 bytes)");
  file.bytes.resize(length);
  return file;
}

void fail(const InputFile& file, const std::string& place, const std::string& message) {
  throw InputError(file.name + ": " + (place.empty() ? "" : place + ": ") + message);
}

std::string byte_place(std::size_t offset) { return "byte " + std::to_string(offset); }

std::string in_quotes(std::string_view text) {
  std::string result = "\"";
  for (const char c : text.substr(0, kLongest)) {
    if (c >= ' ' && c <= '~') {
      result += c;
    } else {
      char escaped[8];
      std::snprintf(escaped, sizeof escaped, "\\x%02x", static_cast<unsigned char>(c));
      result += escaped;
    }
  }
  return result + (text.size() > kLongest ? "...\"" : "\"");
}

std::string shown(std::string_view name) { return printable(name, kLongest); }

std::string shown(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

std::string lower_case(std::string_view text) {
  std::string result(text);
  for (char& c : result)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return result;
}

}  // namespace meniscus
