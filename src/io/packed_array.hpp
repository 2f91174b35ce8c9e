// The ways in which VTK's XML files keep the values of an array.
#pragma once

#include <bit>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "io/bytes.hpp"
#include "io/scalar.hpp"

namespace meniscus {

struct Packing {
  std::endian order = std::endian::little;
  bool wide = false;  // sizes are of 64 bits instead of 32
  bool zlib = false;  // values are in blocks packed by zlib
};

struct RawPlace {
  std::shared_ptr<const Bytes> bytes;
  std::uint64_t offset = 0, size = 0;  // of the values, bytes
};

/// Numbers in a text, in the machine's order. Throws InputError.
std::shared_ptr<const Bytes> numbers_of(const Bytes& file, std::string_view text, Scalar type,
                                        const std::string& place);

/// Values in base64 within the file's text.
std::shared_ptr<const Bytes> unpacked_inline(const std::shared_ptr<const Bytes>& file,
                                             std::string_view text, const Packing& packing,
                                             const std::string& place);

/// Values in base64 from a byte of the file on, of which `least` bytes are wanted.
std::shared_ptr<const Bytes> unpacked_base64(const std::shared_ptr<const Bytes>& file,
                                             std::uint64_t at, const Packing& packing,
                                             std::uint64_t least, const std::string& place);

/// Values from a byte of the file on; what is packed is unpacked block by block when it is read.
RawPlace unpacked_raw(const std::shared_ptr<const Bytes>& file, std::uint64_t at,
                      const Packing& packing, const std::string& place);

}  // namespace meniscus
