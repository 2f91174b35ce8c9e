// NumPy's arrays: .npy, and .npz, a zip archive of them. Written from NumPy's description of its
// format (NEP 1) and PKWARE's of zip archives (APPNOTE).
#include <zlib.h>

#include <algorithm>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "io/array_bag.hpp"
#include "io/readers.hpp"
#include "io/text_cursor.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kMostHeader = std::size_t{1} << 20;  // bytes

// The literals of Python that a header is made of.
class Header {
 public:
  Header(const Bytes& file, std::string place, std::string text)
      : file_(file), place_(std::move(place)), text_(std::move(text)) {}

  struct Field {
    std::string name;
    std::string type;
    std::vector<std::uint64_t> shape;
  };
  std::vector<Field> fields;  // one without a name, or those of a structure
  bool fortran = false;
  std::vector<std::uint64_t> shape;

  void read() {
    take('{');
    while (!is_next('}')) {
      const std::string key = string();
      take(':');
      if (key == "descr")
        read_types();
      else if (key == "fortran_order")
        fortran = word() == "True";
      else if (key == "shape")
        shape = tuple();
      else
        fail_here("found key " + in_quotes(key));
      if (!is_next('}')) take(',');
    }
    if (fields.empty()) fail_here("has no descr");
  }

 private:
  void read_types() {
    if (is_next('[')) {
      take('[');
      while (!is_next(']')) {
        constexpr std::size_t kMost = 1000;
        if (fields.size() == kMost) fail_here("has too many fields");
        take('(');
        Field field;
        field.name = string();
        take(',');
        field.type = string();
        if (is_next(',')) {
          take(',');
          if (is_next('(')) field.shape = tuple();
        }
        take(')');
        fields.push_back(std::move(field));
        if (!is_next(']')) take(',');
      }
      take(']');
    } else {
      fields.push_back({"", string(), {}});
    }
  }
  std::vector<std::uint64_t> tuple() {
    std::vector<std::uint64_t> numbers;
    take('(');
    while (!is_next(')')) {
      std::string digits = word();
      if (digits.ends_with('L')) digits.pop_back();  // Python 2's
      const auto number = parse_integer(digits);
      if (!number || *number < 0) fail_here("found " + in_quotes(digits) + ", wanted a length");
      constexpr std::size_t kMost = 32;
      if (numbers.size() == kMost) fail_here("has too many dimensions");
      numbers.push_back(static_cast<std::uint64_t>(*number));
      if (!is_next(')')) take(',');
    }
    take(')');
    return numbers;
  }
  std::string string() {
    if (!is_next('\'') && !is_next('"')) fail_here("found no name in quotes");
    const char quote = text_[at_++];
    const std::size_t end = text_.find(quote, at_);
    if (end == std::string::npos) fail_here("ends inside a name");
    const std::string result = text_.substr(at_, end - at_);
    at_ = end + 1;
    return result;
  }
  std::string word() {
    skip_blanks();
    const std::size_t first = at_;
    while (at_ < text_.size() && std::isalnum(static_cast<unsigned char>(text_[at_]))) ++at_;
    return text_.substr(first, at_ - first);
  }
  void skip_blanks() {
    while (at_ < text_.size() && std::string_view(" \t\r\n").find(text_[at_]) != std::string::npos)
      ++at_;
  }
  bool is_next(char c) {
    skip_blanks();
    return at_ < text_.size() && text_[at_] == c;
  }
  void take(char c) {
    if (!is_next(c))
      fail_here(std::string("found no ") + c + " at its character " + std::to_string(at_));
    ++at_;
  }
  [[noreturn]] void fail_here(const std::string& message) const {
    fail(file_, place_ + "header", message + ", wanted what numpy.save writes");
  }
  const Bytes& file_;
  std::string place_, text_;
  std::size_t at_ = 0;
};

struct NpyType {
  std::optional<Scalar> scalar;  // none: a type that is not read, such as text
  std::endian order = std::endian::little;
  std::size_t size = 0;
};

constexpr std::pair<const char*, Scalar> kNpyTypes[] = {
    {"i1", Scalar::int8},   {"u1", Scalar::uint8},   {"b1", Scalar::uint8},  {"i2", Scalar::int16},
    {"u2", Scalar::uint16}, {"i4", Scalar::int32},   {"u4", Scalar::uint32}, {"i8", Scalar::int64},
    {"u8", Scalar::uint64}, {"f4", Scalar::float32}, {"f8", Scalar::float64}};

NpyType type_named(const Bytes& file, const std::string& place, const std::string& name) {
  NpyType type;
  if (name.empty()) fail(file, place + "header", "has an array without a type");
  if (name[0] == '>') type.order = std::endian::big;
  const bool marked = std::string_view("<>|=").find(name[0]) != std::string_view::npos;
  const std::string bare = name.substr(marked ? 1 : 0);
  type.scalar = scalar_named(kNpyTypes, bare);
  if (type.scalar) {
    type.size = size_of(*type.scalar);
    return type;
  }
  const std::string after = bare.substr(std::min<std::size_t>(1, bare.size()));
  const auto size = parse_integer(after.substr(0, after.find('[')));  // M8[us] has 8 bytes
  constexpr std::int64_t kMost = 1 << 20;
  if (!size || *size < 0 || *size > kMost)
    fail(file, place + "header", "found type " + in_quotes(name) + ", wanted numbers");
  type.size = static_cast<std::size_t>(*size) * (bare[0] == 'U' ? 4 : 1);
  return type;
}

// The header of a .npy, and where its values begin.
std::pair<Header, std::uint64_t> read_npy_header(const Bytes& file, const std::string& place,
                                                 const Bytes& bytes) {
  const std::string head = text_at(bytes, 0, 8);
  if (!head.starts_with("\x93NUMPY"))
    fail(file, place + byte_place(0),
         "found " + in_quotes(head.substr(0, 6)) + ", wanted NumPy's array");
  const bool wide = static_cast<unsigned char>(head[6]) >= 2;
  const std::string length = text_at(bytes, 8, wide ? 4 : 2);
  const std::size_t size = wide ? load<std::uint32_t>(length.data(), std::endian::little)
                                : load<std::uint16_t>(length.data(), std::endian::little);
  if (size > kMostHeader) fail(file, place + "header", "is too long");
  Header header(file, place, text_at(bytes, 8 + length.size(), size));
  header.read();
  return {std::move(header), 8 + length.size() + size};
}

std::uint64_t npy_product(const Bytes& file, const std::string& place, std::uint64_t a,
                          std::uint64_t b) {
  std::uint64_t product = 0;
  if (__builtin_mul_overflow(a, b, &product))
    fail(file, place + "header", "its shape is too large");
  return product;
}

// The fields of a structure, one behind the other in a row of values; or a field without a name.
struct NpyRow {
  struct Placed {
    Header::Field field;
    NpyType type;
    std::uint64_t offset = 0, components = 1;
  };
  std::vector<Placed> fields;
  std::uint64_t bytes = 0;
};

// None of Python objects that have no use. `name`: of the values.
std::optional<NpyRow> npy_row(const Bytes& file, const std::string& place, const std::string& name,
                              const Header& header) {
  NpyRow row;
  for (const Header::Field& field : header.fields) {
    if (field.type.find('O') != std::string::npos) {  // Python objects are pickled, all in one
      if (!has_use(name)) return std::nullopt;
      fail(file, place + "header",
           "holds Python objects (pickled), wanted numbers (save the arrays themselves)");
    }
    NpyRow::Placed one{field, type_named(file, place, field.type), row.bytes, 1};
    for (const std::uint64_t length : field.shape)
      one.components = npy_product(file, place, one.components, length);
    row.bytes += npy_product(file, place, one.components, one.type.size);
    if (row.bytes > kMostHeader) fail(file, place + "header", "its rows are too long");
    row.fields.push_back(one);
  }
  return row;
}

// The arrays of a .npy: one, or the fields of a structure. `item`: what it is called; empty in a
// file of its own. What cannot be read and has no use is left out.
void add_arrays(const Bytes& file, const std::shared_ptr<const Bytes>& bytes,
                const std::string& item, std::vector<BagArray>& arrays) {
  const std::string place = item.empty() ? "" : shown(item) + ": ";
  const auto [header, data] = read_npy_header(file, place, *bytes);
  if (header.shape.empty()) return;  // a single number
  const std::uint64_t rows = header.shape[0];
  std::uint64_t across = 1;
  for (std::size_t k = 1; k < header.shape.size(); ++k)
    across = npy_product(file, place, across, header.shape[k]);
  const bool single = header.fields.size() == 1 && header.fields[0].name.empty();
  const std::string name = item.empty() ? "positions" : item;
  if (single) refuse_shape(file, place + "header", name, header.shape);
  const std::optional<NpyRow> row = npy_row(file, place, name, header);
  if (!row) return;
  for (const NpyRow::Placed& one : row->fields) {
    if (!one.type.scalar && has_use(single ? name : one.field.name))
      fail(file, place + "header",
           "has type " + in_quotes(one.field.type) + " for " +
               (single ? "its values" : shown(one.field.name)) +
               ", wanted numbers of 32 or 64 bits");
    if (!one.type.scalar || one.components == 0 || across == 0) continue;
    DataArray array{single ? item : one.field.name,
                    static_cast<std::size_t>(one.components),
                    *one.type.scalar,
                    one.type.order,
                    bytes,
                    data + one.offset,
                    row->bytes,
                    one.type.size};
    if (single) {
      if (across > kMostHeader) {
        if (!has_use(name)) continue;
        fail(file, place + "header", "its rows are too long");
      }
      array.components = static_cast<std::size_t>(across);
      array.stride = header.fortran && header.shape.size() > 1
                         ? row->bytes
                         : npy_product(file, place, across, row->bytes);
      array.component_stride =
          header.fortran ? npy_product(file, place, rows, row->bytes) : row->bytes;
    } else if (across != 1) {
      continue;
    }
    arrays.push_back({std::move(array), rows});
  }
}

constexpr std::size_t kStart = 4096;  // bytes of a member: more than headers have

[[noreturn]] void fail_sum(const Bytes& archive, const std::string& place) {
  fail(archive, place, "its bytes do not match their checksum (damaged?)");
}

// A member of an archive that is not packed. Its checksum is looked at when more than the header is
// asked for.
class Stored : public Bytes {
 public:
  Stored(std::shared_ptr<const Bytes> archive, std::string place, std::uint64_t at,
         std::uint64_t size, std::uint32_t sum)
      : archive_(std::move(archive)), place_(std::move(place)), at_(at), size_(size), sum_(sum) {}
  std::uint64_t size() const override { return size_; }
  const std::string& name() const override { return archive_->name(); }
  const char* in_memory() const override {
    const char* const all = archive_->in_memory();
    if (!all) return nullptr;
    check();
    return all + at_;
  }
  void read(std::uint64_t at, char* to, std::size_t size) const override {
    if (at > size_ || size > size_ - at) fail(*archive_, place_, "ends early (truncated?)");
    if (size_ <= kStart || at + size > kStart) check();
    archive_->read(at_ + at, to, size);
  }

 private:
  void check() const {
    std::call_once(once_, [&] {
      constexpr std::uint64_t kBlock = 1 << 18;
      uLong sum = 0;
      for (std::uint64_t done = 0; done < size_; done += kBlock) {
        const std::string block = text_at(*archive_, at_ + done,
                                          static_cast<std::size_t>(std::min(kBlock, size_ - done)));
        sum = crc32_z(sum, reinterpret_cast<const Bytef*>(block.data()), block.size());
      }
      if (sum != sum_) fail_sum(*archive_, place_);
    });
  }
  std::shared_ptr<const Bytes> archive_;
  std::string place_;
  std::uint64_t at_, size_;
  std::uint32_t sum_;  // CRC-32
  mutable std::once_flag once_;
};

// What a deflated member of an archive unpacks to: its beginning at first, for its header, and all
// of it when that is asked for.
class Deflated : public Bytes {
 public:
  Deflated(std::shared_ptr<const Bytes> archive, std::string place, std::uint64_t at,
           std::uint64_t packed, std::uint64_t size, std::uint32_t sum)
      : archive_(std::move(archive)),
        place_(std::move(place)),
        at_(at),
        packed_(packed),
        size_(size),
        sum_(sum) {
    if (!can_unpack_to(packed, size))
      fail(*archive_, place_, "states more bytes than its packed ones can become (damaged?)");
    check_unpacked(*archive_, size, place_);
    const std::size_t most = static_cast<std::size_t>(std::min<std::uint64_t>(size, kStart));
    const std::size_t some = static_cast<std::size_t>(std::min<std::uint64_t>(packed, 2 * kStart));
    start_ = inflated_start(text_at(*archive_, at_, some), most, *archive_, place_);
  }
  std::uint64_t size() const override { return size_; }
  const std::string& name() const override { return archive_->name(); }
  const char* in_memory() const override {
    std::call_once(once_, [&] {
      bytes_.resize(static_cast<std::size_t>(size_));
      inflate_to(text_at(*archive_, at_, static_cast<std::size_t>(packed_)), true, bytes_.data(),
                 bytes_.size(), *archive_, place_);
      const std::uint32_t sum = static_cast<std::uint32_t>(
          crc32_z(0, reinterpret_cast<const Bytef*>(bytes_.data()), bytes_.size()));
      if (sum != sum_) fail_sum(*archive_, place_);
    });
    return bytes_.data();
  }
  void read(std::uint64_t at, char* to, std::size_t size) const override {
    if (at > size_ || size > size_ - at) fail(*archive_, place_, "ends early (truncated?)");
    const bool early = at + size <= start_.size();
    std::copy_n((early ? start_.data() : in_memory()) + at, size, to);
  }

 private:
  std::shared_ptr<const Bytes> archive_;
  std::string place_, start_;
  std::uint64_t at_, packed_, size_;
  std::uint32_t sum_;  // CRC-32 of what it unpacks to
  mutable std::once_flag once_;
  mutable std::string bytes_;
};

struct Member {
  std::string name;
  std::uint64_t at = 0, packed = 0, size = 0;  // of its data, bytes
  unsigned method = 0;
  std::uint32_t sum = 0;  // CRC-32
};

std::uint16_t u16(const std::string& text, std::size_t at) {
  return load<std::uint16_t>(text.data() + at, std::endian::little);
}
std::uint32_t u32(const std::string& text, std::size_t at) {
  return load<std::uint32_t>(text.data() + at, std::endian::little);
}
std::uint64_t u64(const std::string& text, std::size_t at) {
  return load<std::uint64_t>(text.data() + at, std::endian::little);
}

// Of a zip archive: how many members it lists, and where.
struct Directory {
  std::uint64_t count = 0, at = 0;
  std::string bytes;
};

constexpr std::size_t kEntry = 46;  // bytes of a member in it, without names

Directory directory_of(const Bytes& file) {
  constexpr std::uint64_t kEnd = 22, kMostComment = 0xffff;
  const std::uint64_t tail_size = std::min(file.size(), kEnd + kMostComment);
  const std::string tail =
      text_at(file, file.size() - tail_size, static_cast<std::size_t>(tail_size));
  const std::size_t end = tail.rfind("PK\x05\x06");
  if (end == std::string::npos || tail.size() - end < kEnd)
    fail(file, "", "has no end of a zip archive, wanted what numpy.savez writes (truncated?)");
  Directory directory{u16(tail, end + 10), u32(tail, end + 16), ""};
  std::uint64_t size = u32(tail, end + 12);
  constexpr std::size_t kLocator = 20;
  if (end >= kLocator && tail.compare(end - kLocator, 4, "PK\x06\x07") == 0) {
    const std::string wide = text_at(file, u64(tail, end - kLocator + 8), 56);
    if (!wide.starts_with("PK\x06\x06")) fail(file, "", "its zip64 end is damaged");
    directory.count = u64(wide, 32);
    directory.at = u64(wide, 48);
    size = u64(wide, 40);
  }
  if (size > file.size() || directory.count > size / kEntry)
    fail(file, "", "states more members than its directory can hold (damaged?)");
  directory.bytes = text_at(file, directory.at, static_cast<std::size_t>(size));
  return directory;
}

// zip64: what did not fit into a member's entry stands in its extra fields, in this order.
void take_large(const std::string& entries, std::size_t at, std::size_t size, Member& member,
                std::uint64_t& local) {
  for (const std::size_t last = at + size; at + 4 <= last;) {
    const std::size_t length = u16(entries, at + 2);
    if (length > last - at - 4) return;
    if (u16(entries, at) == 1) {
      std::size_t q = at + 4;
      for (std::uint64_t* value : {&member.size, &member.packed, &local})
        if (*value == 0xffffffff && q + 8 <= at + 4 + length) {
          *value = u64(entries, q);
          q += 8;
        }
    }
    at += 4 + length;
  }
}

std::vector<Member> members_of(const Bytes& file) {
  const Directory directory = directory_of(file);
  const std::string& entries = directory.bytes;
  std::vector<Member> members;
  for (std::size_t p = 0; members.size() < directory.count;) {
    const std::string place = byte_place(static_cast<std::size_t>(directory.at) + p);
    if (entries.size() - p < kEntry || entries.compare(p, 4, "PK\x01\x02") != 0)
      fail(file, place, "its zip directory is damaged");
    Member member;
    member.method = u16(entries, p + 10);
    member.sum = u32(entries, p + 16);
    member.packed = u32(entries, p + 20);
    member.size = u32(entries, p + 24);
    const std::size_t name = u16(entries, p + 28), extra = u16(entries, p + 30),
                      comment = u16(entries, p + 32);
    std::uint64_t local = u32(entries, p + 42);
    if (entries.size() - p - kEntry < name + extra + comment)
      fail(file, place, "its zip directory is cut off");
    member.name = entries.substr(p + kEntry, name);
    take_large(entries, p + kEntry + name, extra, member, local);
    p += kEntry + name + extra + comment;
    const std::string head = text_at(file, local, 30);
    if (!head.starts_with("PK\x03\x04"))
      fail(file, byte_place(static_cast<std::size_t>(local)), "wanted a member of the archive");
    member.at = local + 30 + u16(head, 26) + u16(head, 28);
    if (member.at > file.size() || member.packed > file.size() - member.at)
      fail(file, shown(member.name), "lies beyond the file's end (truncated?)");
    members.push_back(std::move(member));
  }
  return members;
}

}  // namespace

Layout npy_layout(const std::shared_ptr<const Bytes>& file, const ReadOptions& options) {
  std::vector<BagArray> arrays;
  add_arrays(*file, file, "", arrays);
  if (arrays.size() == 1 && arrays[0].data.name.empty()) {
    arrays[0].data.name = "positions";
    if (arrays[0].data.components < 2)
      fail(*file, "", "holds rows of one number, wanted an array of shape (n, 3)");
  }
  return layout_of_bag(*file, std::move(arrays), options.dataset, options);
}

Layout npz_layout(const std::shared_ptr<const Bytes>& file, const ReadOptions& options) {
  std::vector<BagArray> arrays;
  for (const Member& member : members_of(*file)) {
    if (!member.name.ends_with(".npy") || member.size == 0) continue;
    const std::string name = member.name.substr(0, member.name.size() - 4);
    if (member.method == 0) {
      if (member.packed != member.size)
        fail(*file, shown(name), "states two sizes for what is not packed (damaged?)");
      add_arrays(*file,
                 std::make_shared<Stored>(file, shown(name), member.at, member.size, member.sum),
                 name, arrays);
    } else if (member.method == 8) {
      add_arrays(*file,
                 std::make_shared<Deflated>(file, shown(name), member.at, member.packed,
                                            member.size, member.sum),
                 name, arrays);
    } else {
      fail(*file, shown(name),
           "is packed by zip method " + std::to_string(member.method) +
               ", wanted 0 (stored) or 8 (deflated)");
    }
  }
  return layout_of_bag(*file, std::move(arrays), options.dataset, options);
}

}  // namespace meniscus
