#include <gmock/gmock.h>

#include <cstring>
#include <limits>
#include <sstream>

#include "io/sample_surface.hpp"
#include "io/temporary_folder.hpp"
#include "meniscus/error.hpp"
#include "meniscus/io.hpp"
#include "same_bits.hpp"

namespace meniscus {
namespace {

using testing::HasSubstr;

// Values whose text and bytes are hard to keep.
Mesh hard_mesh() {
  Mesh mesh = sample_surface(sample_camera(4, 4)).mesh;
  using Limits = std::numeric_limits<float>;
  mesh.position[0] = {Limits::max(), Limits::denorm_min(), -0.0f};
  mesh.position[1] = {0.1f, -1.0f / 3, 16777217.0f};
  mesh.position[2] = {Limits::lowest(), Limits::min(), -1.17549421e-38f};
  return mesh;
}

void expect_same(const Mesh& actual, const Mesh& expected) {
  EXPECT_TRUE(same_bits(actual.position, expected.position));
  EXPECT_TRUE(same_bits(actual.normal, expected.normal));
  EXPECT_EQ(actual.triangle, expected.triangle);
}

Mesh parse_ply(const std::string& bytes) {
  const std::string end = "end_header\n";
  const std::size_t body = bytes.find(end) + end.size();
  std::istringstream header(bytes.substr(0, body));
  std::vector<std::string> lines;
  for (std::string line; std::getline(header, line);)
    if (!line.starts_with("comment ")) lines.push_back(line);
  std::size_t vertices = 0, faces = 0;
  if (lines.size() != 12 || std::sscanf(lines[2].c_str(), "element vertex %zu", &vertices) != 1 ||
      std::sscanf(lines[9].c_str(), "element face %zu", &faces) != 1) {
    ADD_FAILURE() << "header:\n" << header.str();
    return {};
  }
  EXPECT_THAT(lines, testing::ElementsAre("ply", "format binary_little_endian 1.0",
                                          HasSubstr("element vertex "), "property float x",
                                          "property float y", "property float z",
                                          "property float nx", "property float ny",
                                          "property float nz", HasSubstr("element face "),
                                          "property list uchar int vertex_indices", "end_header"));
  Mesh mesh;
  EXPECT_EQ(bytes.size(), body + vertices * 24 + faces * 13);
  const char* at = bytes.data() + body;
  for (std::size_t k = 0; k < vertices; ++k, at += 24) {
    std::memcpy(&mesh.position.emplace_back(), at, 12);
    std::memcpy(&mesh.normal.emplace_back(), at + 12, 12);
  }
  for (std::size_t k = 0; k < faces; ++k, at += 13) {
    EXPECT_EQ(*at, 3);
    std::memcpy(&mesh.triangle.emplace_back(), at + 1, 12);
  }
  return mesh;
}

Mesh parse_obj(const std::string& text) {
  Mesh mesh;
  std::istringstream file(text);
  for (std::string line; std::getline(file, line);) {
    Vec3 v;
    std::array<std::uint32_t, 6> f{};
    if (line.starts_with("#")) continue;
    if (std::sscanf(line.c_str(), "v %f %f %f", &v.x, &v.y, &v.z) == 3)
      mesh.position.push_back(v);
    else if (std::sscanf(line.c_str(), "vn %f %f %f", &v.x, &v.y, &v.z) == 3)
      mesh.normal.push_back(v);
    else if (std::sscanf(line.c_str(), "f %u//%u %u//%u %u//%u", &f[0], &f[1], &f[2], &f[3], &f[4],
                         &f[5]) == 6) {
      EXPECT_EQ((std::array{f[0], f[2], f[4]}), (std::array{f[1], f[3], f[5]}));
      mesh.triangle.push_back({f[0] - 1, f[2] - 1, f[4] - 1});
    } else {
      ADD_FAILURE() << line;
    }
  }
  return mesh;
}

TEST(MeshFile, PlyKeepsEveryBit) {
  const TemporaryFolder folder;
  write_mesh(folder / "a.ply", hard_mesh());
  expect_same(parse_ply(file_bytes(folder / "a.ply")), hard_mesh());
  EXPECT_THAT(file_bytes(folder / "a.ply"), HasSubstr("world units"));
}

TEST(MeshFile, PlyHasVelocitiesWhereTheMeshDoes) {
  const TemporaryFolder folder;
  Mesh mesh = hard_mesh();
  mesh.velocity = {{1, 2, 3}, {-0.0f, 1e-42f, 3e38f}, {0, 0, 0}, {7, 8, 9}};
  write_mesh(folder / "a.ply", mesh);
  const std::string bytes = file_bytes(folder / "a.ply"), end = "end_header\n";
  EXPECT_THAT(bytes, HasSubstr("property float nz\nproperty float vx\nproperty float vy\n"
                               "property float vz\nelement face 2\n"));
  EXPECT_THAT(bytes, HasSubstr("comment vx vy vz: velocity, world units per second\n"));
  const std::size_t body = bytes.find(end) + end.size();
  ASSERT_EQ(bytes.size(), body + 4 * 36 + 2 * 13);
  for (std::size_t k = 0; k < 4; ++k) {
    const char* at = bytes.data() + body + 36 * k;
    EXPECT_EQ(std::memcmp(at, &mesh.position[k], 12), 0);
    EXPECT_EQ(std::memcmp(at + 12, &mesh.normal[k], 12), 0);
    EXPECT_EQ(std::memcmp(at + 24, &mesh.velocity[k], 12), 0);
  }
  mesh.velocity.pop_back();
  EXPECT_THROW(write_mesh(folder / "b.ply", mesh), InvalidArgument);
}

TEST(MeshFile, ObjKeepsEveryBit) {
  const TemporaryFolder folder;
  write_mesh(folder / "a.OBJ", hard_mesh());
  expect_same(parse_obj(file_bytes(folder / "a.OBJ")), hard_mesh());
  EXPECT_THAT(file_bytes(folder / "a.OBJ"), HasSubstr("\nv 0.1 -0.33333334 16777216\n"));
}

TEST(MeshFile, AnEmptyMeshIsAValidFile) {
  const TemporaryFolder folder;
  write_mesh(folder / "a.ply", {});
  write_mesh(folder / "a.obj", {});
  expect_same(parse_ply(file_bytes(folder / "a.ply")), {});
  expect_same(parse_obj(file_bytes(folder / "a.obj")), {});
}

TEST(MeshFile, RefusesWhatIsNotAMesh) {
  const TemporaryFolder folder;
  Mesh mesh = hard_mesh();
  EXPECT_THROW(write_mesh(folder / "a.off", mesh), OutputError);
  EXPECT_THROW(write_mesh("ply", mesh), OutputError);
  mesh.triangle[1][2] = 4;
  EXPECT_THROW(write_mesh(folder / "a.ply", mesh), InvalidArgument);
  mesh = hard_mesh();
  mesh.normal.pop_back();
  EXPECT_THROW(write_mesh(folder / "a.obj", mesh), InvalidArgument);
  EXPECT_THAT(folder.entries(), testing::IsEmpty());
}

}  // namespace
}  // namespace meniscus
