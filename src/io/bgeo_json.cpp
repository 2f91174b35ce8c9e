// Binary JSON: a magic number, then values, each a byte that says what it is. Arrays and maps end
// with bytes of their own; "uniform" arrays hold numbers of one kind. Texts that are used again are
// defined once, by number.
//
// The geometry is an array of names and values in turn. Of these "pointcount" and "attributes" are
// looked at; the latter has "pointattributes", each of two arrays of names and values: what it is
// called, and its numbers, in "rawpagedata" (pages of tuples, constant ones with a single tuple),
// "tuples" or "arrays". Written from the schema that the HDK's documentation publishes.
#include "io/bgeo_json.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "io/array_bag.hpp"
#include "io/attribute_names.hpp"
#include "io/fields.hpp"
#include "io/scalar.hpp"

namespace meniscus {
namespace {

enum Code : unsigned char {
  kNull = 0x00,
  kBool = 0x10,
  kInt8 = 0x11,
  kInt16 = 0x12,
  kInt32 = 0x13,
  kInt64 = 0x14,
  kReal16 = 0x18,
  kReal32 = 0x19,
  kReal64 = 0x1a,
  kUint8 = 0x21,
  kUint16 = 0x22,
  kTokenRef = 0x26,
  kText = 0x27,
  kTokenDef = 0x2b,
  kComma = 0x2c,
  kTokenUndef = 0x2d,
  kFalse = 0x30,
  kTrue = 0x31,
  kColon = 0x3a,
  kUniform = 0x40,
  kArrayBegin = 0x5b,
  kArrayEnd = 0x5d,
  kMapBegin = 0x7b,
  kMapEnd = 0x7d,
};

constexpr std::size_t kDeepest = 32, kMostValues = std::size_t{1} << 20;

// A value: a text, numbers, or a list of values. A single number is a list of one. Values that use
// one defined text share it: a file of a few megabytes may use a long one a million times.
struct Value {
  enum Kind { none, text, numbers, list } kind = none;
  std::shared_ptr<const std::string> string;
  std::vector<double> values;
  std::vector<Value> items;
  bool is_text(const std::string& wanted) const { return kind == text && *string == wanted; }
  double number() const { return kind == numbers && values.size() == 1 ? values[0] : NAN; }
};

class Parser {
 public:
  explicit Parser(const InputFile& file) : file_(file) {}

  Value read() {
    at_ = 5;  // the magic number
    return value(0);
  }

 private:
  template <class T>
  T take() {
    need(sizeof(T));
    at_ += sizeof(T);
    return load<T>(&file_.bytes[at_ - sizeof(T)], std::endian::little);
  }
  void need(std::size_t size) const {
    if (size > file_.bytes.size() - at_) fail(file_, place(), "the data ends here (truncated?)");
  }
  std::string place() const { return byte_place(at_) + " of the unpacked data"; }

  std::size_t length() {
    const auto first = take<std::uint8_t>();
    std::uint64_t value = first;
    if (first == 0xf2)
      value = take<std::uint16_t>();
    else if (first == 0xf4)
      value = take<std::uint32_t>();
    else if (first == 0xf8)
      value = take<std::uint64_t>();
    else if (first > 0xf0)
      fail(file_, place(), "found a length that is none");
    if (value > file_.bytes.size())  // bits are packed, eight a byte
      value = std::min(value, std::uint64_t{8} * file_.bytes.size() + 1);
    return static_cast<std::size_t>(value);
  }
  std::shared_ptr<const std::string> text() {
    const std::size_t size = length();
    need(size);
    at_ += size;
    return std::make_shared<const std::string>(file_.bytes, at_ - size, size);
  }
  double number(unsigned char code) {
    switch (code) {
      case kBool:
      case kInt8:
        return take<std::int8_t>();
      case kInt16:
        return take<std::int16_t>();
      case kInt32:
        return take<std::int32_t>();
      case kInt64:
        return static_cast<double>(take<std::int64_t>());
      case kUint8:
        return take<std::uint8_t>();
      case kUint16:
        return take<std::uint16_t>();
      case kReal16:
        return half(take<std::uint16_t>());
      case kReal32:
        return take<float>();
      case kReal64:
        return take<double>();
      default:
        fail(file_, place(),
             "found a number of kind " + std::to_string(code) + ", which is not known");
    }
  }
  static double half(std::uint16_t bits) {
    const int exponent = bits >> 10 & 31, mantissa = bits & 1023;
    const double size = exponent == 0    ? std::ldexp(mantissa, -24)
                        : exponent == 31 ? (mantissa ? NAN : INFINITY)
                                         : std::ldexp(mantissa + 1024, exponent - 25);
    return bits & 0x8000 ? -size : size;
  }
  static std::size_t size_of_code(unsigned char code) {
    switch (code) {
      case kInt8:
      case kUint8:
        return 1;
      case kInt16:
      case kUint16:
      case kReal16:
        return 2;
      case kInt32:
      case kReal32:
        return 4;
      case kInt64:
      case kReal64:
        return 8;
      default:
        return 0;
    }
  }

  // The next byte that is no separator; definitions of texts are taken on the way.
  unsigned char next() {
    for (;;) {
      const auto code = take<std::uint8_t>();
      if (code == kComma || code == kColon) continue;
      if (code == kTokenDef) {
        const std::size_t id = length();
        if (tokens_.size() > kMostValues) fail(file_, place(), "defines too many texts");
        tokens_[id] = text();
      } else if (code == kTokenUndef) {
        tokens_.erase(length());
      } else {
        return code;
      }
    }
  }

  Value value(std::size_t depth) { return value_of(next(), depth); }

  Value value_of(unsigned char code, std::size_t depth) {
    if (depth > kDeepest) fail(file_, place(), "nests too deep");
    if (++count_ > kMostValues) fail(file_, place(), "has too many values, wanted points");
    Value result;
    switch (code) {
      case kNull:
        break;
      case kFalse:
      case kTrue:
        result.kind = Value::numbers;
        result.values = {code == kTrue ? 1.0 : 0.0};
        break;
      case kText:
        result.kind = Value::text;
        result.string = text();
        break;
      case kTokenRef: {
        result.kind = Value::text;
        const auto found = tokens_.find(length());
        if (found == tokens_.end()) fail(file_, place(), "uses a text that is not defined");
        result.string = found->second;
        break;
      }
      case kArrayBegin:
      case kMapBegin: {
        result.kind = Value::list;
        const unsigned char end = code == kArrayBegin ? kArrayEnd : kMapEnd;
        for (unsigned char one; (one = next()) != end;)
          result.items.push_back(value_of(one, depth + 1));
        break;
      }
      case kUniform: {
        result.kind = Value::numbers;
        const auto kind = take<std::uint8_t>();
        const std::size_t size = length();
        if (kind == kBool) {  // 32 bits a word
          const std::size_t words = (size + 31) / 32;
          need(words * 4);
          for (std::size_t k = 0; k < size; ++k)
            result.values.push_back(
                static_cast<unsigned char>(file_.bytes[at_ + k / 8]) >> (k % 8) & 1);
          at_ += words * 4;
          break;
        }
        const std::size_t each = size_of_code(kind);
        if (each == 0) fail(file_, place(), "found an array of kind " + std::to_string(kind));
        if (size > (file_.bytes.size() - at_) / each)
          fail(file_, place(), "the data ends inside an array (truncated?)");
        result.values.reserve(size);
        for (std::size_t k = 0; k < size; ++k) result.values.push_back(number(kind));
        break;
      }
      default:
        result.kind = Value::numbers;
        result.values = {number(code)};
    }
    return result;
  }

  const InputFile& file_;
  std::size_t at_ = 0, count_ = 0;
  std::map<std::size_t, std::shared_ptr<const std::string>> tokens_;
};

// The value after a name in a list of names and values.
const Value* named(const Value& list, const std::string& name) {
  for (std::size_t k = 0; k + 1 < list.items.size(); k += 2)
    if (list.items[k].is_text(name)) return &list.items[k + 1];
  return nullptr;
}

// Numbers of a list of numbers, of either form.
std::vector<double> numbers_of(const Value& value) {
  if (value.kind == Value::numbers) return value.values;
  std::vector<double> numbers;
  for (const Value& item : value.items) numbers.push_back(item.number());
  return numbers;
}

struct PointArray {
  std::string name;
  std::size_t components = 0;
  std::vector<double> values;  // [points][components]
};

// Pages of tuples; of a constant page there is one tuple, and each page is cut into vectors of as
// many components as "packing" says.
std::vector<double> unpaged(const InputFile& file, const std::string& place, const Value& values,
                            const Value& raw, std::size_t points, std::size_t components) {
  const std::vector<double> data = numbers_of(raw);
  const Value* const size = named(values, "pagesize");
  const double stated = size ? size->number() : 0;
  const std::size_t page = stated >= 1 && stated < 1e9 ? static_cast<std::size_t>(stated) : points;
  std::vector<double> packing{static_cast<double>(components)};
  if (const Value* given = named(values, "packing")) packing = numbers_of(*given);
  std::vector<std::size_t> widths;
  std::size_t total = 0;
  for (const double width : packing) {
    if (!(width >= 1) || width > 64) fail(file, place, "has a packing that is not known");
    widths.push_back(static_cast<std::size_t>(width));
    total += widths.back();
  }
  if (total != components) fail(file, place, "has a packing that does not fit its size");
  std::vector<std::vector<double>> constant(widths.size());
  if (const Value* flags = named(values, "constantpageflags"))
    for (std::size_t v = 0; v < widths.size() && v < flags->items.size(); ++v)
      constant[v] = numbers_of(flags->items[v]);
  std::vector<double> result(points * components);
  std::size_t at = 0;
  for (std::size_t first = 0, p = 0; first < points; first += page, ++p) {
    const std::size_t rows = std::min(page, points - first);
    std::size_t column = 0;
    for (std::size_t v = 0; v < widths.size(); ++v) {
      const bool one = p < constant[v].size() && constant[v][p] != 0;
      const std::size_t wanted = widths[v] * (one ? 1 : rows);
      if (wanted > data.size() - at)
        fail(file, place, "has " + std::to_string(data.size()) + " numbers, too few (truncated?)");
      for (std::size_t i = 0; i < rows; ++i)
        for (std::size_t c = 0; c < widths[v]; ++c)
          result[(first + i) * components + column + c] = data[at + (one ? 0 : i * widths[v]) + c];
      at += wanted;
      column += widths[v];
    }
  }
  if (at != data.size()) fail(file, place, "has more numbers than its points want");
  return result;
}

// `taken`: bytes that the arrays before this one take, to which its own are added.
PointArray array_of(const InputFile& file, const Value& attribute, std::size_t points,
                    std::size_t& taken) {
  PointArray array;
  if (attribute.items.size() < 2) return array;
  const Value &about = attribute.items[0], &data = attribute.items[1];
  const Value *name = named(about, "name"), *type = named(about, "type");
  if (!name || name->kind != Value::text || !type || !type->is_text("numeric")) return array;
  array.name = *name->string;
  const std::string place = "attribute " + shown(array.name);
  const Value* const values = named(data, "values");
  const Value* size = named(data, "size");
  if (values && named(*values, "size")) size = named(*values, "size");
  if (!values || !size) return array;
  const double components = size->number();
  if (!(components >= 1) || components > 64) return array;
  array.components = static_cast<std::size_t>(components);
  // A constant page is one tuple, however many points it has.
  taken += points * array.components * sizeof(double);
  check_unpacked(*memory_bytes(file), taken, place);
  if (const Value* raw = named(*values, "rawpagedata")) {
    array.values = unpaged(file, place, *values, *raw, points, array.components);
  } else if (const Value* tuples = named(*values, "tuples")) {
    if (tuples->items.size() != points) fail(file, place, "has another number of tuples");
    for (const Value& tuple : tuples->items) {
      const std::vector<double> numbers = numbers_of(tuple);
      if (numbers.size() != array.components) fail(file, place, "has a tuple of another size");
      array.values.insert(array.values.end(), numbers.begin(), numbers.end());
    }
  } else if (const Value* arrays = named(*values, "arrays")) {
    if (arrays->items.size() != array.components) fail(file, place, "has other components");
    for (std::size_t c = 0; c < array.components; ++c) {
      const std::vector<double> numbers = numbers_of(arrays->items[c]);
      if (numbers.size() != points) fail(file, place, "has another number of values");
      array.values.resize(points * array.components);
      for (std::size_t i = 0; i < points; ++i) array.values[i * array.components + c] = numbers[i];
    }
  } else {
    array.components = 0;
  }
  return array;
}

}  // namespace

bool is_bgeo_json(const std::string& bytes) { return bytes.starts_with("\x7fNSJb"); }

Particles read_bgeo_json(const InputFile& file, const ReadOptions& options) {
  if (!is_bgeo_json(file.bytes))
    fail(file, "", "is no binary JSON of Houdini's (save it as .bgeo or .bgeo.sc)");
  const Value root = Parser(file).read();
  const Value *count = named(root, "pointcount"), *attributes = named(root, "attributes");
  const double stated = count ? count->number() : NAN;
  // Positions at least are stored, but for pages that are alike.
  if (!(stated >= 0) || stated != std::floor(stated) ||
      stated > 16 * static_cast<double>(file.size()) + 65536)
    fail(file, "", "states no number of points that it can hold");
  const std::size_t points = static_cast<std::size_t>(stated);
  const Value* const list = attributes ? named(*attributes, "pointattributes") : nullptr;
  if (!list) fail(file, "", "has no pointattributes (truncated?)");
  std::vector<PointArray> arrays;
  std::size_t taken = 0;
  for (const Value& attribute : list->items) {
    PointArray array = array_of(file, attribute, points, taken);
    if (array.components > 0) arrays.push_back(std::move(array));
  }
  Particles particles;
  const auto column = [&](const PointArray& array, std::size_t c, std::vector<float>& to) {
    to.resize(points);
    for (std::size_t i = 0; i < points; ++i)
      to[i] = static_cast<float>(array.values[i * array.components + c]);
  };
  bool has_positions = false;
  for (const PointArray& array : arrays) {
    const Field field = field_of_attribute(array.name, array.components);
    if (array.name == "P" && array.components >= 3 && !has_positions) {
      has_positions = true;
      column(array, 0, particles.x), column(array, 1, particles.y), column(array, 2, particles.z);
    } else if (field == Field::vx && particles.vx.empty()) {
      column(array, 0, particles.vx), column(array, 1, particles.vy);
      column(array, 2, particles.vz);
    } else if (field == Field::id && particles.id.empty()) {
      for (std::size_t i = 0; i < points; ++i) {
        const double id = array.values[i];
        if (!(std::abs(id) < 0x1p53) || id != std::floor(id))
          fail(file, "point " + std::to_string(i),
               "id is " + shown(id) + ", must be a whole number");
        particles.id.push_back(static_cast<std::int64_t>(id));
      }
    } else if ((field == Field::density || field == Field::radius) &&
               meniscus::array_of(particles, field).empty()) {
      column(array, 0, meniscus::array_of(particles, field));
    }
  }
  if (!has_positions) fail(file, "", "has no attribute P of three components");
  std::vector<NamedArray> names;
  for (const PointArray& array : arrays) names.push_back({array.name, array.components});
  for (const AttributePick& pick : pick_attributes(file.name, names, options.attributes)) {
    Attribute attribute{pick.name, {}};
    column(arrays[pick.array], pick.component, attribute.values);
    particles.attributes.push_back(std::move(attribute));
  }
  return particles;
}

}  // namespace meniscus
