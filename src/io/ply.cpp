#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <sstream>
#include <string>
#include <unordered_set>
#include <vector>

#include "io/attribute_names.hpp"
#include "io/bytes.hpp"
#include "io/fields.hpp"
#include "io/readers.hpp"
#include "io/rows.hpp"
#include "io/scalar.hpp"
#include "io/text_cursor.hpp"

namespace meniscus {
namespace {

struct Property {
  std::string name;
  Scalar type;
  std::optional<Scalar> list_count;  // type of a list's length; none: a scalar
  Field field = Field::none;
  std::vector<std::size_t> attributes{};  // that it is
};

struct Element {
  std::string name;  // for messages
  std::size_t count = 0;
  std::vector<Property> properties;
  bool is_vertex() const { return name == "vertex"; }
};

struct Header {
  bool ascii = false;
  std::endian order = std::endian::little;
  std::vector<Element> elements;
  Particles stated;  // time and particle radius
  std::size_t data_offset = 0;
  std::size_t data_line = 1;
};

constexpr std::pair<const char*, Scalar> kPlyTypes[] = {
    {"char", Scalar::int8},       {"int8", Scalar::int8},      {"uchar", Scalar::uint8},
    {"uint8", Scalar::uint8},     {"short", Scalar::int16},    {"int16", Scalar::int16},
    {"ushort", Scalar::uint16},   {"uint16", Scalar::uint16},  {"int", Scalar::int32},
    {"int32", Scalar::int32},     {"uint", Scalar::uint32},    {"uint32", Scalar::uint32},
    {"int64", Scalar::int64},     {"uint64", Scalar::uint64},  {"float", Scalar::float32},
    {"float32", Scalar::float32}, {"double", Scalar::float64}, {"float64", Scalar::float64}};

/// Takes "time T" and "particle_radius R" (0: none) from a comment; other text is left alone.
void read_comment(const std::vector<std::string>& words, const InputFile& file,
                  const std::string& place, Particles& stated) {
  for (std::size_t i = 1; i + 1 < words.size(); ++i) {
    double* const to = words[i] == "time"              ? &stated.time
                       : words[i] == "particle_radius" ? &stated.particle_radius
                                                       : nullptr;
    if (!to) continue;
    if (exceeds_double(words[i + 1]))
      fail(
          file, place,
          "found " + in_quotes(words[i + 1]) + " for " + words[i] + ", wanted a number of 64 bits");
    *to = parse_real(words[i + 1]).value_or(*to);
  }
}

Property read_property(const std::vector<std::string>& words, const InputFile& file,
                       const std::string& place) {
  const bool list = words.size() == 5 && words[1] == "list";
  if (!list && words.size() != 3)
    fail(file, place, "wanted \"property TYPE NAME\" or \"property list TYPE TYPE NAME\"");
  const auto type = [&](const std::string& name) {
    const std::optional<Scalar> found = scalar_named(kPlyTypes, name);
    if (!found)
      fail(file, place, "unknown type " + in_quotes(name) + " of property " + shown(words.back()));
    return *found;
  };
  Property property{words.back(), type(words[words.size() - 2]), std::nullopt};
  if (list) {
    property.list_count = type(words[2]);
    if (!is_whole(*property.list_count))
      fail(file, place, "the length of list " + shown(property.name) + " must have a whole type");
  }
  return property;
}

void match_vertex_fields(Header& header, const InputFile& file, const ReadOptions& options) {
  const auto vertex = std::find_if(header.elements.begin(), header.elements.end(),
                                   [](const Element& element) { return element.is_vertex(); });
  if (vertex == header.elements.end()) fail(file, "header", "has no element vertex");
  std::vector<std::string> names;
  for (const Property& property : vertex->properties)
    names.push_back(property.list_count ? "" : property.name);
  const std::vector<Field> fields = fields_of_columns(names);
  if (const std::string missing = missing_coordinate(fields); !missing.empty())
    fail(file, "header", "element vertex has no property " + missing);
  for (std::size_t i = 0; i < fields.size(); ++i) vertex->properties[i].field = fields[i];
  for (const AttributePick& pick : pick_attributes(file.name, names, options.attributes)) {
    vertex->properties[pick.array].attributes.push_back(header.stated.attributes.size());
    header.stated.attributes.push_back({pick.name, {}});
  }
}

Header read_header(const InputFile& file, const ReadOptions& options) {
  Header header;
  TextCursor cursor(file);
  if (const auto first = cursor.next_line(); first != "ply")
    fail(file, "line 1", "found " + (first ? in_quotes(*first) : "nothing") + ", wanted \"ply\"");
  // Where lines end in a lone \r, a \n after the header already belongs to the data.
  const bool lone_return = file.bytes[cursor.offset() - 1] == '\r';
  bool has_format = false;
  std::unordered_set<std::string> elements;  // their names
  for (;;) {
    const auto line = cursor.next_line();
    if (!line || !cursor.line_was_ended())
      fail(file, cursor.place(), "the file ends inside the header, wanted \"end_header\"");
    std::istringstream stream{std::string(*line)};
    std::vector<std::string> words;
    for (std::string word; stream >> word;) words.push_back(word);
    if (words.empty()) continue;
    const std::string& key = words[0];
    if (key == "end_header") break;
    if (key == "comment" || key == "obj_info") {
      read_comment(words, file, cursor.place(), header.stated);
    } else if (key == "format") {
      const std::string name = words.size() > 1 ? words[1] : "";
      if (name != "ascii" && name != "binary_little_endian" && name != "binary_big_endian")
        fail(file, cursor.place(),
             "found format " + in_quotes(name) +
                 ", wanted ascii, binary_little_endian or binary_big_endian");
      header.ascii = name == "ascii";
      if (name == "binary_big_endian") header.order = std::endian::big;
      has_format = true;
    } else if (key == "element") {
      const auto count = words.size() == 3 ? parse_integer(words[2]) : std::nullopt;
      if (!count || *count < 0)
        fail(file, cursor.place(), "found " + in_quotes(*line) + ", wanted \"element NAME COUNT\"");
      if (!elements.insert(words[1]).second)
        fail(file, cursor.place(), "element " + in_quotes(words[1]) + " appears twice");
      header.elements.push_back({shown(words[1]), static_cast<std::size_t>(*count), {}});
    } else if (key == "property") {
      if (header.elements.empty()) fail(file, cursor.place(), "property before any element");
      header.elements.back().properties.push_back(read_property(words, file, cursor.place()));
    } else {
      fail(file, cursor.place(), "unknown header line " + in_quotes(*line));
    }
  }
  if (!has_format) fail(file, "header", "has no format line");
  match_vertex_fields(header, file, options);
  header.data_offset = cursor.offset();
  if (lone_return && file.bytes[header.data_offset - 1] == '\n') --header.data_offset;
  header.data_line = cursor.line();
  return header;
}

std::string row_place(const Element& element, std::size_t row) {
  return element.name + " " + std::to_string(row);
}

/// Fails unless the rest of the file can hold the rows of an element that take at least
/// `smallest` bytes each: a count is not believed before memory is taken for it.
void check_room(const InputFile& file, const Element& element, std::size_t offset,
                std::size_t smallest) {
  const std::size_t rows = (file.size() - offset) / smallest;
  if (element.count > rows)
    fail(file, row_place(element, rows),
         "the file ends at byte " + std::to_string(file.size()) + ", wanted " +
             std::to_string(element.count) + " rows of " + element.name + " from byte " +
             std::to_string(offset) + ", of at least " + std::to_string(smallest) +
             " bytes each (truncated?)");
}

std::vector<Field> fields_of(const Element& element) {
  std::vector<Field> fields;
  for (const Property& property : element.properties) fields.push_back(property.field);
  return fields;
}

// For the values of the vertices.
void make_room(const Element& element, Particles& particles) {
  resize(particles, fields_of(element), element.count);
  for (Attribute& attribute : particles.attributes) attribute.values.resize(element.count);
}

// Reads a row of an element from byte `at` on, values of vertices into the particles. Returns where
// the row ends.
std::size_t read_row(const InputFile& file, std::endian order, const Element& element,
                     std::size_t row, std::size_t at, Particles& particles) {
  const auto need = [&](std::size_t n, std::size_t size, const Property& property) {
    if ((file.size() - at) / size < n)
      fail(file, row_place(element, row),
           "the file ends at byte " + std::to_string(file.size()) + ", wanted " +
               std::to_string(n) + " x " + std::to_string(size) + " bytes of property " +
               shown(property.name) + " from byte " + std::to_string(at) + " (truncated?)");
  };
  for (const Property& property : element.properties) {
    const std::size_t size = size_of(property.type);
    if (property.list_count) {
      need(1, size_of(*property.list_count), property);
      const auto length = load_integer(file.bytes.data() + at, *property.list_count, order);
      if (!length || *length < 0)
        fail(file, row_place(element, row),
             "the length of list " + shown(property.name) + " at byte " + std::to_string(at) +
                 " is out of range, must be >= 0");
      at += size_of(*property.list_count);
      need(static_cast<std::size_t>(*length), size, property);
      at += static_cast<std::size_t>(*length) * size;
      continue;
    }
    need(1, size, property);
    const char* const from = file.bytes.data() + at;
    if (property.field == Field::id) {
      const auto id = load_integer(from, property.type, order);
      if (!id)
        fail(file, row_place(element, row),
             "id is " + shown(load_real<double>(from, property.type, order)) +
                 ", must be a whole number of 64 bits");
      particles.id[row] = *id;
    } else if (property.field != Field::none) {
      array_of(particles, property.field)[row] = load_real<float>(from, property.type, order);
    }
    for (const std::size_t k : property.attributes)
      particles.attributes[k].values[row] = load_real<float>(from, property.type, order);
    at += size;
  }
  return at;
}

void read_binary(const InputFile& file, const Header& header, Particles& particles) {
  std::size_t at = header.data_offset;
  for (const Element& element : header.elements) {
    if (element.properties.empty()) continue;
    std::size_t smallest = 0;
    bool has_list = false;
    for (const Property& property : element.properties) {
      smallest += size_of(property.list_count.value_or(property.type));
      has_list = has_list || property.list_count;
    }
    check_room(file, element, at, smallest);
    if (!element.is_vertex() && !has_list) {
      at += element.count * smallest;
      continue;
    }
    if (element.is_vertex()) make_room(element, particles);
    for (std::size_t row = 0; row < element.count; ++row)
      at = read_row(file, header.order, element, row, at, particles);
  }
  TextCursor rest(file, at);
  rest.skip_blanks();
  if (rest.remaining() > 0)
    fail(file, byte_place(at),
         std::to_string(file.size() - at) + " bytes more than the header says (is a count wrong?)");
}

void read_ascii(const InputFile& file, const Header& header, Particles& particles) {
  TextCursor cursor(file, header.data_offset, header.data_line);
  for (const Element& element : header.elements) {
    if (element.properties.empty()) continue;
    check_room(file, element, cursor.offset(), 2 * element.properties.size());
    if (element.is_vertex()) make_room(element, particles);
    std::vector<std::string> wanted;
    for (const Property& property : element.properties)
      wanted.push_back("property " + shown(property.name) + " of element " + element.name);
    for (std::size_t row = 0; row < element.count; ++row) {
      for (std::size_t k = 0; k < wanted.size(); ++k) {
        const Property& property = element.properties[k];
        if (property.list_count) {
          for (std::size_t left = cursor.count(wanted[k]); left > 0; --left) cursor.real(wanted[k]);
        } else if (property.field == Field::id) {
          particles.id[row] = cursor.integer(wanted[k]);
          for (const std::size_t a : property.attributes)
            particles.attributes[a].values[row] = static_cast<float>(particles.id[row]);
        } else {
          const double value = cursor.real(wanted[k]);
          if (property.field != Field::none)
            array_of(particles, property.field)[row] = static_cast<float>(value);
          for (const std::size_t a : property.attributes)
            particles.attributes[a].values[row] = static_cast<float>(value);
        }
      }
    }
  }
  if (const auto token = cursor.next_token(); !token.empty())
    fail(file, cursor.place(),
         "found " + in_quotes(token) + " after the last row (is a count in the header wrong?)");
}

}  // namespace

std::optional<RowLayout> ply_rows(const InputFile& head, std::uint64_t file_size,
                                  const ReadOptions& options) {
  const Header header = read_header(head, options);
  if (header.ascii || !std::isfinite(header.stated.time)) return std::nullopt;
  RowLayout rows;
  rows.order = header.order;
  rows.particle_radius = header.stated.particle_radius;
  for (const Attribute& attribute : header.stated.attributes)
    rows.attributes.push_back(attribute.name);
  std::uint64_t at = header.data_offset;
  for (const Element& element : header.elements) {
    std::size_t size = 0;
    for (const Property& property : element.properties) {
      if (property.list_count) return std::nullopt;
      if (element.is_vertex() && property.field != Field::none)
        rows.columns.push_back({property.field, size, property.type});
      for (const std::size_t k : property.attributes)
        rows.columns.push_back({Field::none, size, property.type, k});
      size += size_of(property.type);
    }
    if (size == 0) continue;
    if (element.count > (file_size - at) / size) return std::nullopt;
    if (element.is_vertex()) {
      rows.count = static_cast<std::int64_t>(element.count);
      rows.offset = at;
      rows.stride = size;
    }
    at += element.count * size;
  }
  if (at != file_size) return std::nullopt;
  return rows;
}

bool has_faces(const std::string& path) {
  try {
    const auto bytes = bytes_of_file(path);
    constexpr std::uint64_t kLongest = std::uint64_t{1} << 16;  // a header, bytes
    const InputFile head{
        path, text_at(*bytes, 0, static_cast<std::size_t>(std::min(kLongest, bytes->size())))};
    const Header header = read_header(head, {});
    return std::any_of(header.elements.begin(), header.elements.end(), [](const Element& element) {
      return element.name == "face" && element.count > 0;
    });
  } catch (const InputError&) {
    return false;
  }
}

Particles read_ply(const InputFile& file, const ReadOptions& options) {
  const Header header = read_header(file, options);
  Particles particles = header.stated;
  if (header.ascii)
    read_ascii(file, header, particles);
  else
    read_binary(file, header, particles);
  return particles;
}

}  // namespace meniscus
