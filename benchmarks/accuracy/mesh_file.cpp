#include "accuracy/mesh_file.hpp"

#include <map>
#include <sstream>
#include <vector>

#include "io/input_file.hpp"
#include "io/scalar.hpp"
#include "io/text_cursor.hpp"

namespace meniscus::accuracy {
namespace {

struct Property {
  std::string name;
  Scalar type, count_type;  // count_type: of a list
  bool list = false;
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  std::vector<Element> elements;
  std::size_t data = 0;  // offset
};

Scalar scalar_named(const InputFile& file, const std::string& place, const std::string& name) {
  static const std::map<std::string, Scalar> kNames{
      {"uchar", Scalar::uint8},    {"uint8", Scalar::uint8},     {"int", Scalar::int32},
      {"int32", Scalar::int32},    {"uint", Scalar::uint32},     {"uint32", Scalar::uint32},
      {"float", Scalar::float32},  {"float32", Scalar::float32}, {"double", Scalar::float64},
      {"float64", Scalar::float64}};
  const auto found = kNames.find(name);
  if (found == kNames.end())
    fail(file, place, "type " + in_quotes(name) + ", wanted uchar, int, uint, float or double");
  return found->second;
}

Header read_header(const InputFile& file) {
  Header header;
  TextCursor cursor(file);
  if (cursor.next_line() != "ply") fail(file, "line 1", "is not \"ply\"");
  for (;;) {
    const auto line = cursor.next_line();
    if (!line) fail(file, "header", "has no end_header");
    std::istringstream stream{std::string(*line)};
    std::string key, type, name;
    stream >> key;
    if (key == "end_header") break;
    if (key == "format") {
      stream >> name;
      if (name != "binary_little_endian")
        fail(file, cursor.place(), "format " + in_quotes(name) + ", wanted binary_little_endian");
    } else if (key == "element") {
      Element element;
      stream >> element.name >> element.count;
      header.elements.push_back(element);
    } else if (key == "property") {
      if (header.elements.empty()) fail(file, cursor.place(), "property before any element");
      Property property{"", Scalar::uint8, Scalar::uint8, false};
      stream >> type;
      if (type == "list") {
        property.list = true;
        stream >> type;
        property.count_type = scalar_named(file, cursor.place(), type);
        stream >> type;
      }
      property.type = scalar_named(file, cursor.place(), type);
      stream >> property.name;
      header.elements.back().properties.push_back(property);
    }
  }
  header.data = cursor.offset();
  return header;
}

/// Walks through the data; throws where the file ends too early.
class Reader {
 public:
  Reader(const InputFile& file, std::size_t at) : file_(file), at_(at) {}
  template <class Number>
  Number next(Scalar type) {
    const std::size_t size = size_of(type);
    if (file_.size() - at_ < size) fail(file_, byte_place(at_), "the file ends here (truncated?)");
    const auto value = load_real<double>(file_.bytes.data() + at_, type, std::endian::little);
    at_ += size;
    return static_cast<Number>(value);
  }

 private:
  const InputFile& file_;
  std::size_t at_;
};

void read_vertices(const Element& element, Reader& reader, Mesh& mesh) {
  for (std::size_t k = 0; k < element.count; ++k) {
    Vec3 position, normal;
    bool has_normal = false;
    for (const Property& property : element.properties) {
      const float value = reader.next<float>(property.type);
      if (property.name == "x") position.x = value;
      if (property.name == "y") position.y = value;
      if (property.name == "z") position.z = value;
      if (property.name == "nx") normal.x = value;
      if (property.name == "ny") normal.y = value;
      if (property.name == "nz") normal.z = value;
      has_normal = has_normal || property.name == "nx";
    }
    mesh.position.push_back(position);
    if (has_normal) mesh.normal.push_back(normal);
  }
}

void read_faces(const InputFile& file, const Element& element, Reader& reader, Mesh& mesh) {
  for (std::size_t k = 0; k < element.count; ++k) {
    const std::string place = "face " + std::to_string(k);
    const Property& list = element.properties[0];
    const auto corners = reader.next<std::uint32_t>(list.count_type);
    if (corners != 3)
      fail(file, place, "has " + std::to_string(corners) + " corners, wanted triangles");
    std::array<std::uint32_t, 3> triangle{};
    for (std::uint32_t& corner : triangle) {
      const double value = reader.next<double>(list.type);
      if (!(value >= 0 && value < static_cast<double>(mesh.position.size())))
        fail(file, place,
             "names vertex " + shown(value) + " of " + std::to_string(mesh.position.size()));
      corner = static_cast<std::uint32_t>(value);
    }
    mesh.triangle.push_back(triangle);
  }
}

}  // namespace

Mesh read_mesh(const std::string& path) {
  const InputFile file = read_file(path);
  const Header header = read_header(file);
  Reader reader(file, header.data);
  Mesh mesh;
  for (const Element& element : header.elements) {
    bool has_list = false;
    for (const Property& property : element.properties) has_list = has_list || property.list;
    if (element.name == "vertex" && !has_list)
      read_vertices(element, reader, mesh);
    else if (element.name == "face" && has_list && element.properties.size() == 1)
      read_faces(file, element, reader, mesh);
    else
      fail(file, "element " + element.name,
           "is unknown, wanted vertex with numbers and then face with one list");
  }
  return mesh;
}

}  // namespace meniscus::accuracy
