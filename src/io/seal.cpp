#include "io/seal.hpp"

#define XXH_INLINE_ALL
#include <xxhash.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <system_error>
#include <vector>

#include "base/content_hash.hpp"
#include "io/input_file.hpp"
#include "meniscus/error.hpp"

namespace meniscus {
namespace {

constexpr char kHash[] = "meniscus.hash", kJob[] = "meniscus.job";
constexpr std::size_t kDigits = sizeof kNoHash - 1;
constexpr std::size_t kHead = std::size_t{1} << 16, kChunk = std::size_t{1} << 20;  // bytes

std::string big_endian(std::uint32_t value) {
  return {static_cast<char>(value >> 24), static_cast<char>(value >> 16),
          static_cast<char>(value >> 8), static_cast<char>(value)};
}

std::string little_endian(std::uint32_t value) {
  std::string bytes = big_endian(value);
  std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

std::uint32_t checksum(const std::string& bytes) {
  return static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

std::string text_of_chunk(const char* key, const std::string& value) {
  return std::string("tEXt") + key + '\0' + value;
}

std::string text_chunk(const char* key, const std::string& value) {
  const std::string text = text_of_chunk(key, value);
  return big_endian(static_cast<std::uint32_t>(text.size() - 4)) + text +
         big_endian(checksum(text));
}

std::optional<OutputFormat> format_of(const std::string& path) {
  const std::string ending = lower_case(std::filesystem::path(path).extension().string());
  if (ending == ".exr") return OutputFormat::exr;
  if (ending == ".ply") return OutputFormat::ply;
  if (ending == ".obj") return OutputFormat::obj;
  if (ending == ".vtp") return OutputFormat::vtp;
  if (ending == ".glb") return OutputFormat::glb;
  if (ending == ".stl") return OutputFormat::stl;
  if (ending == ".png") return OutputFormat::png;
  return std::nullopt;
}

// All bytes that state `value`, from the key on.
std::string statement(OutputFormat format, const char* key, const std::string& value) {
  switch (format) {
    case OutputFormat::exr:
      return key + std::string("\0string\0", 8) +
             little_endian(static_cast<std::uint32_t>(value.size())) + value;
    case OutputFormat::ply:
      return std::string("comment ") + key + ' ' + value + '\n';
    case OutputFormat::obj:
      return std::string("# ") + key + ' ' + value + '\n';
    case OutputFormat::vtp:
      return std::string("<!-- ") + key + ' ' + value + " -->";
    case OutputFormat::glb:
      return std::string("\"") + key + "\":\"" + value + '"';
    case OutputFormat::stl:
      return std::string(key) + ' ' +
             (std::string_view(key) == kJob ? hex_digits(content_hash(value)) : value) + ' ';
    case OutputFormat::png:
      return text_chunk(key, value);
  }
  throw InvalidArgument("seal: unknown format");
}

// Reads the next `size` bytes of a file; fewer at its end.
using Read = std::function<std::size_t(char* bytes, std::size_t size)>;

// Where in a file its hash is, and what it must be.
struct Seal {
  std::string head;             // the file's first bytes
  std::size_t at = 0, end = 0;  // of the bytes that follow from the hash
  std::string wanted;           // these bytes
  bool found = false;
  bool matches() const { return found && head.compare(at, end - at, wanted) == 0; }
};

Seal seal_of(OutputFormat format, const Read& read) {
  Seal seal;
  seal.head.resize(kHead);
  seal.head.resize(read(seal.head.data(), kHead));
  // Behind the digits: the line's end in PLY and OBJ, a quote in GLB, the checksum in PNG.
  const std::size_t after = format == OutputFormat::png   ? 4
                            : format == OutputFormat::vtp ? 4
                            : format == OutputFormat::exr ? 0
                                                          : 1;
  const std::string empty = statement(format, kHash, kNoHash);
  const std::string mark = empty.substr(0, empty.size() - after - kDigits);
  const std::size_t found = seal.head.find(mark);
  if (found == std::string::npos || found + empty.size() > seal.head.size()) return seal;
  seal.found = true;
  seal.at = found + mark.size();
  seal.end = seal.at + kDigits + (format == OutputFormat::png ? after : 0);

  XXH3_state_t state;
  XXH3_64bits_reset(&state);
  XXH3_64bits_update(&state, seal.head.data(), seal.at);
  XXH3_64bits_update(&state, seal.head.data() + seal.end, seal.head.size() - seal.end);
  std::vector<char> bytes(kChunk);
  while (const std::size_t count = read(bytes.data(), bytes.size()))
    XXH3_64bits_update(&state, bytes.data(), count);
  const std::string full = statement(format, kHash, hex_digits(XXH3_64bits_digest(&state)));
  seal.wanted = full.substr(mark.size(), seal.end - seal.at);
  return seal;
}

}  // namespace

void check_job(const std::string& job) {
  const auto good = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '.' ||
           c == '-';
  };
  require(job.size() <= 64 && std::all_of(job.begin(), job.end(), good),
          "a job is " + in_quotes(job) + ", wanted at most 64 letters, digits, dots and dashes");
}

std::string seal_lines(const std::string& mark, const std::string& job) {
  check_job(job);
  return (job.empty() ? "" : mark + kJob + ' ' + job + '\n') + mark + kHash + ' ' + kNoHash + '\n';
}

std::string seal_chunks(const std::string& job) {
  check_job(job);
  return (job.empty() ? "" : text_chunk(kJob, job)) + text_chunk(kHash, kNoHash);
}

std::string stl_head(const std::string& job) {
  check_job(job);
  constexpr std::size_t kSize = 80;
  std::string head = statement(OutputFormat::stl, kHash, kNoHash);
  if (!job.empty()) head += statement(OutputFormat::stl, kJob, job);
  head.resize(kSize, ' ');
  return head;
}

void seal(OutputFile& file, OutputFormat format) {
  std::uint64_t position = 0;
  const Seal seal = seal_of(format, [&](char* bytes, std::size_t size) {
    const std::size_t count = file.read(position, bytes, size);
    position += count;
    return count;
  });
  require(seal.found, "seal: " + file.path() + " has no place for its hash");
  file.seek(seal.at);
  file.write(seal.wanted);
}

std::string flaw_of(const std::string& path, const std::string& job) {
  const std::optional<OutputFormat> format = format_of(path);
  if (!format) return "has an ending that no output has";
  std::error_code error;
  const auto type = std::filesystem::status(path, error).type();
  if (type == std::filesystem::file_type::not_found) return "is missing";
  if (type != std::filesystem::file_type::none && type != std::filesystem::file_type::regular)
    return "is not a regular file";
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                             &std::fclose);
  if (!file) return "cannot be opened: " + std::generic_category().message(errno);
  const Seal seal = seal_of(*format, [&](char* bytes, std::size_t size) {
    return std::fread(bytes, 1, size, file.get());
  });
  if (std::ferror(file.get())) return "cannot be read: " + std::generic_category().message(errno);
  if (seal.head.empty()) return "is empty";
  if (!seal.found) return "has no hash: another program wrote it, or it is cut off";
  if (!seal.matches()) return "is cut off or damaged: its bytes do not match its hash";
  if (!job.empty() && seal.head.find(statement(*format, kJob, job)) == std::string::npos)
    return "was made from another input or with other settings";
  return "";
}

std::string stated_job(const std::string& path, std::size_t length) {
  const std::optional<OutputFormat> format = format_of(path);
  if (!format || *format == OutputFormat::stl) return "";
  std::string head(kHead, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(kHead));
  const std::string any(length, '0');
  const std::string whole = statement(*format, kJob, any);
  const std::string mark = whole.substr(0, whole.find(any));
  const std::size_t found = head.find(mark);
  return found == std::string::npos ? "" : head.substr(found + mark.size(), length);
}

}  // namespace meniscus
