// Reading meshes and seeing them through a lens.
#include "accuracy/ray_cast.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "accuracy/contenders.hpp"
#include "accuracy/mesh_file.hpp"
#include "accuracy/peers.hpp"
#include "accuracy/truth.hpp"
#include "io/temporary_folder.hpp"
#include "meniscus/error.hpp"
#include "thrown.hpp"

namespace meniscus::accuracy {
namespace {

/// A sphere of 12 s around the origin, as the scene has it, from `rings` of 2 `rings` vertices.
Mesh ball(int rings) {
  Mesh mesh;
  for (int i = 0; i <= rings; ++i)
    for (int j = 0; j < 2 * rings; ++j) {
      const double a = std::numbers::pi * i / rings, b = std::numbers::pi * j / rings;
      const Vec3d n{std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)};
      mesh.position.push_back(static_cast<Vec3>(12 * n));
      mesh.normal.push_back(static_cast<Vec3>(n));
    }
  const auto at = [&](int i, int j) {
    return static_cast<std::uint32_t>(2 * rings * i + j % (2 * rings));
  };
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < 2 * rings; ++j) {
      mesh.triangle.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangle.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

TEST(RayCast, BallIsTheSphere) {
  constexpr int kRings = 200;
  const Mesh mesh = ball(kRings);
  for (const bool orthographic : {false, true}) {
    const Scene& scene = find_scene("sphere");
    const Truth truth = trace(scene, lens_of(scene, orthographic));
    const Map map = ray_cast(mesh, truth.lens);
    // A chord over an angle of h lies R h^2 / 8 inside, over the diagonal of a cell twice that.
    const double sag = 12 * std::pow(std::numbers::pi / kRings, 2) / 4;
    double worst = 0, worst_normal = 0;
    int mask = 0;
    for (std::size_t p = 0; p < map.depth.size(); ++p) {
      const bool covered = map.depth[p] < INFINITY;
      const Vec3d normal = truth.normal[p];
      const double facing = std::abs(dot(normal, normalized(truth.lens.direction(p))));
      if (covered != truth.covered(p)) ++mask;
      // Near the outline a ray runs far between surface and mesh.
      if (!covered || facing < 0.2) continue;
      worst = std::max(worst, facing * std::abs(map.depth[p] - truth.depth[p]));
      worst_normal = std::max(worst_normal, length(Vec3d(map.normal[p]) - normal));
    }
    EXPECT_LE(worst, 1.5 * sag);  // the ray meets the surface elsewhere, at an angle
    EXPECT_GT(worst, 0.1 * sag) << "the mesh is not the sphere itself";
    EXPECT_LE(worst_normal, 2 * std::numbers::pi / kRings) << "no more than a cell's turn";
    // The outline is 1,300 pixels long and its sag a hundredth of a pixel.
    EXPECT_LE(mask, 1300 / 20);
  }
}

TEST(RayCast, NearestTriangleIsSeenFromEitherSide) {
  Lens lens;
  lens.width = lens.height = 3;
  lens.orthographic = true;
  lens.focal = 1;
  lens.right = {1, 0, 0};
  lens.down = {0, -1, 0};
  lens.forward = {0, 0, -1};
  lens.eye = {0, 0, 10};
  Mesh mesh;  // two triangles that cover the middle pixel, wound in opposite senses
  mesh.position = {{-.4f, -.4f, 1}, {.4f, -.4f, 1}, {0, .4f, 1},
                   {-.4f, -.4f, 4}, {0, .4f, 4},    {.4f, -.4f, 4}};
  mesh.triangle = {{0, 1, 2}, {3, 4, 5}};
  const Map map = ray_cast(mesh, lens);
  for (int p = 0; p < 9; ++p)
    EXPECT_EQ(map.depth[p], p == 4 ? 6 : std::numeric_limits<float>::infinity()) << p;
  EXPECT_EQ(map.normal[4], (Vec3{0, 0, -1})) << "of the triangle, as it is wound";
  EXPECT_EQ(visible_vertices(mesh, lens, map, 0.5).position.size(), 3u);
  EXPECT_EQ(visible_vertices(mesh, lens, map, 3.5).position.size(), 6u);
  EXPECT_EQ(ray_cast({}, lens).depth, std::vector<float>(9, INFINITY));
}

TEST(ReadMesh, ReadsWhatWriteMeshWrites) {
  const TemporaryFolder folder;
  const Mesh mesh = ball(5);
  write_mesh(folder / "ball.ply", mesh);
  const Mesh read = read_mesh(folder / "ball.ply");
  EXPECT_EQ(read.position, mesh.position);
  EXPECT_EQ(read.normal, mesh.normal);
  EXPECT_EQ(read.triangle, mesh.triangle);
}

std::string error_of(const std::string& path) {
  return text_of_thrown<InputError>([&] { read_mesh(path); });
}

TEST(ReadMesh, SaysWhatIsWrong) {
  const TemporaryFolder folder;
  const std::string vertices =
      "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
  const auto error = [&](const std::string& text) {
    std::ofstream(folder / "a.ply", std::ios::binary) << text;
    return error_of(folder / "a.ply");
  };
  using testing::HasSubstr;
  EXPECT_THAT(error("plx\n"), HasSubstr("a.ply: line 1"));
  EXPECT_THAT(error("ply\nformat ascii 1.0\nend_header\n"),
              HasSubstr("wanted binary_little_endian"));
  EXPECT_THAT(
      error("ply\nformat binary_little_endian 1.0\n" + vertices + "end_header\n12345678901"),
      HasSubstr("truncated?"));
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const std::string point(12, '\0');
  EXPECT_THAT(error("ply\nformat binary_little_endian 1.0\n" + vertices + faces + point + '\4'),
              HasSubstr("face 0: has 4 corners"));
  EXPECT_THAT(error("ply\nformat binary_little_endian 1.0\n" + vertices + faces + point + '\3' +
                    std::string("\1\0\0\0", 4)),
              HasSubstr("face 0: names vertex 1 of 1"));
}

TEST(Splashsurf, MissingProgramIsNamed) {
  Particles particles;
  particles.x = particles.y = particles.z = {0};
  const std::string text = text_of_thrown<Error>(
      [&] { reconstruct_with_splashsurf("/nowhere/pysplashsurf", particles, 0.5); });
  EXPECT_THAT(text, testing::HasSubstr("/nowhere/pysplashsurf cannot be run"));
  EXPECT_THAT(text, testing::HasSubstr("--splashsurf"));
  EXPECT_THROW(reconstruct_with_splashsurf("false", particles, 0.5), Error);
}

TEST(SurfaceOf, HasAKindAndAPositionWhereTheMapIsCovered) {
  const Scene& scene = find_scene("sphere");
  const Lens lens = lens_of(scene);
  const Surface surface = surface_of(lens, ray_cast(ball(20), lens), kParticleRadius);
  const std::size_t middle =
      static_cast<std::size_t>(lens.height / 2) * lens.width + lens.width / 2;
  EXPECT_EQ(surface.kind[0], Kind::none);
  EXPECT_EQ(surface.kind[middle], Kind::surface);
  // Within the sag of 20 rings of the sphere.
  EXPECT_NEAR(length(Vec3d(surface.position[middle])), 12,
              12 * std::pow(std::numbers::pi / 20, 2) / 4);
  EXPECT_EQ(surface.camera.width, lens.width);
}

}  // namespace
}  // namespace meniscus::accuracy
