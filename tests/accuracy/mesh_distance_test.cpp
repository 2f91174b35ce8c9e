// Distance of vertices from a sphere.
#include "accuracy/figures/mesh_distance.hpp"

#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>

namespace meniscus::accuracy {
namespace {

TEST(MeshDistance, IsThatOfTheVerticesInside) {
  const Scene& scene = find_scene("sphere");
  const Truth truth = trace(scene, lens_of(scene));
  const Lens& lens = truth.lens;
  Mesh mesh;
  const auto add = [&](double radius, const Vec3d& direction) {
    mesh.position.push_back(static_cast<Vec3>(radius * normalized(direction)));
  };
  const double radius = 12;
  // Coordinates below 16 as floats, and the three of them.
  constexpr double kFloat = 3 * 16 * FLT_EPSILON;
  for (int k = 0; k < 96; ++k)
    add(radius + 0.25, lens.eye + 0.1 * k * lens.right);  // towards the eye
  for (int k = 0; k < 4; ++k) add(radius - 1, lens.eye + 0.1 * k * lens.right);
  // Seen 0.2 s within the outline, and beyond it; behind the eye, and beside the image.
  add(radius - 0.125, lens.right);
  add(radius + 1, lens.down);
  mesh.position.push_back(static_cast<Vec3>(2 * lens.eye));
  mesh.position.push_back(static_cast<Vec3>(40 * lens.right));

  const MeshDistance d = mesh_distance(scene, truth, mesh);
  EXPECT_NEAR(d.rms, std::sqrt((96 * 0.0625 + 4) / 100), kFloat);
  EXPECT_NEAR(d.p95, 0.25, kFloat);
  EXPECT_NEAR(d.p999, 1, kFloat);
  EXPECT_NEAR(d.outline_rms, std::sqrt((0.125 * 0.125 + 1) / 2), kFloat);
  EXPECT_TRUE(std::isnan(mesh_distance(scene, truth, {}).rms));
}

TEST(MeshDistance, LeavesOutTheSpray) {
  const Scene& scene = find_scene("splash");
  const Truth truth = trace(scene, lens_of(scene));
  Mesh mesh;
  for (const Piece& piece : scene.splash)
    for (const Vec3d& p : piece) mesh.position.push_back(static_cast<Vec3>(p));
  const MeshDistance spray = mesh_distance(scene, truth, mesh);
  EXPECT_TRUE(std::isnan(spray.rms)) << "these lie 3 s and more before the solid";
  EXPECT_TRUE(std::isnan(spray.outline_rms));
  int solid = 0;
  for (std::size_t p = 0; p < truth.depth.size(); p += 31) {
    if (truth.class_of[p] != PixelClass::interior) continue;
    mesh.position.push_back(static_cast<Vec3>(truth.lens.point(p, truth.depth[p])));
    ++solid;
  }
  EXPECT_GT(solid, 1000);
  // Coordinates below 16 as floats, and depths good to 1e-6.
  EXPECT_LT(mesh_distance(scene, truth, mesh).p999, 3 * 16 * FLT_EPSILON + 1e-6);
}

}  // namespace
}  // namespace meniscus::accuracy
