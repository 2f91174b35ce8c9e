#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/attribute_names.hpp"
#include "io/fields.hpp"
#include "io/readers.hpp"
#include "io/scalar.hpp"
#include "io/text_cursor.hpp"

namespace meniscus {
namespace {

/// What arrays that follow belong to.
enum class Section { dataset, points, cells };

constexpr std::pair<const char*, Scalar> kVtkTypes[] = {
    {"char", Scalar::int8},          {"unsigned_char", Scalar::uint8},
    {"short", Scalar::int16},        {"unsigned_short", Scalar::uint16},
    {"int", Scalar::int32},          {"unsigned_int", Scalar::uint32},
    {"long", Scalar::int64},         {"unsigned_long", Scalar::uint64},
    {"vtktypeint64", Scalar::int64}, {"vtktypeuint64", Scalar::uint64},
    {"vtkidtype", Scalar::int32},  // legacy files keep it as int
    {"float", Scalar::float32},      {"double", Scalar::float64}};

class VtkReader {
 public:
  VtkReader(const InputFile& file, const ReadOptions& options)
      : file_(file), options_(options), cursor_(file) {}

  Particles read() {
    read_header();
    for (std::string key; !(key = lower_case(cursor_.next_token())).empty();) read_part(key);
    if (!has_points_) fail(file_, "", "has no POINTS (truncated?)");
    // In the order asked for; throws where one is not there.
    for (const AttributePick& pick : pick_attributes(file_.name, arrays_, options_.attributes)) {
      const std::vector<float>& values = found_[pick.array];
      const std::size_t components = arrays_[pick.array].components;
      Attribute attribute{pick.name, std::vector<float>(particles_.size())};
      for (std::size_t i = 0; i < attribute.values.size(); ++i)
        attribute.values[i] = values[i * components + pick.component];
      particles_.attributes.push_back(std::move(attribute));
    }
    return std::move(particles_);
  }

 private:
  void read_header() {
    const auto first = cursor_.next_line();
    if (!first->starts_with("# vtk DataFile Version"))
      fail(file_, "line 1", "found " + in_quotes(*first) + ", wanted \"# vtk DataFile Version\"");
    cursor_.next_line();  // a title
    const std::string encoding = lower_case(cursor_.next_token());
    if (encoding != "ascii" && encoding != "binary")
      fail(file_, cursor_.place(), "found " + in_quotes(encoding) + ", wanted ASCII or BINARY");
    binary_ = encoding == "binary";
  }

  void read_part(const std::string& key) {
    if (key == "dataset") {
      const std::string type = lower_case(cursor_.next_token());
      if (type != "polydata" && type != "unstructured_grid" && type != "structured_grid")
        fail_here("found dataset " + in_quotes(type) + ", wanted POLYDATA or UNSTRUCTURED_GRID");
    } else if (key == "dimensions") {
      for (int k = 0; k < 3; ++k) cursor_.count("DIMENSIONS");
    } else if (key == "points") {
      read_points();
    } else if (key == "cells" || key == "vertices" || key == "lines" || key == "polygons" ||
               key == "triangle_strips") {
      skip_cells(key);
    } else if (key == "cell_types") {
      const std::size_t count = cursor_.count("the number of CELL_TYPES");
      skip("CELL_TYPES", "int", count, 1);
    } else if (key == "point_data") {
      section_ = Section::points;
      tuples_ = cursor_.count("the number of POINT_DATA");
      if (tuples_ != particles_.size())
        fail_here("found POINT_DATA for " + std::to_string(tuples_) + " points, wanted " +
                  std::to_string(particles_.size()) + " as in POINTS");
    } else if (key == "cell_data") {
      section_ = Section::cells;
      tuples_ = cursor_.count("the number of CELL_DATA");
    } else if (key == "metadata") {
      skip_metadata();
    } else if (key == "field") {
      read_field();
    } else {
      read_attribute(key);
    }
  }

  void read_points() {
    if (has_points_) fail_here("POINTS appears twice");
    has_points_ = true;
    const std::size_t count = cursor_.count("the number of POINTS");
    store(Field::x, read_values<float>("POINTS", known_type(next_type(), "POINTS"), count, 3));
  }

  /// Version 5.1 files have two arrays of typed values, older ones a single one of int.
  void skip_cells(const std::string& key) {
    const std::size_t first = cursor_.count("the number of " + key);
    const std::size_t second = cursor_.count("the size of " + key);
    TextCursor ahead = cursor_;
    if (lower_case(ahead.next_token()) != "offsets") {
      skip(key, "int", second, 1);
      return;
    }
    for (const auto& [name, count] :
         {std::pair<std::string, std::size_t>{"offsets", first}, {"connectivity", second}}) {
      const std::string found = lower_case(cursor_.next_token());
      if (found != name) fail_here("found " + in_quotes(found) + ", wanted " + name);
      skip(name, next_type(), count, 1);
    }
  }

  /// A block about the array before it that ends with an empty line. The names of its components
  /// come first, where there are any, and may be empty lines themselves.
  void skip_metadata() {
    cursor_.next_line();
    for (std::size_t names = 0;;) {
      const auto line = cursor_.next_line();
      if (!line) fail_here("the file ends inside METADATA, wanted an empty line (truncated?)");
      if (names > 0)
        --names;
      else if (line->starts_with("COMPONENT_NAMES"))
        names = components_;
      else if (line->find_first_not_of(" \t") == std::string_view::npos)
        return;
    }
  }

  void read_field() {
    next_name("FIELD");
    for (std::size_t left = cursor_.count("the number of arrays of FIELD"); left > 0; --left) {
      std::string name = next_name("an array of FIELD");
      while (lower_case(name) == "metadata") {
        skip_metadata();
        name = next_name("an array of FIELD");
      }
      const std::size_t components = cursor_.count("the number of components of " + shown(name));
      const std::size_t tuples = cursor_.count("the number of tuples of " + shown(name));
      const std::string type = next_type();
      const std::string lower = lower_case(name);
      const bool is_time = lower == "time" || lower == "timevalue";
      if (section_ == Section::dataset && is_time && components == 1 && tuples == 1 &&
          scalar_named(kVtkTypes, type))
        particles_.time = read_values<double>(shown(name), known_type(type, shown(name)), 1, 1)[0];
      else
        read_array(name, type, tuples, components);
    }
  }

  void read_attribute(const std::string& key) {
    static const std::pair<const char*, std::size_t> kComponents[] = {
        {"vectors", 3},  {"normals", 3},    {"tensors", 9},
        {"tensors6", 6}, {"global_ids", 1}, {"pedigree_ids", 1}};
    for (const auto& [known, components] : kComponents) {
      if (key != known) continue;
      const std::string name = next_name(key);
      read_array(key == "global_ids" ? "id" : name, next_type(), tuples_, components);
      return;
    }
    if (key == "scalars") {
      const std::string name = next_name(key), type = next_type();
      std::string token = lower_case(cursor_.peek_token());
      const std::size_t components =
          token == "lookup_table" ? 1 : cursor_.count("the number of components of " + shown(name));
      token = lower_case(cursor_.next_token());
      if (token != "lookup_table")
        fail_here("found " + in_quotes(token) + ", wanted LOOKUP_TABLE of " + shown(name));
      next_name("LOOKUP_TABLE");
      read_array(name, type, tuples_, components);
    } else if (key == "texture_coordinates") {
      const std::string name = next_name(key);
      const std::size_t components = cursor_.count("the dimension of " + shown(name));
      read_array(name, next_type(), tuples_, components);
    } else if (key == "color_scalars") {
      const std::string name = next_name(key);
      const std::size_t components = cursor_.count("the number of components of " + shown(name));
      skip(shown(name), "unsigned_char", tuples_, components);
    } else if (key == "lookup_table") {
      const std::string name = next_name(key);
      const std::size_t entries = cursor_.count("the size of " + shown(name));
      skip(shown(name), "unsigned_char", entries, 4);
    } else {
      fail_here("found " + in_quotes(key) + ", wanted a keyword of VTK (truncated?)");
    }
  }

  /// Keeps an array of the points that has a field of ours, skips any other.
  void read_array(const std::string& key, const std::string& type, std::size_t tuples,
                  std::size_t components) {
    const std::string name = shown(key);  // for messages
    Field field = section_ == Section::points ? field_of_attribute(key, components) : Field::none;
    if (field != Field::none && is_kept(field)) field = Field::none;
    const bool numbers = type != "string" && type != "bit" && components > 0;
    const bool is_asked = section_ == Section::points && numbers && asks_for(key, components);
    if (!numbers || (field == Field::none && !is_asked)) {
      skip(name, type, tuples, components);
      return;
    }
    if (tuples != particles_.size())
      fail_here("found " + std::to_string(tuples) + " tuples of " + name + ", wanted " +
                std::to_string(particles_.size()) + " as in POINTS");
    const Scalar scalar = known_type(type, name);
    if (field == Field::id) {
      particles_.id = read_values<std::int64_t>(name, scalar, tuples, 1);
      if (is_asked) found_.back().assign(particles_.id.begin(), particles_.id.end());
      return;
    }
    std::vector<float> values = read_values<float>(name, scalar, tuples, components);
    if (is_asked) found_.back() = values;
    if (field != Field::none) store(field, std::move(values));
  }

  /// Notes an array of the points; whether it is an attribute that is asked for.
  bool asks_for(const std::string& name, std::size_t components) {
    constexpr std::size_t kMost = 1000;
    if (options_.attributes.empty() || arrays_.size() == kMost) return false;
    const bool is_new = std::none_of(arrays_.begin(), arrays_.end(), [&](const NamedArray& other) {
      return lower_case(other.name) == lower_case(name);
    });
    if (!is_new) return false;
    arrays_.push_back({name, components});
    found_.emplace_back();
    return std::any_of(options_.attributes.begin(), options_.attributes.end(),
                       [&](const std::string& wanted) {
                         return lower_case(name).starts_with(lower_case(wanted));
                       });
  }

  bool is_kept(Field field) {
    return field == Field::id ? !particles_.id.empty() : !array_of(particles_, field).empty();
  }

  /// Values of one component, or of three from `first` on.
  void store(Field first, std::vector<float> values) {
    if (first >= Field::density) {
      array_of(particles_, first) = std::move(values);
      return;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const Field field = static_cast<Field>(static_cast<std::size_t>(first) + k);
      std::vector<float>& array = array_of(particles_, field);
      array.resize(values.size() / 3);
      for (std::size_t i = 0; i < array.size(); ++i) array[i] = values[3 * i + k];
    }
  }

  void skip(const std::string& name, const std::string& type, std::size_t tuples,
            std::size_t components) {
    components_ = components;
    if (type == "string") {
      skip_strings(name, product(name, tuples, components));
    } else if (!binary_) {
      if (type != "bit") known_type(type, name);
      const std::size_t count = checked_count(name, tuples, components, 2);
      for (std::size_t i = 0; i < count; ++i) cursor_.real(name);
    } else if (type == "bit") {
      begin_binary(name);
      const std::size_t bits = product(name, tuples, components);
      const std::size_t bytes = checked_count(name, bits / 8 + (bits % 8 != 0), 1, 1);
      cursor_.move_to(cursor_.offset() + bytes);
    } else {
      const std::size_t size = size_of(known_type(type, name));
      begin_binary(name);
      cursor_.move_to(cursor_.offset() + checked_count(name, tuples, components, size) * size);
    }
  }

  /// Text: one a line. Binary: each after its length, whose own size lies in its two top bits.
  void skip_strings(const std::string& name, std::size_t count) {
    begin_binary(name);
    checked_count(name, count, 1, 1);
    for (std::size_t i = 0; i < count; ++i) {
      if (!binary_) {
        if (!cursor_.next_line() || !cursor_.line_was_ended())
          fail_here("the file ends inside " + name + " (truncated?)");
        continue;
      }
      checked_count(name, 1, 1, 1);
      const unsigned char head = static_cast<unsigned char>(file_.bytes[cursor_.offset()]);
      const std::size_t size = std::size_t{8} >> (head >> 6);
      checked_count(name, 1, 1, size);
      std::uint64_t length = head & 0x3f;
      for (std::size_t k = 1; k < size; ++k)
        length = length << 8 | static_cast<unsigned char>(file_.bytes[cursor_.offset() + k]);
      cursor_.move_to(cursor_.offset() + size);
      checked_count(name, length, 1, 1);
      cursor_.move_to(cursor_.offset() + length);
    }
  }

  template <class T>
  std::vector<T> read_values(const std::string& name, Scalar type, std::size_t tuples,
                             std::size_t components) {
    components_ = components;
    const std::size_t size = size_of(type);
    if (binary_) begin_binary(name);
    const std::size_t count = checked_count(name, tuples, components, binary_ ? size : 2);
    std::vector<T> values(count);
    if (!binary_) {
      for (T& value : values) {
        if constexpr (std::is_integral_v<T>)
          value = cursor_.integer(name);
        else
          value = static_cast<T>(cursor_.real(name));
      }
      return values;
    }
    const char* from = file_.bytes.data() + cursor_.offset();
    for (std::size_t i = 0; i < count; ++i, from += size) {
      if constexpr (std::is_integral_v<T>) {
        const auto whole = load_integer(from, type, std::endian::big);
        if (!whole)
          fail(file_, "point " + std::to_string(i),
               name + " is " + shown(load_real<double>(from, type, std::endian::big)) +
                   ", must be a whole number of 64 bits");
        values[i] = *whole;
      } else {
        values[i] = load_real<T>(from, type, std::endian::big);
      }
    }
    cursor_.move_to(cursor_.offset() + count * size);
    return values;
  }

  /// Data begins right after the end of the line that announces it.
  void begin_binary(const std::string& name) {
    const auto rest = cursor_.next_line();
    if (!rest) return;  // no line end: checked_count finds what is missing
    if (rest->find_first_not_of(" \t") != std::string_view::npos)
      fail_here("found " + in_quotes(*rest) + ", wanted the line end before the data of " + name);
  }

  std::size_t product(const std::string& name, std::size_t a, std::size_t b) {
    std::size_t result = 0;
    if (__builtin_mul_overflow(a, b, &result)) fail_here("the size of " + name + " is too large");
    return result;
  }

  /// tuples * components, once the rest of the file is known to hold as many values of at least
  /// `smallest` bytes: a count is not believed before memory is taken for it.
  std::size_t checked_count(const std::string& name, std::size_t tuples, std::size_t components,
                            std::size_t smallest) {
    const std::size_t count = product(name, tuples, components);
    if (count > cursor_.remaining() / smallest)
      fail(file_, byte_place(cursor_.offset()),
           "the file ends at byte " + std::to_string(file_.size()) + ", wanted " +
               std::to_string(count) + " values of " + name + " of at least " +
               std::to_string(smallest) + " bytes each (truncated?)");
    return count;
  }

  std::string next_name(const std::string& of) {
    const std::string_view token = cursor_.next_token();
    if (token.empty()) fail_here("the file ends here, wanted the name of " + of + " (truncated?)");
    return std::string(token);
  }

  std::string next_type() { return lower_case(cursor_.next_token()); }

  Scalar known_type(const std::string& type, const std::string& name) {
    const auto found = scalar_named(kVtkTypes, type);
    if (!found) fail_here("found type " + in_quotes(type) + " of " + name + ", wanted a VTK type");
    return *found;
  }

  [[noreturn]] void fail_here(const std::string& message) {
    fail(file_, binary_ ? byte_place(cursor_.offset()) : cursor_.place(), message);
  }

  const InputFile& file_;
  const ReadOptions& options_;
  TextCursor cursor_;
  std::vector<NamedArray> arrays_;         // of the points, where attributes are asked for
  std::vector<std::vector<float>> found_;  // values of those that are
  bool binary_ = false;
  bool has_points_ = false;
  Section section_ = Section::dataset;
  std::size_t tuples_ = 0;      // of the arrays in this section
  std::size_t components_ = 0;  // of the array read last
  Particles particles_;
};

}  // namespace

Particles read_vtk(const InputFile& file, const ReadOptions& options) {
  return VtkReader(file, options).read();
}

}  // namespace meniscus
