#include "io/mesh_formats.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "base/printable.hpp"
#include "base/rounded_up.hpp"
#include "io/seal.hpp"
#include "meniscus/error.hpp"

namespace meniscus {
namespace {

static_assert(std::endian::native == std::endian::little, "files are in the machine's order");
static_assert(sizeof(Vec3) == 3 * sizeof(float));

struct Array {
  std::string name;
  const char* type;  // of VTK
  std::size_t components;
  const void* values;
  std::uint64_t bytes;
};

std::string tag_of(const Array& array, std::uint64_t& offset) {
  const std::string tag = std::string("<DataArray type=\"") + array.type + "\" Name=\"" +
                          escaped(array.name) + "\" NumberOfComponents=\"" +
                          std::to_string(array.components) + "\" format=\"appended\" offset=\"" +
                          std::to_string(offset) + "\"/>\n";
  offset += sizeof(std::uint64_t) + array.bytes;
  return tag;
}

}  // namespace

std::string free_name(const std::string& attribute, std::initializer_list<std::string_view> taken) {
  return std::find(taken.begin(), taken.end(), attribute) == taken.end() ? attribute
                                                                         : "particle." + attribute;
}

void write_vtp(OutputFile& file, const Mesh& mesh, const std::string& job) {
  const std::uint64_t vertices = mesh.position.size(), triangles = mesh.triangle.size();
  const auto vectors = [&](const char* name, const std::vector<Vec3>& values) {
    return Array{name, "Float32", 3, values.data(), values.size() * sizeof(Vec3)};
  };
  std::vector<Array> at_points{vectors("Normals", mesh.normal)};
  if (!mesh.velocity.empty()) at_points.push_back(vectors("velocity", mesh.velocity));
  for (const Attribute& attribute : mesh.attributes)
    at_points.push_back({free_name(attribute.name, {"Normals", "velocity", "Points"}), "Float32", 1,
                         attribute.values.data(), attribute.values.size() * sizeof(float)});
  std::vector<std::int64_t> corners, ends;
  corners.reserve(3 * triangles);
  for (const auto& triangle : mesh.triangle) {
    for (const std::uint32_t corner : triangle) corners.push_back(corner);
    ends.push_back(static_cast<std::int64_t>(corners.size()));
  }
  const Array points = vectors("Points", mesh.position);
  const Array cells[] = {
      {"connectivity", "Int64", 1, corners.data(), corners.size() * sizeof(std::int64_t)},
      {"offsets", "Int64", 1, ends.data(), ends.size() * sizeof(std::int64_t)}};
  std::uint64_t offset = 0;
  std::string text = "<?xml version=\"1.0\"?>\n";
  const std::string begin = "<!-- ", end = " -->\n";
  for (std::string lines = seal_lines("", job); !lines.empty();) {
    const std::size_t line = lines.find('\n');
    text += begin + lines.substr(0, line) + end;
    lines.erase(0, line + 1);
  }
  text +=
      "<!-- surface mesh by Meniscus: positions in world units, unit normals point outward, "
      "triangles are counter-clockwise seen from outside, velocity in world units per second -->\n"
      "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n<PolyData>\n<Piece NumberOfPoints=\"" +
      std::to_string(vertices) +
      "\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"" +
      std::to_string(triangles) + "\">\n<PointData Normals=\"Normals\"" +
      (mesh.velocity.empty() ? "" : " Vectors=\"velocity\"") + ">\n";
  for (const Array& array : at_points) text += tag_of(array, offset);
  text += "</PointData>\n<Points>\n" + tag_of(points, offset) + "</Points>\n<Polys>\n";
  for (const Array& array : cells) text += tag_of(array, offset);
  text += "</Polys>\n</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_";
  file.write(text);
  std::vector<Array> all = at_points;
  all.push_back(points);
  all.insert(all.end(), std::begin(cells), std::end(cells));
  for (const Array& array : all) {
    file.write(&array.bytes, sizeof array.bytes);
    file.write(array.values, static_cast<std::size_t>(array.bytes));
  }
  file.write("\n</AppendedData>\n</VTKFile>\n");
}

namespace {

// A glTF's JSON, and the values that its views of the buffer show, one after the other.
class GltfMesh {
 public:
  GltfMesh(const Mesh& mesh, const std::string& job) {
    Json extras;
    // The hash first, so that it is within the file's first bytes.
    extras["meniscus.hash"] = kNoHash;
    if (!job.empty()) extras["meniscus.job"] = job;
    root_["asset"] = {{"extras", extras}, {"version", "2.0"}, {"generator", "Meniscus"}};
    const bool is_empty = mesh.position.empty();  // a glTF has no accessor of nothing
    if (!is_empty) add(mesh);
    root_["scenes"].push_back(is_empty ? Json{{"name", "empty"}} : Json{{"nodes", {0}}});
    root_["scene"] = 0;
  }

  std::string json() const {
    std::string text = root_.dump();
    text.resize(rounded_up(text.size(), 4), ' ');
    return text;
  }
  std::uint64_t size() const { return size_; }  // bytes of the values
  void write_values(OutputFile& file) const {
    for (const Values& values : values_)
      file.write(values.first, static_cast<std::size_t>(values.bytes));
  }

 private:
  using Json = nlohmann::ordered_json;
  static constexpr int kFloat = 5126, kUnsigned = 5125, kVertices = 34962, kIndices = 34963;
  struct Values {
    const void* first;
    std::uint64_t bytes;
  };

  // Returns the accessor.
  std::size_t add(const void* values, std::uint64_t bytes, std::uint64_t count, int component,
                  const char* type, int target) {
    root_["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", size_}, {"byteLength", bytes}, {"target", target}});
    root_["accessors"].push_back({{"bufferView", values_.size()},
                                  {"componentType", component},
                                  {"count", count},
                                  {"type", type}});
    values_.push_back({values, bytes});
    size_ += bytes;  // all values have four bytes, so that all begin at a multiple of four
    return values_.size() - 1;
  }

  std::size_t add(const std::vector<Vec3>& vectors) {
    return add(vectors.data(), vectors.size() * sizeof(Vec3), vectors.size(), kFloat, "VEC3",
               kVertices);
  }

  std::size_t add_positions(const std::vector<Vec3>& positions) {
    std::array<float, 3> low{INFINITY, INFINITY, INFINITY}, high{-INFINITY, -INFINITY, -INFINITY};
    for (const Vec3& p : positions) {
      const std::array<float, 3> q{p.x, p.y, p.z};
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], q[k]);
        high[k] = std::max(high[k], q[k]);
      }
    }
    const std::size_t accessor = add(positions);
    root_["accessors"].back()["min"] = low;
    root_["accessors"].back()["max"] = high;
    return accessor;
  }

  void add(const Mesh& mesh) {
    const std::uint64_t vertices = mesh.position.size();
    Json attributes;
    attributes["POSITION"] = add_positions(mesh.position);
    attributes["NORMAL"] = add(mesh.normal);
    if (!mesh.velocity.empty()) attributes["_velocity"] = add(mesh.velocity);
    for (const Attribute& attribute : mesh.attributes)
      attributes[std::string("_").append(well_formed(free_name(attribute.name, {"velocity"})))] =
          add(attribute.values.data(), vertices * sizeof(float), vertices, kFloat, "SCALAR",
              kVertices);
    Json primitive{{"attributes", attributes}, {"mode", 4}};
    if (!mesh.triangle.empty())
      primitive["indices"] =
          add(mesh.triangle.data(), mesh.triangle.size() * sizeof mesh.triangle[0],
              3 * mesh.triangle.size(), kUnsigned, "SCALAR", kIndices);
    else
      primitive["mode"] = 0;  // points
    root_["meshes"].push_back({{"name", "surface"}, {"primitives", {primitive}}});
    root_["nodes"].push_back({{"mesh", 0}, {"name", "surface"}});
    root_["buffers"].push_back({{"byteLength", size_}});
  }

  Json root_;
  std::vector<Values> values_;
  std::uint64_t size_ = 0;
};

}  // namespace

void write_glb(OutputFile& file, const Mesh& mesh, const std::string& job) {
  check_job(job);
  const GltfMesh gltf(mesh, job);
  const std::string text = gltf.json();
  const std::uint64_t whole = 12 + 8 + text.size() + (gltf.size() > 0 ? 8 + gltf.size() : 0);
  require(whole <= std::numeric_limits<std::uint32_t>::max(),
          "write_mesh: " + file.path() + " would have " + std::to_string(whole) +
              " bytes, a .glb has 4 GiB at most (write .ply or .vtp)");
  const auto put = [&](std::uint64_t value) {
    const auto word = static_cast<std::uint32_t>(value);
    file.write(&word, sizeof word);
  };
  file.write("glTF");
  put(2);
  put(whole);
  put(text.size());
  file.write("JSON");
  file.write(text);
  if (gltf.size() == 0) return;
  put(gltf.size());
  file.write(std::string_view("BIN\0", 4));
  gltf.write_values(file);
}

void write_stl(OutputFile& file, const Mesh& mesh, const std::string& job) {
  require(mesh.triangle.size() <= std::numeric_limits<std::uint32_t>::max(),
          "write_mesh: an .stl holds 2^32 - 1 triangles at most");
  file.write(stl_head(job));
  const auto count = static_cast<std::uint32_t>(mesh.triangle.size());
  file.write(&count, sizeof count);
  for (const auto& [i, j, k] : mesh.triangle) {
    const Vec3 &a = mesh.position[i], &b = mesh.position[j], &c = mesh.position[k];
    const double u[3] = {double{b.x} - a.x, double{b.y} - a.y, double{b.z} - a.z};
    const double v[3] = {double{c.x} - a.x, double{c.y} - a.y, double{c.z} - a.z};
    const double n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                         u[0] * v[1] - u[1] * v[0]};
    const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    Vec3 facet[4] = {{}, a, b, c};  // a normal of zero: of a triangle without area
    if (length > 0)
      facet[0] = {static_cast<float>(n[0] / length), static_cast<float>(n[1] / length),
                  static_cast<float>(n[2] / length)};
    char bytes[sizeof facet + 2] = {};
    std::memcpy(bytes, facet, sizeof facet);
    file.write(bytes, sizeof bytes);
  }
}

}  // namespace meniscus
