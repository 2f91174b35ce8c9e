#include "io/packed_array.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>
#include <vector>

#include "io/array_bag.hpp"
#include "io/text_cursor.hpp"

namespace meniscus {
namespace {

// Blocks of zlib, each of the same size but for the last.
class ZlibBlocks : public Bytes {
 public:
  ZlibBlocks(std::shared_ptr<const Bytes> packed, std::string place, std::uint64_t block,
             std::uint64_t size, std::vector<std::uint64_t> starts)
      : packed_(std::move(packed)),
        place_(std::move(place)),
        block_(block),
        size_(size),
        starts_(std::move(starts)) {}
  std::uint64_t size() const override { return size_; }
  std::uint64_t block() const override { return block_; }
  const std::string& name() const override { return packed_->name(); }
  void read(std::uint64_t at, char* to, std::size_t size) const override {
    if (at > size_ || size > size_ - at) fail(*this, place_, "ends here (truncated?)");
    std::string whole;  // a block of which a part is wanted
    while (size > 0) {
      const std::uint64_t k = at / block_, from = at % block_;
      const std::uint64_t unpacked = std::min(block_, size_ - k * block_);
      const std::size_t now =
          static_cast<std::size_t>(std::min<std::uint64_t>(unpacked - from, size));
      const std::string packed =
          text_at(*packed_, starts_[k], static_cast<std::size_t>(starts_[k + 1] - starts_[k]));
      if (from == 0 && now == unpacked) {
        inflate_to(packed, false, to, now, *this, place_);
      } else {
        whole.resize(static_cast<std::size_t>(unpacked));
        inflate_to(packed, false, whole.data(), whole.size(), *this, place_);
        std::memcpy(to, whole.data() + from, now);
      }
      to += now;
      at += now;
      size -= now;
    }
  }

 private:
  std::shared_ptr<const Bytes> packed_;
  std::string place_;
  std::uint64_t block_, size_;
  std::vector<std::uint64_t> starts_;  // of each block and behind the last
};

std::uint64_t number_at(const Bytes& bytes, std::uint64_t at, const Packing& packing) {
  const std::string text = text_at(bytes, at, packing.wide ? 8 : 4);
  return packing.wide ? load<std::uint64_t>(text.data(), packing.order)
                      : load<std::uint32_t>(text.data(), packing.order);
}

int digit_of(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  return c == '+' ? 62 : c == '/' ? 63 : c == '=' ? 64 : -1;
}

// Decodes groups of four digits, each to three bytes, or fewer where it is filled up with =. Such
// groups may come in the middle: a header that was encoded on its own. Stops at `<` and at what is
// no digit, and when it has `most` bytes.
std::string decoded(const Bytes& file, std::string_view text, std::uint64_t most,
                    const std::string& place, std::size_t* used = nullptr) {
  std::string bytes;
  bytes.reserve(static_cast<std::size_t>(std::min<std::uint64_t>(most, text.size() / 4 * 3 + 3)));
  std::array<int, 4> group{};
  std::size_t n = 0, at = 0;
  for (; at < text.size() && bytes.size() < most; ++at) {
    const char c = text[at];
    if (c == ' ' || c == '\n' || c == '\r' || c == '\t') continue;
    const int digit = digit_of(c);
    if (digit < 0) {
      if (c == '<') break;
      fail(file, place, "found " + in_quotes(text.substr(at, 1)) + " among base64 digits");
    }
    group[n++] = digit;
    if (n < 4) continue;
    n = 0;
    const int pad = (group[3] == 64) + (group[2] == 64);
    if (group[0] == 64 || group[1] == 64 || (group[2] == 64 && group[3] != 64))
      fail(file, place, "has = where base64 has none");
    const unsigned bits =
        static_cast<unsigned>(group[0]) << 18 | static_cast<unsigned>(group[1]) << 12 |
        static_cast<unsigned>(group[2] & 63) << 6 | static_cast<unsigned>(group[3] & 63);
    bytes += static_cast<char>(bits >> 16);
    if (pad < 2) bytes += static_cast<char>(bits >> 8 & 0xff);
    if (pad < 1) bytes += static_cast<char>(bits & 0xff);
  }
  if (n != 0 && bytes.size() < most) fail(file, place, "its base64 digits end early (truncated?)");
  if (used) *used = at;
  return bytes;
}

// Where the values of unpacked or packed bytes with their header lie.
RawPlace values_at(const std::shared_ptr<const Bytes>& bytes, std::uint64_t at,
                   const Packing& packing, const Bytes& file, const std::string& place) {
  const std::uint64_t unit = packing.wide ? 8 : 4, first = number_at(*bytes, at, packing);
  if (!packing.zlib) {
    if (first > bytes->size() - (at + unit))
      fail(file, place,
           "states " + std::to_string(first) + " bytes, but there are " +
               std::to_string(bytes->size() - (at + unit)) + " (truncated?)");
    return {bytes, at + unit, first};
  }
  const std::uint64_t blocks = first;
  if (blocks == 0) return {bytes, at, 0};
  const std::uint64_t block = number_at(*bytes, at + unit, packing),
                      last = number_at(*bytes, at + 2 * unit, packing);
  if (blocks > (bytes->size() - at) / unit)
    fail(file, place, "states " + std::to_string(blocks) + " blocks, more than it can hold");
  std::uint64_t size = 0;
  if (block == 0 || last > block || __builtin_mul_overflow(blocks - (last > 0), block, &size) ||
      __builtin_add_overflow(size, last, &size))
    fail(file, place,
         "its blocks have " + std::to_string(block) + " bytes and the last " +
             std::to_string(last) + ", wanted 0 <= last <= others > 0");
  check_unpacked(file, size, place);
  std::vector<std::uint64_t> starts{at + (3 + blocks) * unit};
  for (std::uint64_t k = 0; k < blocks; ++k) {
    const std::uint64_t packed = number_at(*bytes, at + (3 + k) * unit, packing);
    if (starts.back() > bytes->size() || packed > bytes->size() - starts.back() ||
        !can_unpack_to(packed, std::min(block, size - k * block)))
      fail(file, place,
           "block " + std::to_string(k) + " of " + std::to_string(packed) +
               " bytes does not fit (truncated?)");
    starts.push_back(starts.back() + packed);
  }
  return {std::make_shared<ZlibBlocks>(bytes, place, block, size, std::move(starts)), 0, size};
}

// Values as bytes that begin with the first.
std::shared_ptr<const Bytes> alone(const RawPlace& values) {
  if (values.offset == 0 && values.bytes->size() == values.size) return values.bytes;
  return owned_bytes(values.bytes->name(),
                     text_at(*values.bytes, values.offset, static_cast<std::size_t>(values.size)));
}

}  // namespace

std::shared_ptr<const Bytes> numbers_of(const Bytes& file, std::string_view text, Scalar type,
                                        const std::string& place) {
  const InputFile whole{file.name(), std::string(text) + "\n"};
  TextCursor cursor(whole);
  std::string bytes;
  const auto put = [&](auto value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  for (std::string_view token; !(token = cursor.next_token()).empty();) {
    if (is_whole(type)) {
      const auto value = parse_integer(token);
      if (!value) fail(file, place, "found " + in_quotes(token) + ", wanted a whole number");
      const std::int64_t number = *value;
      bytes.append(reinterpret_cast<const char*>(&number), size_of(type));  // little endian
      if (load_integer(bytes.data() + bytes.size() - size_of(type), type, std::endian::native) !=
          number)
        fail(file, place, "found " + in_quotes(token) + ", which does not fit its type");
      continue;
    }
    const auto value = parse_real(token);
    if (!value) fail(file, place, "found " + in_quotes(token) + ", wanted a number");
    if (type == Scalar::float32)
      put(static_cast<float>(*value));
    else
      put(*value);
  }
  static_assert(std::endian::native == std::endian::little);
  return owned_bytes(file.name(), std::move(bytes));
}

std::shared_ptr<const Bytes> unpacked_inline(const std::shared_ptr<const Bytes>& file,
                                             std::string_view text, const Packing& packing,
                                             const std::string& place) {
  const auto bytes = owned_bytes(file->name(), decoded(*file, text, UINT64_MAX, place));
  return alone(values_at(bytes, 0, packing, *file, place));
}

std::shared_ptr<const Bytes> unpacked_base64(const std::shared_ptr<const Bytes>& file,
                                             std::uint64_t at, const Packing& packing,
                                             std::uint64_t least, const std::string& place) {
  if (at > file->size()) fail(*file, place, "begins behind the file's end (truncated?)");
  // As many digits as the header says: what follows is of other arrays.
  const auto digits = [&](std::uint64_t first, std::uint64_t bytes) {
    const std::uint64_t wanted = bytes / 3 * 4 + 8;
    return text_at(*file, first, static_cast<std::size_t>(std::min(wanted, file->size() - first)));
  };
  const std::uint64_t unit = packing.wide ? 8 : 4;
  if (!packing.zlib) {
    const auto head = owned_bytes(file->name(), decoded(*file, digits(at, unit), unit, place));
    const std::uint64_t size = number_at(*head, 0, packing);
    if (size > file->size() || size < least)
      fail(*file, place,
           "states " + std::to_string(size) + " bytes, wanted " + std::to_string(least) +
               " and no more than the file has");
    const auto bytes =
        owned_bytes(file->name(), decoded(*file, digits(at, size + unit + 3), size + unit, place));
    return alone(values_at(bytes, 0, packing, *file, place));
  }
  // The header's digits end with their own =, the blocks' follow.
  const auto first = owned_bytes(file->name(), decoded(*file, digits(at, unit), unit, place));
  const std::uint64_t blocks = number_at(*first, 0, packing);
  if (blocks > file->size() / unit) fail(*file, place, "states more blocks than it can hold");
  const std::uint64_t head_size = (3 + blocks) * unit;
  std::size_t used = 0;
  const std::string head = decoded(*file, digits(at, head_size), head_size, place, &used);
  std::uint64_t packed = 0;
  const auto head_bytes = owned_bytes(file->name(), head);
  for (std::uint64_t k = 0; k < blocks; ++k) {
    const std::uint64_t size = number_at(*head_bytes, (3 + k) * unit, packing);
    if (__builtin_add_overflow(packed, size, &packed) || packed > file->size())
      fail(*file, place, "states more packed bytes than the file has (truncated?)");
  }
  const auto bytes =
      owned_bytes(file->name(), head.substr(0, static_cast<std::size_t>(head_size)) +
                                    decoded(*file, digits(at + used, packed), packed, place));
  return alone(values_at(bytes, 0, packing, *file, place));
}

RawPlace unpacked_raw(const std::shared_ptr<const Bytes>& file, std::uint64_t at,
                      const Packing& packing, const std::string& place) {
  if (at > file->size() || file->size() - at < (packing.wide ? 8 : 4))
    fail(*file, place,
         "begins at byte " + std::to_string(at) + ", but the file has " +
             std::to_string(file->size()) + " (truncated?)");
  return values_at(file, at, packing, *file, place);
}

}  // namespace meniscus
