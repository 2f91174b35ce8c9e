// The container of .bgeo.sc: "scf1", a length, so many bytes about the file, blocks, an index, its
// length, "1fcs". Each block is blosc's, whose head of 16 bytes states its sizes, so that the
// blocks are followed without the index.
#include <blosc.h>

#include <bit>

#include "io/array_bag.hpp"
#include "io/bgeo_json.hpp"
#include "io/bytes.hpp"
#include "io/scalar.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kHead = BLOSC_MIN_HEADER_LENGTH;

struct Block {
  std::size_t packed = 0, unpacked = 0;  // bytes
};

// The block at a place, of no size where there is none.
Block block_at(const std::string& bytes, std::size_t at) {
  Block block;
  if (at > bytes.size() || bytes.size() - at < kHead) return block;
  const unsigned char version = static_cast<unsigned char>(bytes[at]);
  const auto packed = load<std::uint32_t>(&bytes[at + 12], std::endian::little);
  std::size_t unpacked = 0;
  if (version != BLOSC_VERSION_FORMAT || packed < kHead || packed > bytes.size() - at ||
      blosc_cbuffer_validate(&bytes[at], packed, &unpacked) != 0)
    return block;
  return {packed, unpacked};
}

}  // namespace

InputFile unpacked_sc(const InputFile& file) {
  const std::string& bytes = file.bytes;
  if (!bytes.starts_with("scf1"))
    fail(file, "byte 0", "found " + in_quotes(bytes.substr(0, 4)) + ", wanted \"scf1\" (.bgeo.sc)");
  // The length has 8 or 4 bytes of either order: the one behind which a block follows.
  std::size_t at = 0;
  Block block;
  for (const auto& [size, order] : {std::pair{8, std::endian::big},
                                    {8, std::endian::little},
                                    {4, std::endian::big},
                                    {4, std::endian::little}}) {
    if (bytes.size() < 4 + static_cast<std::size_t>(size)) continue;
    const std::uint64_t length =
        size == 8 ? load<std::uint64_t>(&bytes[4], order) : load<std::uint32_t>(&bytes[4], order);
    if (length > bytes.size()) continue;
    at = 4 + static_cast<std::size_t>(size) + static_cast<std::size_t>(length);
    block = block_at(bytes, at);
    if (block.packed > 0) break;
  }
  if (block.packed == 0) fail(file, "", "holds no block of blosc's (truncated?)");
  const auto whole = memory_bytes(file);
  InputFile result{file.name, {}};
  for (; block.packed > 0; block = block_at(bytes, at)) {
    check_unpacked(*whole, result.bytes.size() + block.unpacked, "");
    const std::size_t before = result.bytes.size();
    result.bytes.resize(before + block.unpacked);
    if (block.unpacked > 0 &&
        blosc_decompress_ctx(&bytes[at], &result.bytes[before], block.unpacked, 1) !=
            static_cast<int>(block.unpacked))
      fail(file, byte_place(at), "its block cannot be unpacked (damaged?)");
    at += block.packed;
  }
  if (bytes.size() - at < 4 || !bytes.ends_with("1fcs"))
    fail(file, byte_place(at), "has neither a block nor an end here (truncated?)");
  return result;
}

}  // namespace meniscus
