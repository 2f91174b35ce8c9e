// Bytes that are read from any place: of a file on disk, of a file in memory, or of what such bytes
// unpack to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "io/input_file.hpp"

namespace meniscus {

class Bytes {
 public:
  Bytes() = default;
  Bytes(const Bytes&) = delete;
  Bytes& operator=(const Bytes&) = delete;
  virtual ~Bytes() = default;

  virtual std::uint64_t size() const = 0;
  /// Copies `size` bytes from `at` on; several threads may do so at once. Throws InputError where
  /// there are not so many.
  virtual void read(std::uint64_t at, char* to, std::size_t size) const = 0;
  /// How many bytes, counted from the first on, are unpacked together: who reads a part of them has
  /// all of these unpacked. 1 where nothing is packed.
  virtual std::uint64_t block() const { return 1; }
  /// All of them where they are in memory anyway, else null.
  virtual const char* in_memory() const { return nullptr; }
  /// What an error in them is named after.
  virtual const std::string& name() const = 0;
};

/// Of a file, which is opened here and closed with the last owner. Throws InputError as read_file.
std::shared_ptr<const Bytes> bytes_of_file(const std::string& path);

/// Of a file in memory, which must outlive the result.
std::shared_ptr<const Bytes> memory_bytes(const InputFile& file);

/// Of a text of its own that goes by the name of a file.
std::shared_ptr<const Bytes> owned_bytes(std::string name, std::string bytes);

/// `size` bytes from `at` on as a text. Throws InputError where there are not so many.
std::string text_at(const Bytes& bytes, std::uint64_t at, std::size_t size);

/// Throws InputError "name: place: message".
[[noreturn]] void fail(const Bytes& bytes, const std::string& place, const std::string& message);

/// Unpacks a zlib stream, or with `raw` one without its head, which must give `unpacked` bytes.
/// Throws InputError where it is damaged or gives another number.
void inflate_to(const std::string& packed, bool raw, char* to, std::size_t unpacked,
                const Bytes& of, const std::string& place);

/// The first bytes that a zlib stream without its head gives, `most` of them where it has so many.
std::string inflated_start(const std::string& packed, std::size_t most, const Bytes& of,
                           const std::string& place);

/// Whether `unpacked` bytes can come from `packed` ones of zlib's: a byte gives 1,032 at most.
/// Asked before memory is taken for them.
bool can_unpack_to(std::uint64_t packed, std::uint64_t unpacked);

}  // namespace meniscus
