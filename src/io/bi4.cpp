// DualSPHysics' binary files (Part_0000.bi4): named values and arrays in items that nest. Written
// from the layout that its sources publish.
//
//   head    64 bytes: "#FileJBD ...", byte order (1: big; + 10 with wide sizes), wide sizes or not
//   item    uint32 size, "\nITEM\n", name, hide, hide values, two formats, uint32 counts of arrays
//           and items, uint32 size of values; values; arrays; items
//   values  "\nVALUES", uint32 count; each a name, int32 type, value
//   array   uint32 size, "\nARRAY", name, hide, int32 type, count, size of the data; data
//   text    uint32 length, letters; a truth value is an int32
#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "io/readers.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kHead = 64;
constexpr std::size_t kMostText = 4096, kMostArrays = 1000, kDeepest = 16, kMostItems = 10000;

struct Bi4Type {
  Scalar type = Scalar::int32;
  std::size_t components = 1;
};

std::optional<Bi4Type> type_of(std::int32_t code) {
  switch (code) {
    case 2:  // truth values
    case 7:
      return Bi4Type{Scalar::int32, 1};
    case 3:
      return Bi4Type{Scalar::int8, 1};
    case 4:
      return Bi4Type{Scalar::uint8, 1};
    case 5:
      return Bi4Type{Scalar::int16, 1};
    case 6:
      return Bi4Type{Scalar::uint16, 1};
    case 8:
      return Bi4Type{Scalar::uint32, 1};
    case 9:
      return Bi4Type{Scalar::int64, 1};
    case 10:
      return Bi4Type{Scalar::uint64, 1};
    case 11:
      return Bi4Type{Scalar::float32, 1};
    case 12:
      return Bi4Type{Scalar::float64, 1};
    case 20:
      return Bi4Type{Scalar::int32, 3};
    case 21:
      return Bi4Type{Scalar::uint32, 3};
    case 22:
      return Bi4Type{Scalar::float32, 3};
    case 23:
      return Bi4Type{Scalar::float64, 3};
    default:
      return std::nullopt;
  }
}

class Reader {
 public:
  explicit Reader(const std::shared_ptr<const Bytes>& file) : file_(file) {
    const std::string head = text_at(*file, 0, kHead);
    if (!head.starts_with("#FileJBD "))
      fail(*file, "byte 0",
           "found " + in_quotes(head.substr(0, 9)) + ", wanted \"#FileJBD \" (DualSPHysics)");
    const int order = static_cast<unsigned char>(head[60]);
    if (order != 0 && order != 1 && order != 10 && order != 11)
      fail(*file, "byte 60", "found byte order " + std::to_string(order) + ", wanted 0 or 1");
    order_ = order % 10 == 1 ? std::endian::big : std::endian::little;
    wide_ = head[61] != 0;
    at_ = kHead;
    item(0);
  }

  struct Array {
    DataArray data;
    std::uint64_t count = 0;
  };
  std::vector<Array> arrays;             // of all items
  std::map<std::string, double> values;  // single numbers of all items

 private:
  template <class T>
  T take(const char* what) {
    if (at_ > file_->size() || sizeof(T) > file_->size() - at_)
      fail(*file_, byte_place(static_cast<std::size_t>(at_)),
           std::string("the file ends inside ") + what + " (truncated?)");
    char bytes[sizeof(T)];
    file_->read(at_, bytes, sizeof bytes);
    at_ += sizeof(T);
    return load<T>(bytes, order_);
  }
  std::string text(const char* what) {
    const auto length = take<std::uint32_t>(what);
    if (length > kMostText)
      fail(*file_, byte_place(static_cast<std::size_t>(at_)),
           std::string(what) + " has " + std::to_string(length) + " letters, too many");
    const std::string result = text_at(*file_, at_, length);
    at_ += length;
    return result;
  }
  void mark(const char* wanted) {
    const std::uint64_t before = at_;
    const std::string found = text("a mark");
    if (found != wanted)
      fail(*file_, byte_place(static_cast<std::size_t>(before)),
           "found " + in_quotes(found) + ", wanted " + in_quotes(wanted));
  }

  void item(std::size_t depth) {
    if (depth > kDeepest || ++items_ > kMostItems)
      fail(*file_, byte_place(static_cast<std::size_t>(at_)), "has too many items");
    take<std::uint32_t>("an item");
    mark("\nITEM\n");
    text("an item's name");
    take<std::int32_t>("an item");
    take<std::int32_t>("an item");
    text("an item's format");
    text("an item's format");
    const auto array_count = take<std::uint32_t>("an item");
    const auto item_count = take<std::uint32_t>("an item");
    if (take<std::uint32_t>("an item") > 0) {
      mark("\nVALUES");
      for (auto left = take<std::uint32_t>("values"); left > 0; --left) value();
    }
    for (std::uint32_t k = 0; k < array_count; ++k) array();
    for (std::uint32_t k = 0; k < item_count; ++k) item(depth + 1);
  }

  void value() {
    const std::string name = text("a value's name");
    const auto code = take<std::int32_t>("a value's type");
    if (code == 1) {
      text("a text");
      return;
    }
    const auto type = type_of(code);
    if (!type)
      fail(*file_, byte_place(static_cast<std::size_t>(at_)),
           "value " + shown(name) + " has type " + std::to_string(code) + ", which is not known");
    // Truth values are stored as whole numbers.
    const std::size_t size = size_of(type->type) * type->components;
    const std::string bytes = text_at(*file_, at_, size);
    at_ += size;
    if (type->components == 1 && values.size() < kMostItems)
      values.try_emplace(name, load_real<double>(bytes.data(), type->type, order_));
  }

  void array() {
    take<std::uint32_t>("an array");
    mark("\nARRAY");
    Array array;
    array.data.name = text("an array's name");
    take<std::int32_t>("an array");
    const auto code = take<std::int32_t>("an array's type");
    std::uint64_t size = 0;
    if (wide_) {
      array.count = take<std::uint64_t>("an array's count");
      size = take<std::uint64_t>("an array's size");
    } else {
      array.count = take<std::uint32_t>("an array's count");
      size = take<std::uint32_t>("an array's size");
    }
    if (size > file_->size() - at_)
      fail(*file_, byte_place(static_cast<std::size_t>(at_)),
           "the file ends inside array " + shown(array.data.name) + " of " + std::to_string(size) +
               " bytes (truncated?)");
    if (const auto type = type_of(code)) {
      const std::uint64_t row = size_of(type->type) * type->components;
      if (size / row != array.count || size % row != 0)
        fail(*file_, byte_place(static_cast<std::size_t>(at_)),
             "array " + shown(array.data.name) + " states " + std::to_string(array.count) +
                 " values and " + std::to_string(size) + " bytes, which do not fit each other");
      array.data.components = type->components;
      array.data.type = type->type;
      array.data.order = order_;
      array.data.bytes = file_;
      array.data.offset = at_;
      array.data.stride = row;
      array.data.component_stride = size_of(type->type);
      if (arrays.size() == kMostArrays) fail(*file_, "", "has too many arrays");
      arrays.push_back(std::move(array));
    } else if (code != 1) {
      fail(*file_, byte_place(static_cast<std::size_t>(at_)),
           "array " + shown(array.data.name) + " has type " + std::to_string(code) +
               ", which is not known");
    }
    at_ += size;
  }

  std::shared_ptr<const Bytes> file_;
  std::endian order_ = std::endian::little;
  bool wide_ = false;
  std::uint64_t at_ = 0;
  std::size_t items_ = 0;
};

// Calls work(row, place) for the rows of an array.
template <class Work>
void for_each_block(const DataArray& array, std::uint64_t count, const Work& work) {
  constexpr std::uint64_t kRows = std::uint64_t{1} << 14;
  for (std::uint64_t done = 0; done < count; done += kRows) {
    const std::uint64_t now = std::min(kRows, count - done);
    const std::string block = text_at(*array.bytes, array.offset + done * array.stride,
                                      static_cast<std::size_t>(now * array.stride));
    for (std::uint64_t i = 0; i < now; ++i) work(block.data() + i * array.stride, done + i);
  }
}

// Leaves the particles whose id is `first_fluid` or more in the arrays, where ids are among these.
// Returns how many there are.
std::uint64_t keep_fluid(const Bytes& file, double first_fluid, std::uint64_t count,
                         std::vector<DataArray>& arrays) {
  const auto ids = std::find_if(arrays.begin(), arrays.end(),
                                [](const DataArray& array) { return array.name == "Idp"; });
  if (ids == arrays.end() || count == 0) return count;
  std::vector<char> is_fluid(static_cast<std::size_t>(count));
  std::uint64_t found = 0, first = count, last = 0;
  for_each_block(*ids, count, [&](const char* row, std::uint64_t i) {
    if (load_real<double>(row, ids->type, ids->order) < first_fluid) return;
    is_fluid[static_cast<std::size_t>(i)] = 1;
    ++found;
    first = std::min(first, i);
    last = i;
  });
  if (found == 0 || found == last - first + 1) {  // as DualSPHysics writes them
    for (DataArray& array : arrays) array.offset += (found == 0 ? 0 : first) * array.stride;
    return found;
  }
  for (DataArray& array : arrays) {
    std::string kept;
    kept.reserve(static_cast<std::size_t>(found * array.stride));
    for_each_block(array, count, [&](const char* row, std::uint64_t i) {
      if (is_fluid[static_cast<std::size_t>(i)]) kept.append(row, array.stride);
    });
    array.bytes = owned_bytes(file.name(), std::move(kept));
    array.offset = 0;
  }
  return found;
}

}  // namespace

Layout bi4_layout(const std::shared_ptr<const Bytes>& file, const ReadOptions& options) {
  const Reader reader(file);
  const auto named = [&](const char* name) -> const Reader::Array* {
    for (const Reader::Array& array : reader.arrays)
      if (array.data.name == name) return &array;
    return nullptr;
  };
  const auto value = [&](const char* name) -> std::optional<double> {
    const auto found = reader.values.find(name);
    return found == reader.values.end() ? std::nullopt : std::optional(found->second);
  };
  const Reader::Array* const positions = named("Posd") ? named("Posd") : named("Pos");
  if (!positions || positions->data.components != 3)
    fail(*file, "", "has no array Pos or Posd of three components, wanted a file Part_0000.bi4");
  std::vector<DataArray> arrays;
  std::size_t at = 0;
  for (const Reader::Array& array : reader.arrays) {
    if (array.count != positions->count) continue;
    if (&array == positions) at = arrays.size();
    arrays.push_back(array.data);
    if (array.data.name == "Idpd") arrays.back().name = "Idp";
  }
  std::uint64_t count = positions->count;
  // Walls and bodies have the lower ids, and are no fluid.
  const auto fixed = value("CaseNfixed"), moving = value("CaseNmoving"),
             floating = value("CaseNfloat");
  if (fixed && moving && floating)
    count = keep_fluid(*file, *fixed + *moving + *floating, count, arrays);
  Layout layout = layout_of(*file, arrays, at, static_cast<std::int64_t>(count), options);
  if (const auto spacing = value("Dp"); spacing && !(options.particle_radius > 0))
    layout.particle_radius = *spacing / 2;
  if (const auto time = value("TimeStep")) layout.time = *time;
  return layout;
}

}  // namespace meniscus
