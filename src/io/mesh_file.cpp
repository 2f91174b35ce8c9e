// Meshes as PLY (binary little endian) and Wavefront OBJ; the others are in mesh_formats.cpp.
#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <set>

#include "io/input_file.hpp"
#include "io/mesh_formats.hpp"
#include "io/output_file.hpp"
#include "io/seal.hpp"
#include "io/writers.hpp"
#include "meniscus/error.hpp"
#include "meniscus/io.hpp"

namespace meniscus {
namespace {

static_assert(std::endian::native == std::endian::little, "PLY is written in the machine's order");
static_assert(sizeof(Vec3) == 3 * sizeof(float));

void check(const Mesh& mesh) {
  const std::size_t vertices = mesh.position.size();
  require(mesh.normal.size() == vertices, "write_mesh: " + std::to_string(mesh.normal.size()) +
                                              " normals for " + std::to_string(vertices) +
                                              " vertices, wanted one each");
  require(mesh.velocity.empty() || mesh.velocity.size() == vertices,
          "write_mesh: " + std::to_string(mesh.velocity.size()) + " velocities for " +
              std::to_string(vertices) + " vertices, wanted one each or none");
  for (const Attribute& attribute : mesh.attributes)
    require(attribute.values.size() == vertices && !attribute.name.empty(),
            "write_mesh: attribute " + attribute.name + " has " +
                std::to_string(attribute.values.size()) + " values for " +
                std::to_string(vertices) + " vertices, wanted one each");
  for (std::size_t k = 0; k < mesh.triangle.size(); ++k)
    for (const std::uint32_t corner : mesh.triangle[k])
      if (corner >= vertices)
        throw InvalidArgument("write_mesh: triangle " + std::to_string(k) + " names vertex " +
                              std::to_string(corner) + " of " + std::to_string(vertices));
}

// Names in a PLY hold no blanks.
std::string one_word(std::string name) {
  for (char& c : name)
    if (c <= ' ' || c == '\x7f') c = '_';
  return name;
}

void write_ply(OutputFile& file, const Mesh& mesh, const std::string& job) {
  const bool moving = !mesh.velocity.empty();
  std::string properties;
  std::set<std::string> names;
  for (const Attribute& attribute : mesh.attributes) {
    std::string name =
        one_word(free_name(attribute.name, {"x", "y", "z", "nx", "ny", "nz", "vx", "vy", "vz"}));
    while (!names.insert(name).second) name += '_';  // "a b" and "a_b" are one word
    properties += "property float " + name + "\n";
  }
  file.write(
      "ply\nformat binary_little_endian 1.0\n"
      "comment surface mesh by Meniscus: positions in world units, normals of unit length point "
      "outward, triangles are counter-clockwise seen from outside\n" +
      std::string(moving ? "comment vx vy vz: velocity, world units per second\n" : "") +
      seal_lines("comment ", job) + "element vertex " + std::to_string(mesh.position.size()) +
      "\nproperty float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\n" +
      (moving ? "property float vx\nproperty float vy\nproperty float vz\n" : "") + properties +
      "element face " + std::to_string(mesh.triangle.size()) +
      "\nproperty list uchar int vertex_indices\nend_header\n");
  for (std::size_t k = 0; k < mesh.position.size(); ++k) {
    const Vec3 vertex[3] = {mesh.position[k], mesh.normal[k], moving ? mesh.velocity[k] : Vec3{}};
    file.write(vertex, (moving ? 3 : 2) * sizeof(Vec3));
    for (const Attribute& attribute : mesh.attributes)
      file.write(&attribute.values[k], sizeof(float));
  }
  for (const auto& triangle : mesh.triangle) {
    char face[1 + sizeof triangle] = {3};
    std::memcpy(face + 1, triangle.data(), sizeof triangle);
    file.write(face, sizeof face);
  }
}

// One line of text, built in place. Floats are printed in the shortest form that reads back to the
// same bits.
class Line {
 public:
  template <typename Number>
  Line& operator<<(Number number) {
    end_ = std::to_chars(end_, text_ + sizeof text_, number).ptr;
    return *this;
  }
  Line& operator<<(const char* text) {
    const std::size_t size = std::strlen(text);
    std::memcpy(end_, text, size);
    end_ += size;
    return *this;
  }
  Line& operator<<(const Vec3& v) { return *this << v.x << " " << v.y << " " << v.z; }
  std::string_view view() const { return {text_, static_cast<std::size_t>(end_ - text_)}; }

 private:
  char text_[128];  // three floats of at most 15 characters, or six integers of at most 10
  char* end_ = text_;
};

void write_obj(OutputFile& file, const Mesh& mesh, const std::string& job) {
  file.write(
      "# surface mesh by Meniscus: positions in world units, normals of unit length point outward, "
      "triangles are counter-clockwise seen from outside\n" +
      seal_lines("# ", job));
  for (const Vec3& v : mesh.position) file.write((Line() << "v " << v << "\n").view());
  for (const Vec3& n : mesh.normal) file.write((Line() << "vn " << n << "\n").view());
  for (const auto& [i, j, k] : mesh.triangle) {
    const std::uint64_t a = i + 1ull, b = j + 1ull, c = k + 1ull;  // OBJ counts from 1
    file.write(
        (Line() << "f " << a << "//" << a << " " << b << "//" << b << " " << c << "//" << c << "\n")
            .view());
  }
}

struct MeshFormat {
  const char* ending;
  OutputFormat format;
  void (*write)(OutputFile&, const Mesh&, const std::string& job);
};

constexpr MeshFormat kFormats[] = {{".ply", OutputFormat::ply, write_ply},
                                   {".vtp", OutputFormat::vtp, write_vtp},
                                   {".glb", OutputFormat::glb, write_glb},
                                   {".obj", OutputFormat::obj, write_obj},
                                   {".stl", OutputFormat::stl, write_stl}};

}  // namespace

bool is_mesh_ending(std::string_view ending) {
  return std::ranges::any_of(kFormats, [&](const auto& format) { return ending == format.ending; });
}

void write_mesh(OutputFile& file, const Mesh& mesh, const std::string& job) {
  for (const MeshFormat& format : kFormats) {
    if (!lower_case(file.path()).ends_with(format.ending)) continue;
    check(mesh);
    format.write(file, mesh, job);
    seal(file, format.format);
    return;
  }
  throw OutputError(file.path() +
                    ": unknown ending for a mesh, wanted .ply, .vtp, .glb, .obj or .stl "
                    "(rename it)");
}

void write_mesh(const std::string& path, const Mesh& mesh) {
  OutputFile file(path);
  write_mesh(file, mesh);
  file.commit();
}

}  // namespace meniscus
