// The velocity of extracted surfaces against what is known of how the fluid moves.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "meniscus/device.hpp"
#include "meniscus/extract.hpp"
#include "same_bits.hpp"
#include "stages/vec.hpp"
#include "texts.hpp"

namespace meniscus {
namespace {

constexpr double kRadius = 0.05;

// A block of 14 x 10 x 12 particles on a lattice whose middle is the origin. `velocity` is asked at
// each position.
template <class Velocity>
Particles block(const Velocity& velocity) {
  Particles particles;
  particles.particle_radius = kRadius;
  for (int k = 0; k < 12; ++k)
    for (int j = 0; j < 10; ++j)
      for (int i = 0; i < 14; ++i) {
        const Vec3d at = Vec3d{i - 6.5, j - 4.5, k - 5.5} * (2 * kRadius);
        const Vec3 v = static_cast<Vec3>(velocity(at));
        add_position(particles, at);
        particles.vx.push_back(v.x);
        particles.vy.push_back(v.y);
        particles.vz.push_back(v.z);
      }
  return particles;
}

Camera camera() { return look_at({2.2, 1.8, 2.6}, {0, 0, 0}, {0, 1, 0}, 35, 160, 120); }

Particles without_velocity(Particles particles) {
  particles.vx.clear();
  particles.vy.clear();
  particles.vz.clear();
  return particles;
}

// The velocities once more, as attributes.
Particles with_attributes(Particles particles) {
  particles.attributes = {{"vx", particles.vx}, {"vy", particles.vy}, {"vz", particles.vz}};
  return particles;
}

std::vector<float> components(const std::vector<Vec3>& vectors, float Vec3::*axis) {
  std::vector<float> values;
  for (const Vec3& v : vectors) values.push_back(v.*axis);
  return values;
}

class ExtractMotion : public testing::Test {
 protected:
  Device device_;
};

TEST_F(ExtractMotion, AttributesAreWeighedAsVelocitiesAre) {
  const Particles particles = with_attributes(block([](const Vec3d& at) {
    return Vec3d{std::sin(9 * at.x), at.y * at.z, 300 + at.z};
  }));
  Parameters parameters;
  parameters.mesh = true;
  const Surface surface = extract(device_, particles, camera(), parameters);
  ASSERT_EQ(surface.attributes.size(), 3u);
  ASSERT_EQ(surface.mesh.attributes.size(), 3u);
  EXPECT_FALSE(surface.mesh.position.empty());
  const float Vec3::*axes[] = {&Vec3::x, &Vec3::y, &Vec3::z};
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(surface.attributes[k].name, particles.attributes[k].name);
    EXPECT_TRUE(same_bits(surface.attributes[k].values,
                          components(surface.velocity, const_cast<float Vec3::*>(axes[k]))));
    EXPECT_TRUE(same_bits(surface.mesh.attributes[k].values,
                          components(surface.mesh.velocity, const_cast<float Vec3::*>(axes[k]))));
  }
  // Without velocities, and alone, it is the same.
  Particles alone = without_velocity(particles);
  alone.attributes.erase(alone.attributes.begin());
  alone.attributes.pop_back();
  const Surface again = extract(device_, alone, camera(), parameters);
  EXPECT_TRUE(again.velocity.empty());
  ASSERT_EQ(again.attributes.size(), 1u);
  EXPECT_TRUE(same_bits(again.attributes[0].values, surface.attributes[1].values));
}

TEST_F(ExtractMotion, AttributesThatAreNoneAreLeftOut) {
  Particles particles = without_velocity(block([](const Vec3d&) { return Vec3d{}; }));
  Attribute heat{"heat", std::vector<float>(particles.size(), 20.0f)};
  for (std::size_t i = 0; i < particles.size(); i += 3)
    heat.values[i] = i % 2 ? std::nanf("") : 1e30f;
  particles.attributes = {heat, {"one", std::vector<float>(particles.size(), 1.0f)}};
  Surface surface = extract(device_, particles, camera());
  ASSERT_EQ(surface.attributes.size(), 2u);
  for (std::size_t k = 0; k < surface.depth.size(); ++k) {
    const bool some = surface.depth[k] < std::numeric_limits<float>::infinity();
    EXPECT_NEAR(surface.attributes[0].values[k], some ? 20 : 0, 20 * 200 * 6e-8);
    EXPECT_NEAR(surface.attributes[1].values[k], some ? 1 : 0, 200 * 6e-8);
  }
  EXPECT_THAT(texts(surface.notices),
              testing::Contains(testing::HasSubstr("heat is NaN, infinite or absurd in 560")));
  Parameters strict;
  strict.strict = true;
  EXPECT_THROW(extract(device_, particles, camera(), strict), InputError);
  particles.attributes[1].name = "heat";
  EXPECT_THROW(extract(device_, particles, camera()), InvalidArgument);
}

TEST_F(ExtractMotion, OfATranslatingBlockIsItsVelocityByEveryMethod) {
  const Vec3 velocity{1.5f, -0.25f, 3};
  const Particles particles = block([&](const Vec3d&) { return Vec3d(velocity); });
  // Means of at most some 80 equal numbers, rounded once a particle in two sums.
  const double off = 200 * 6e-8 * 3;
  for (const MethodEntry& entry : method_list()) {
    Parameters parameters;
    parameters.method = entry.method;
    const Surface surface = extract(device_, particles, camera(), parameters);
    ASSERT_EQ(surface.velocity.size(), surface.depth.size()) << entry.name;
    ASSERT_EQ(surface.mesh.velocity.size(), surface.mesh.position.size()) << entry.name;
    const auto expect = [&](const Vec3& v) {
      EXPECT_NEAR(v.x, velocity.x, off) << entry.name;
      EXPECT_NEAR(v.y, velocity.y, off) << entry.name;
      EXPECT_NEAR(v.z, velocity.z, off) << entry.name;
    };
    int covered = 0;
    for (std::size_t s = 0; s < surface.depth.size(); ++s) {
      if (surface.kind[s] == Kind::none) {
        EXPECT_EQ(surface.velocity[s], Vec3{}) << entry.name;
        continue;
      }
      ++covered;
      expect(surface.velocity[s]);
    }
    EXPECT_GT(covered, 1000) << entry.name;
    for (const Vec3& v : surface.mesh.velocity) expect(v);
  }
}

// At a point the mean is over particles within four radii, and a rotation is linear: the velocity
// is that of the particles' weighted centroid, which lies within four radii of the point.
//
// On a face more is known. With particles in layers two radii apart, the first at depth h, a layer
// at depth d weighs in all 16 pi/5 (1 - d^2/16)^5, so that the centroid lies at h + 2 q/(1 + q), q
// the second layer's share over the first's; on this lattice it is less than .05 radii from there
// (.004 along the normal, .040 across, by trying places). That is about a radius below the surface.
TEST_F(ExtractMotion, OfARotatingBlockIsThatJustBelowItsSurface) {
  const Vec3d spin{0.7, 2, -1.1}, drift{0.3, 0, 0.1};
  const Particles particles = block([&](const Vec3d& p) { return cross(spin, p) + drift; });
  const Surface surface = extract(device_, particles, camera());
  const auto truth = [&](const Vec3d& p) { return cross(spin, p) + drift; };
  const double rounding = 200 * 6e-8 * 4;
  const auto within_reach = [&](const Vec3& velocity, const Vec3& at) {
    EXPECT_LT(length(Vec3d(velocity) - truth(Vec3d(at))), 4 * kRadius * length(spin) + rounding);
  };
  int on_faces = 0;
  for (std::size_t s = 0; s < surface.depth.size(); ++s) {
    if (surface.kind[s] == Kind::none) continue;
    within_reach(surface.velocity[s], surface.position[s]);
    // How high the point lies over the outermost particles of the three faces, in radii.
    const Vec3d p = Vec3d(surface.position[s]) / kRadius, over = p - Vec3d{13, 9, 11};
    const double h = std::max({over.x, over.y, over.z});
    const Vec3d normal{over.x == h ? 1.0 : 0, over.y == h ? 1.0 : 0, over.z == h ? 1.0 : 0};
    const auto far_from_edges = [&](double x, double half, double own) {
      return own == 1 || (x < half - 5 && x > -half + 5);
    };
    if (!far_from_edges(p.x, 13, normal.x) || !far_from_edges(p.y, 9, normal.y) ||
        !far_from_edges(p.z, 11, normal.z))
      continue;
    ++on_faces;
    const auto share = [](double depth) { return std::pow(1 - depth * depth / 16, 5); };
    const double q = h < 2 ? share(h + 2) / share(h) : 0;
    const Vec3d centroid = p - normal * (h + 2 * q / (1 + q));
    EXPECT_LT(length(Vec3d(surface.velocity[s]) - truth(centroid * kRadius)),
              0.05 * kRadius * length(spin) + rounding);
  }
  EXPECT_GT(on_faces, 300);
  for (std::size_t k = 0; k < surface.mesh.position.size(); ++k)
    within_reach(surface.mesh.velocity[k], surface.mesh.position[k]);
}

TEST_F(ExtractMotion, IsAnAdditionThatChangesNothingElse) {
  const Particles particles = block([](const Vec3d& p) { return p; });
  Parameters without;
  without.motion = false;
  const Surface moving = extract(device_, particles, camera());
  for (const Surface& still : {extract(device_, particles, camera(), without),
                               extract(device_, without_velocity(particles), camera())}) {
    EXPECT_TRUE(still.velocity.empty());
    EXPECT_TRUE(still.mesh.velocity.empty());
    EXPECT_TRUE(same_bits(still.depth, moving.depth));
    EXPECT_TRUE(same_bits(still.normal, moving.normal));
    EXPECT_TRUE(same_bits(still.kind, moving.kind));
    EXPECT_TRUE(same_bits(still.mesh.position, moving.mesh.position));
    EXPECT_TRUE(same_bits(still.mesh.normal, moving.mesh.normal));
    EXPECT_EQ(still.mesh.triangle, moving.mesh.triangle);
  }
}

// Some particles share a place and differ in their velocities.
TEST_F(ExtractMotion, DoesNotDependOnTheOrderOfParticles) {
  Particles particles = block([](const Vec3d& p) { return Vec3d{p.y, std::sin(9 * p.x), 1}; });
  for (std::size_t i = 0; i < 300; ++i) {
    add_position(particles, {particles.x[5 * i], particles.y[5 * i], particles.z[5 * i]});
    particles.vx.push_back(static_cast<float>(i) * 0.37f);
    particles.vy.push_back(-1.0f / 3);
    particles.vz.push_back(i % 10 == 0 ? NAN : 0.1f);
  }
  const Surface first = extract(device_, particles, camera());
  std::vector<std::size_t> order(particles.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), std::mt19937(2));
  Particles shuffled = particles;
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::vector<float> Particles::*values : {&Particles::x, &Particles::y, &Particles::z,
                                                  &Particles::vx, &Particles::vy, &Particles::vz})
      (shuffled.*values)[i] = (particles.*values)[order[i]];
  const Surface second = extract(device_, shuffled, camera());
  EXPECT_TRUE(same_bits(first.velocity, second.velocity));
  EXPECT_TRUE(same_bits(first.mesh.velocity, second.mesh.velocity));
}

TEST_F(ExtractMotion, LeavesOutVelocitiesThatAreNone) {
  const Vec3d velocity{1, 2, 3};
  Particles particles = block([&](const Vec3d&) { return velocity; });
  for (std::size_t i = 7; i < particles.size(); i += 3) particles.vy[i] = i % 2 ? NAN : -INFINITY;
  const Surface surface = extract(device_, particles, camera());
  EXPECT_THAT(texts(surface.notices),
              testing::ElementsAre("558 of 1680 particles have NaN, infinite or absurd velocities "
                                   "(the first is particle 7), which were left out"));
  for (std::size_t s = 0; s < surface.depth.size(); ++s) {
    if (surface.kind[s] == Kind::none) continue;
    EXPECT_NEAR(surface.velocity[s].y, 2, 200 * 6e-8 * 2);
  }
  Parameters strict;
  strict.strict = true;
  EXPECT_THROW(extract(device_, particles, camera(), strict), InputError);
  strict.motion = false;
  EXPECT_NO_THROW(extract(device_, particles, camera(), strict));

  std::fill(particles.vx.begin(), particles.vx.end(), NAN);
  const Surface still = extract(device_, particles, camera());
  EXPECT_EQ(still.velocity, std::vector<Vec3>(still.depth.size()));
}

TEST_F(ExtractMotion, RefusesVelocitiesOfAnotherSize) {
  Particles particles = block([](const Vec3d& p) { return p; });
  particles.vy.pop_back();
  EXPECT_THROW(extract(device_, particles, camera()), InvalidArgument);
  particles = block([](const Vec3d& p) { return p; });
  particles.vx.clear();
  EXPECT_THROW(extract(device_, particles, camera()), InvalidArgument);
}

}  // namespace
}  // namespace meniscus
