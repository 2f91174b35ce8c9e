// The violent scenes: that their distances are distances, and their particles fill them.
#include "accuracy/violent.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "accuracy/figures/pieces.hpp"
#include "accuracy/particles.hpp"
#include "accuracy/truth.hpp"
#include "meniscus/error.hpp"

namespace meniscus::accuracy {
namespace {

using testing::ElementsAre;

TEST(ViolentScenes, AreSplit) {
  EXPECT_THAT(scenes_named({"violent-tuning"}), ElementsAre("jet", "holes", "breaker"));
  EXPECT_THAT(scenes_named({"violent-reporting"}),
              ElementsAre("crown", "collision", "impact", "wall", "gate"));
  EXPECT_EQ(scenes_named({"violent"}).size(), 8u);
  EXPECT_EQ(scenes_named({"calm"}).size(), scenes().size());
  EXPECT_EQ(scenes_named({"held-out"}).size(), held_out_scenes().size());
  EXPECT_THAT(scenes_named({"box", "jet"}), ElementsAre("box", "jet"));
  EXPECT_THROW(scenes_named({"violence"}), InvalidArgument);
  EXPECT_THROW(scenes_named({"violent-all"}), InvalidArgument);
}

class ViolentScene : public testing::TestWithParam<const char*> {
 protected:
  const Scene& scene = find_scene(GetParam());
};

/// At a quarter of the scene's resolution.
Lens small_lens(const Scene& scene) {
  Lens lens = lens_of(scene);
  lens.width /= 4;
  lens.height /= 4;
  lens.focal /= 4;
  return lens;
}

// All that takes the grid, which takes seconds to make, in one test.
TEST_P(ViolentScene, IsASolidFilledWithParticles) {
  EXPECT_GT(scene.distance(scene.eye), 10);
  const Vec3d extent = scene.high - scene.low;
  for (int k = 0; k < 8; ++k)
    EXPECT_GT(scene.distance(scene.low + Vec3d{extent.x * (k & 1), extent.y * ((k >> 1) & 1),
                                               extent.z * (k >> 2)}),
              0);

  const Truth truth = trace(scene, small_lens(scene));
  double covered = 0, slow = 0, thin = 0;
  for (std::size_t p = 0; p < truth.depth.size(); ++p) {
    EXPECT_NE(truth.class_of[p], PixelClass::crease) << "violent water is round";
    if (!truth.covered(p)) continue;
    ++covered;
    const Vec3d point = truth.lens.point(p, truth.depth[p]), normal = truth.normal[p];
    EXPECT_LT(dot(normal, truth.lens.direction(p)), 0) << p;
    EXPECT_NEAR(scene.distance(point), 0, 1e-6);
    // Along the normal the distance grows by the way, to where something else is nearer.
    slow += std::abs(scene.distance(point + 0.25 * normal) - 0.25) > 0.02;
    thin += std::abs(scene.distance(point - 0.5 * normal) + 0.5) > 0.05;
  }
  EXPECT_GT(covered, 0.08 * static_cast<double>(truth.depth.size()));
  // Valleys between drops that melt are narrower than 0.25 s at few places.
  EXPECT_LT(slow, 0.02 * covered);
  // The ball of the opening has a radius of 1 s, and the blur takes at most 0.15 s of it: particles
  // at a depth of s/2 have room everywhere.
  EXPECT_LT(thin, 0.01 * covered);

  // One particle a cubic s; a lattice's count scatters by less than the root of the volume.
  const std::vector<Vec3d> points = fill(scene, 1);
  const double wanted = volume(scene);
  EXPECT_NEAR(static_cast<double>(points.size()), wanted, 3 * std::sqrt(wanted));
  EXPECT_GT(wanted, 3000);
  double shallowest = -1e9;
  for (const Vec3d& p : points) shallowest = std::max(shallowest, scene.distance(p));
  EXPECT_LE(shallowest, -0.5 + 1e-3);
  EXPECT_GE(shallowest, -0.5 - 1e-2);
}

INSTANTIATE_TEST_SUITE_P(Scenes, ViolentScene, testing::ValuesIn([] {
                           std::vector<const char*> names;
                           for (const Scene& scene : violent_scenes())
                             names.push_back(scene.name.c_str());
                           return names;
                         }()),
                         [](const auto& info) { return std::string(info.param); });

TEST(ViolentScenes, AreTheSameEveryTime) {
  const std::vector<Scene> again = make_violent_scenes();
  const Scene &jet = find_scene("jet"), &other = again[0];
  ASSERT_EQ(other.name, "jet");
  const Particles a = make_particles(jet, 0.05, 3), b = make_particles(other, 0.05, 3);
  EXPECT_EQ(a.x, b.x);
  EXPECT_EQ(a.z, b.z);
  EXPECT_NE(a.x, make_particles(jet, 0.05, 4).x);
}

}  // namespace
}  // namespace meniscus::accuracy
