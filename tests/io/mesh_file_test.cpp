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

Mesh carrying_mesh() {
  Mesh mesh = hard_mesh();
  for (std::size_t k = 0; k < mesh.position.size(); ++k) {
    mesh.velocity.push_back({0.1f, -1.0f / 3, static_cast<float>(k)});
    for (const char* name : {"heat", "vx", "<a & \"b\">"}) {
      if (k == 0) mesh.attributes.push_back({name, {}});
      for (Attribute& attribute : mesh.attributes)
        if (attribute.name == name) attribute.values.push_back(0.3f * static_cast<float>(k));
    }
  }
  return mesh;
}

TEST(MeshFile, VtpReadsBackWithAllThatItCarries) {
  const TemporaryFolder folder;
  const Mesh mesh = carrying_mesh();
  write_mesh(folder / "a.vtp", mesh);
  const Particles p = read_particles(
      folder / "a.vtp", ReadOptions{.attributes = {"heat", "vx", "<a & \"b\">", "normals"}});
  ASSERT_EQ(p.size(), mesh.position.size());
  ASSERT_EQ(p.attributes.size(), 6u);
  for (std::size_t k = 0; k < p.size(); ++k) {
    EXPECT_TRUE(same_bits(std::vector<Vec3>{{p.x[k], p.y[k], p.z[k]}}, {mesh.position[k]}));
    EXPECT_EQ((Vec3{p.vx[k], p.vy[k], p.vz[k]}), mesh.velocity[k]);
    EXPECT_EQ(
        (Vec3{p.attributes[3].values[k], p.attributes[4].values[k], p.attributes[5].values[k]}),
        mesh.normal[k]);
    for (std::size_t a = 0; a < 3; ++a)
      EXPECT_EQ(p.attributes[a].values[k], mesh.attributes[a].values[k]);
  }
}

TEST(MeshFile, VtpAndGlbAreUtf8WhateverNamesAre) {
  const TemporaryFolder folder;
  Mesh mesh = carrying_mesh();
  mesh.attributes[0].name = "caf\xe9\x01";  // Latin-1, and a control character
  write_mesh(folder / "a.vtp", mesh);
  EXPECT_THAT(file_bytes(folder / "a.vtp"), HasSubstr("Name=\"caf\ufffd\ufffd\""));
  write_mesh(folder / "a.glb", mesh);
  EXPECT_THAT(file_bytes(folder / "a.glb"), HasSubstr("\"_caf\ufffd\ufffd\":"));
}

TEST(MeshFile, PlyReadsBackWithAllThatItCarries) {
  const TemporaryFolder folder;
  const Mesh mesh = carrying_mesh();
  write_mesh(folder / "a.ply", mesh);
  const Particles p =
      read_particles(folder / "a.ply", ReadOptions{.attributes = {"heat", "particle.vx"}});
  EXPECT_TRUE(same_bits(p.attributes[0].values, mesh.attributes[0].values));
  EXPECT_TRUE(same_bits(p.attributes[1].values, mesh.attributes[1].values));
  for (std::size_t k = 0; k < p.size(); ++k) EXPECT_EQ(p.vy[k], mesh.velocity[k].y);

  Mesh alike = mesh;  // two names that are the same word
  alike.attributes[0].name = "a b";
  alike.attributes[1].name = "a_b";
  write_mesh(folder / "a.ply", alike);
  const Particles both =
      read_particles(folder / "a.ply", ReadOptions{.attributes = {"a_b", "a_b_"}});
  EXPECT_TRUE(same_bits(both.attributes[0].values, mesh.attributes[0].values));
  EXPECT_TRUE(same_bits(both.attributes[1].values, mesh.attributes[1].values));
}

TEST(MeshFile, GlbAndStlAreAsLongAsTheySay) {
  const TemporaryFolder folder;
  for (const Mesh& mesh : {carrying_mesh(), Mesh{}}) {
    write_mesh(folder / "a.glb", mesh);
    const std::string glb = file_bytes(folder / "a.glb");
    const auto word = [&](std::size_t at) {
      std::uint32_t value = 0;
      std::memcpy(&value, glb.data() + at, 4);
      return value;
    };
    ASSERT_GE(glb.size(), 20u);
    EXPECT_EQ(glb.substr(0, 4), "glTF");
    EXPECT_EQ(word(8), glb.size());
    EXPECT_EQ(word(12) % 4, 0u);
    EXPECT_EQ(glb[20], '{');
    const std::size_t values =
        mesh.position.size() * (9 + mesh.attributes.size()) * 4 + mesh.triangle.size() * 12;
    EXPECT_EQ(glb.size(), 20 + word(12) + (mesh.position.empty() ? 0 : 8 + values));
    write_mesh(folder / "a.stl", mesh);
    EXPECT_EQ(file_bytes(folder / "a.stl").size(), 84 + 50 * mesh.triangle.size());
  }
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
  mesh = carrying_mesh();
  mesh.attributes[1].values.pop_back();
  for (const char* name : {"a.ply", "a.vtp", "a.glb", "a.stl"})
    EXPECT_THROW(write_mesh(folder / name, mesh), InvalidArgument);
  EXPECT_THAT(folder.entries(), testing::IsEmpty());
}

}  // namespace
}  // namespace meniscus
