#include <algorithm>
#include <string>
#include <vector>

#include "io/array_bag.hpp"
#include "io/attribute_names.hpp"
#include "io/bgeo_json.hpp"
#include "io/fields.hpp"
#include "io/inflate_stream.hpp"
#include "io/readers.hpp"
#include "io/scalar.hpp"

namespace meniscus {
namespace {

bool is_gzip(const std::string& bytes) { return bytes.starts_with("\x1f\x8b"); }

/// Unpacks gzip data, also of several members in a row.
InputFile unpacked(const InputFile& file) {
  InflateStream stream(Wrapping::gzip, file, "");
  constexpr std::size_t kLargestStep = 1 << 30;  // zlib counts in 32 bits
  InputFile result{file.name, std::string(std::max<std::size_t>(4 * file.size(), 1024), '\0')};
  std::size_t taken = 0, made = 0;
  for (bool at_end = false; !at_end || taken < file.size();) {
    if (at_end) inflateReset(&stream);
    if (made == result.size()) result.bytes.resize(2 * made);
    const std::size_t input = std::min(file.size() - taken, kLargestStep);
    const std::size_t output = std::min(result.size() - made, kLargestStep);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(file.bytes.data() + taken));
    stream.avail_in = static_cast<uInt>(input);
    stream.next_out = reinterpret_cast<Bytef*>(result.bytes.data() + made);
    stream.avail_out = static_cast<uInt>(output);
    const int status = inflate(&stream, Z_NO_FLUSH);
    taken += input - stream.avail_in;
    made += output - stream.avail_out;
    at_end = status == Z_STREAM_END;
    if (status == Z_BUF_ERROR)
      fail(file, byte_place(taken), "the file ends inside its gzip data (truncated?)");
    if (!may_unpack_to(taken, made))
      fail(file, byte_place(taken),
           "its gzip data unpacks to more than " + std::to_string(kMostUnpacked) +
               " times its size, wanted particles (unpack it with gunzip if they are)");
    if (status != Z_OK && !at_end)
      fail(file, byte_place(taken),
           std::string("its gzip data is damaged: ") + (stream.msg ? stream.msg : "unknown"));
  }
  result.bytes.resize(made);
  return result;
}

/// Big-endian values one after the other.
class BgeoCursor {
 public:
  BgeoCursor(const InputFile& file, bool packed) : file_(file), packed_(packed) {}

  template <class T>
  T take(const char* what) {
    need(sizeof(T), what);
    at_ += sizeof(T);
    return load<T>(file_.bytes.data() + at_ - sizeof(T), std::endian::big);
  }

  std::size_t take_count(const char* what) {
    const auto value = take<std::int32_t>(what);
    if (value < 0)
      fail(file_, place(), "found " + std::to_string(value) + " for " + what + ", must be >= 0");
    return static_cast<std::size_t>(value);
  }

  std::string take_string(const char* what) {
    const std::size_t length = take<std::uint16_t>(what);
    need(length, what);
    at_ += length;
    return file_.bytes.substr(at_ - length, length);
  }

  void skip(std::size_t n, const char* what) {
    need(n, what);
    at_ += n;
  }

  std::size_t offset() const { return at_; }
  std::size_t remaining() const { return file_.size() - at_; }
  std::string place() const { return byte_place(at_) + (packed_ ? " of the unpacked data" : ""); }

 private:
  void need(std::size_t n, const char* what) const {
    if (n > remaining())
      fail(file_, place(),
           std::string("the file ends inside ") + what + ": found " + std::to_string(remaining()) +
               " bytes, wanted " + std::to_string(n) + " (truncated?)");
  }

  const InputFile& file_;
  bool packed_;
  std::size_t at_ = 0;
};

struct PointArray {
  std::size_t offset;  // of its first value in a point, bytes
  Scalar type;
  Field field;  // vx stands for all three components of the velocity
};

/// The dictionary of point attributes.
struct PointAttributes {
  std::size_t point_size = 16;    // bytes; x y z w come first
  std::vector<PointArray> kept;   // those that have a field of ours
  std::vector<PointArray> all;    // all of numbers,
  std::vector<NamedArray> names;  // and what they are called
};

PointAttributes read_attributes(const InputFile& file, BgeoCursor& cursor, std::size_t count) {
  enum Type { real = 0, whole = 1, index = 4, vector = 5 };
  PointAttributes found;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string name = cursor.take_string("the name of a point attribute");
    const std::size_t components = cursor.take<std::uint16_t>("the size of a point attribute");
    const auto type = cursor.take<std::int32_t>("the type of a point attribute");
    const std::size_t offset = found.point_size;
    found.point_size += 4 * components;
    if (type == index) {
      for (std::size_t k = cursor.take_count("the number of strings"); k > 0; --k)
        cursor.take_string("a string of a point attribute");
      continue;
    }
    if (type != real && type != whole && type != vector)
      fail(file, cursor.place(),
           "found type " + std::to_string(type) + " of point attribute " + in_quotes(name) +
               ", wanted 0 (float), 1 (int), 4 (index) or 5 (vector)");
    cursor.skip(4 * components, "the default of a point attribute");
    const PointArray array{offset, type == whole ? Scalar::int32 : Scalar::float32,
                           field_of_attribute(name, components)};
    found.names.push_back({name, components});
    found.all.push_back(array);
    const auto same = [&](const PointArray& other) { return other.field == array.field; };
    if (array.field != Field::none && std::none_of(found.kept.begin(), found.kept.end(), same))
      found.kept.push_back(array);
  }
  return found;
}

void read_ids(const InputFile& file, const char* from, std::size_t step, Scalar type,
              std::vector<std::int64_t>& ids) {
  for (std::size_t i = 0; i < ids.size(); ++i, from += step) {
    const auto id = load_integer(from, type, std::endian::big);
    if (!id)
      fail(file, "point " + std::to_string(i),
           "id is " + shown(load_real<double>(from, type, std::endian::big)) +
               ", must be a whole number");
    ids[i] = *id;
  }
}

/// How many points there are, and how many attributes they have.
struct Counts {
  std::size_t points, attributes;
};

Counts read_header(const InputFile& file, BgeoCursor& cursor) {
  const std::string magic = file.bytes.substr(0, 5);
  if (magic.starts_with("[") || magic.starts_with("{"))
    fail(file, "", "is Houdini's JSON as text, wanted it binary (save as .bgeo or .bgeo.sc)");
  if (magic != "BgeoV")
    fail(file, "byte 0", "found " + in_quotes(magic) + ", wanted \"BgeoV\" (classic bgeo)");
  cursor.skip(5, "the header");
  if (const auto version = cursor.take<std::int32_t>("the version"); version != 5)
    fail(file, "byte 5", "found version " + std::to_string(version) + ", wanted 5");
  const std::size_t points = cursor.take_count("the number of points");
  cursor.skip(12, "the header");  // primitives, point groups, primitive groups
  const std::size_t attributes = cursor.take_count("the number of point attributes");
  cursor.skip(12, "the header");  // attributes of vertices, primitives, the whole
  return {points, attributes};
}

/// The arrays of one component that the position and these attributes are.
std::vector<PointArray> columns_of(const std::vector<PointArray>& attributes) {
  std::vector<PointArray> columns;
  const auto add_three = [&](const PointArray& first) {
    for (std::size_t k = 0; k < 3; ++k)
      columns.push_back({first.offset + 4 * k, first.type,
                         static_cast<Field>(static_cast<std::size_t>(first.field) + k)});
  };
  add_three({0, Scalar::float32, Field::x});
  for (const PointArray& attribute : attributes)
    if (attribute.field == Field::vx)
      add_three(attribute);
    else
      columns.push_back(attribute);
  return columns;
}

Particles read_points(const InputFile& file, bool packed, const ReadOptions& options) {
  BgeoCursor cursor(file, packed);
  const Counts count = read_header(file, cursor);
  const PointAttributes found = read_attributes(file, cursor, count.attributes);
  const std::size_t stride = found.point_size;
  if (count.points > cursor.remaining() / stride)
    fail(file, "point " + std::to_string(cursor.remaining() / stride),
         "the data ends at byte " + std::to_string(file.size()) + (packed ? " when unpacked" : "") +
             ", wanted " + std::to_string(count.points) + " points of " + std::to_string(stride) +
             " bytes from byte " + std::to_string(cursor.offset()) + " (truncated?)");

  Particles particles;
  const char* const first = file.bytes.data() + cursor.offset();
  const auto read = [&](std::size_t offset, Scalar type, std::vector<float>& values) {
    for (std::size_t i = 0; i < count.points; ++i)
      values[i] = load_real<float>(first + offset + i * stride, type, std::endian::big);
  };
  for (const PointArray& column : columns_of(found.kept)) {
    resize(particles, {column.field}, count.points);
    if (column.field == Field::id)
      read_ids(file, first + column.offset, stride, column.type, particles.id);
    else
      read(column.offset, column.type, array_of(particles, column.field));
  }
  for (const AttributePick& pick : pick_attributes(file.name, found.names, options.attributes)) {
    Attribute attribute{pick.name, std::vector<float>(count.points)};
    const PointArray& array = found.all[pick.array];
    read(array.offset + 4 * pick.component, array.type, attribute.values);
    particles.attributes.push_back(std::move(attribute));
  }
  return particles;
}

}  // namespace

Particles read_bgeo(const InputFile& file, const ReadOptions& options) {
  if (lower_case(file.name).ends_with(".sc")) return read_bgeo_json(unpacked_sc(file), options);
  if (is_bgeo_json(file.bytes)) return read_bgeo_json(file, options);
  if (!is_gzip(file.bytes)) return read_points(file, false, options);
  const InputFile whole = unpacked(file);
  return is_bgeo_json(whole.bytes) ? read_bgeo_json(whole, options)
                                   : read_points(whole, true, options);
}

}  // namespace meniscus
