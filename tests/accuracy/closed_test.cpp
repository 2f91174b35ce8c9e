// Closed meshes: right on solids that are known, closed, and the same however they are made.
#include "meniscus/closed.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "accuracy/closed.hpp"
#include "accuracy/particles.hpp"
#include "base/parallel.hpp"
#include "meniscus/device.hpp"
#include "stages/vec.hpp"

namespace meniscus::accuracy {
namespace {

struct Solid {
  const char* scene;
  double distance, normal_95, crease;  // s, degrees; about 1.5 times what is found
};

void PrintTo(const Solid& solid, std::ostream* out) { *out << solid.scene; }

class ClosedMesh : public testing::TestWithParam<Solid> {};

TEST_P(ClosedMesh, IsNearTheTruth) {
  const Solid& solid = GetParam();
  const Scene& scene = find_scene(solid.scene);
  Device device;
  const Surface surface = extract_closed(device, make_particles(scene, 0.05, 1));
  EXPECT_TRUE(surface.depth.empty());
  const ClosedFigures f = measure_closed(scene, volume(scene), surface.mesh);
  EXPECT_GT(f.triangles, 10000);
  EXPECT_EQ(f.open_edges, 0);
  EXPECT_EQ(f.bad_edges, 0);
  EXPECT_EQ(f.bad_vertices, 0);
  EXPECT_EQ(f.bubbles, 0);
  EXPECT_EQ(f.pieces, 1);
  EXPECT_NEAR(f.volume, 0, 0.005);
  EXPECT_LT(f.distance_rms, solid.distance);
  EXPECT_LT(f.normal_95, solid.normal_95);
  if (solid.crease > 0) {
    EXPECT_LT(f.crease_rms, solid.crease);
  }
}

INSTANTIATE_TEST_SUITE_P(Solids, ClosedMesh,
                         testing::Values(Solid{"sphere", 0.032, 2.1, 0},
                                         Solid{"box", 0.045, 5.5, 0.1},
                                         Solid{"notch", 0.04, 5, 0.1},
                                         Solid{"capsules", 0.06, 19, 0.2}),
                         [](const auto& info) { return std::string(info.param.scene); });

// One particle anywhere for each s^3: gaps inside are no air, and what is told is as large as it
// was. Bounds are about 1.5 times what is found. Those of the torus are closer: with the support
// that round fits have in views its distance was .206 s, its normals 8.4 degrees, its volume 1.8 %
// too small.
TEST(Closed, ParticlesAnywhereAreNearTheTruth) {
  Device device;
  for (const Solid& solid : {Solid{"sphere", 0.2, 9.5, 0}, Solid{"torus", 0.2, 7.5, 0},
                             Solid{"notch", 0.25, 35, 0.45}}) {
    const Scene& scene = find_scene(solid.scene);
    const Surface surface = extract_closed(device, make_particles(scene, 0, 1, Filling::random));
    EXPECT_EQ(surface.disorder, 2) << solid.scene;
    const ClosedFigures f = measure_closed(scene, volume(scene), surface.mesh);
    EXPECT_EQ(f.open_edges + f.bad_edges + f.bad_vertices + f.bubbles, 0) << solid.scene;
    EXPECT_EQ(f.pieces, 1) << solid.scene;
    EXPECT_NEAR(f.volume, 0, 0.015) << solid.scene;
    EXPECT_LT(f.distance_rms, solid.distance) << solid.scene;
    EXPECT_LT(f.normal_95, solid.normal_95) << solid.scene;
    if (solid.crease > 0) {
      EXPECT_LT(f.crease_rms, solid.crease);
    }
  }
}

// Where particles anywhere are sparse by chance, the surface has no pit. Without particles in voids
// there was one of 4.4 s, and of 2.3 s.
TEST(Closed, ParticlesAnywhereLeaveNoPits) {
  struct Sparse {
    const char* scene;
    unsigned seed;
  };
  Device device;
  for (const auto& [name, seed] : {Sparse{"sphere", 6}, Sparse{"shortwaves", 1}}) {
    const Scene& scene = find_scene(name);
    const Surface surface = extract_closed(device, make_particles(scene, 0, seed, Filling::random));
    EXPECT_LT(measure_closed(scene, volume(scene), surface.mesh).distance_most, 1.5) << name;
  }
}

bool same(const Mesh& a, const Mesh& b) {
  return a.position == b.position && a.normal == b.normal && a.triangle == b.triangle;
}

TEST(Closed, MeshesAreTheSameWithAnyOrderAndThreads) {
  const Particles particles = make_particles(find_scene("prism"), 0.05, 2);
  Device device;
  const Surface surface = extract_closed(device, particles, {.cell = 0.8});
  ASSERT_GT(surface.mesh.triangle.size(), 10000u);
  const Surface alone =
      on_threads(1, [&] { return extract_closed(device, particles, {.cell = 0.8}); });
  EXPECT_TRUE(same(alone.mesh, surface.mesh));
  Particles shuffled = particles;
  for (std::vector<float>* axis : {&shuffled.x, &shuffled.y, &shuffled.z}) {
    std::mt19937 random(7);
    std::shuffle(axis->begin(), axis->end(), random);
  }
  EXPECT_TRUE(same(extract_closed(device, shuffled, {.cell = 0.8}).mesh, surface.mesh));
}

TEST(Closed, MeshOfOneParticleIsASphere) {
  Particles particles;
  particles.x = {3};
  particles.y = {-2};
  particles.z = {5};
  Device device;
  Parameters parameters;
  parameters.particle_radius = 0.5;
  const Mesh mesh = extract_closed(device, particles, {.cell = 0.2}, parameters).mesh;
  const ClosedFigures f = check_topology(mesh);
  EXPECT_EQ(f.open_edges + f.bad_edges + f.bad_vertices, 0);
  EXPECT_EQ(f.pieces, 1);
  // The field's level is a sphere of the particle's radius to 1/500 (docs/method.md).
  for (const Vec3& at : mesh.position)
    EXPECT_NEAR(std::hypot(at.x - 3, at.y + 2, at.z - 5), 0.5, 0.005);
  EXPECT_NEAR(f.volume, std::numbers::pi / 6, 0.02);
}

// Whatever unit of length and level of the field the fluid's disorder takes.
TEST(Closed, DropsOfIrregularParticlesAreAsLargeAsTheyAre) {
  Particles particles;
  particles.particle_radius = 0.5;
  particles.x = {0, 20, 21, 20.5};
  particles.y = {0, 0, 0, 0.8f};
  particles.z = {0, 0, 0, 0};
  Device device;
  for (const double disorder : {0.25, 0.5, 1.0, 1.5, 2.0}) {
    Parameters parameters;
    parameters.disorder = disorder;
    const Mesh mesh = extract_closed(device, particles, {.cell = 0.2}, parameters).mesh;
    const ClosedFigures f = check_topology(mesh);
    EXPECT_EQ(f.pieces, 2) << disorder;
    // As Closed.MeshOfOneParticleIsASphere; the kernels' polynomial is the spline's to 1/100.
    for (const Vec3& at : mesh.position)
      if (at.x < 10) {
        EXPECT_NEAR(std::hypot(at.x, at.y, at.z), 0.5, 0.01) << disorder;
      }
    // Three particles have a volume of 3.
    EXPECT_NEAR(f.volume - std::numbers::pi / 6, 3, 1) << disorder;
  }
}

// However long and wide they are.
TEST(Closed, ThreadsAndLayersOfIrregularParticlesHold) {
  Particles thread, layer;
  thread.particle_radius = layer.particle_radius = 0.5;
  const auto add = [](Particles& particles, int i, int j) {
    add_position(particles, Vec3d(i, j, 0));
  };
  for (int i = 0; i < 24; ++i) add(thread, i, 0);
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j) add(layer, i, j);
  Device device;
  for (const Particles& particles : {thread, layer})
    for (const double disorder : {0.5, 1.0, 2.0}) {
      Parameters parameters;
      parameters.disorder = disorder;
      const ClosedFigures f =
          check_topology(extract_closed(device, particles, {}, parameters).mesh);
      EXPECT_EQ(f.pieces, 1) << disorder;
      // Orderly ones take 1.3 to 1.6 each.
      const double each = f.volume / static_cast<double>(particles.x.size());
      EXPECT_GT(each, 0.9) << disorder;
      EXPECT_LT(each, 1.6) << disorder;
    }
}

TEST(Closed, MeshCarriesVelocitiesAndAttributes) {
  Particles particles = make_particles(find_scene("sphere"), 0.05, 3);
  const std::size_t n = particles.size();
  particles.vx.assign(n, 1.5f);
  particles.vy.assign(n, 0.0f);
  particles.vz.assign(n, -2.0f);
  particles.attributes.push_back({"heat", std::vector<float>(n, 7.0f)});
  Device device;
  const Surface surface = extract_closed(device, particles, {.cell = 2});
  ASSERT_EQ(surface.mesh.velocity.size(), surface.mesh.position.size());
  ASSERT_EQ(surface.mesh.attributes.size(), 1u);
  EXPECT_EQ(surface.mesh.attributes[0].name, "heat");
  for (std::size_t v = 0; v < surface.mesh.position.size(); ++v) {
    EXPECT_NEAR(surface.mesh.velocity[v].x, 1.5, 1e-5);
    EXPECT_NEAR(surface.mesh.velocity[v].z, -2, 1e-5);
    EXPECT_NEAR(surface.mesh.attributes[0].values[v], 7, 1e-5);
  }
}

// A sphere's normals are right at the corners of a double pyramid and turn with the corners' shares
// within its faces; the sphere's own turn with the place. Of each face, corners 12 x, 12 y and 24
// z, the places (4, 4, 8), (8, 2, 4), (2, 8, 4) and (2, 2, 16) count as much.
TEST(Closed, NormalsAreInterpolatedWithinTriangles) {
  Mesh mesh;
  for (const float side : {1.0f, -1.0f})
    for (const Vec3& axis : {Vec3{side, 0, 0}, Vec3{0, side, 0}, Vec3{0, 0, side}}) {
      mesh.position.push_back({12 * axis.x, 12 * axis.y, 24 * axis.z});
      mesh.normal.push_back(axis);
    }
  for (const std::uint32_t x : {0u, 3u})
    for (const std::uint32_t y : {1u, 4u})
      for (const std::uint32_t z : {2u, 5u})
        mesh.triangle.push_back(((x + y + z) % 2 == 1) ? std::array{x, y, z} : std::array{y, x, z});
  const Scene& sphere = find_scene("sphere");
  const ClosedFigures f = measure_closed(sphere, volume(sphere), mesh);
  EXPECT_EQ(f.open_edges + f.bad_edges + f.bad_vertices, 0);
  EXPECT_GT(f.volume, -1);
  EXPECT_NEAR(f.normal_95, 0, 1e-3);
  const double degrees = 180 / std::numbers::pi;
  EXPECT_NEAR(f.within_median, std::acos(38 / std::sqrt(84.0 * 18)) * degrees, 1e-3);
  EXPECT_NEAR(f.within_95, std::acos(4 / std::sqrt(18.0)) * degrees, 1e-3);
}

// As near to the truth as the full mesh is, with less than a fifth of its triangles. Normals pay
// for fewer triangles (docs/mesh.md); how much those within triangles pay differs with the
// particles: the mean of three seeds, half more than the full mesh's when that had 5.48 degrees.
TEST(Closed, AdaptiveMeshIsAsGood) {
  const Scene& scene = find_scene("notch");
  const double volume_of_scene = volume(scene);
  Device device;
  double within = 0;  // degrees
  for (const unsigned seed : {1u, 2u, 3u}) {
    const Particles particles = make_particles(scene, 0.05, seed);
    const ClosedFigures full =
        measure_closed(scene, volume_of_scene, extract_closed(device, particles).mesh);
    const ClosedFigures few = measure_closed(
        scene, volume_of_scene, extract_closed(device, particles, {.adaptive = kAdaptive}).mesh);
    EXPECT_LT(5 * few.triangles, full.triangles);
    EXPECT_EQ(few.open_edges + few.bad_edges + few.bad_vertices, 0);
    EXPECT_EQ(few.pieces, full.pieces);
    EXPECT_NEAR(few.volume, full.volume, 5e-4);
    EXPECT_LT(few.distance_rms, 1.1 * full.distance_rms);
    EXPECT_LT(few.crease_rms, 1.1 * full.crease_rms);
    EXPECT_LT(few.normal_95, 1.5 * full.normal_95);
    within += few.within_95 / 3;
  }
  EXPECT_LT(within, 8.2);
}

TEST(Closed, MeshOfNothingIsEmptyWithAWarning) {
  Device device;
  const Surface surface = extract_closed(device, Particles{});
  EXPECT_TRUE(surface.mesh.triangle.empty());
  ASSERT_FALSE(surface.notices.empty());
  EXPECT_EQ(surface.notices.back().code, Code::no_particles);
}

TEST(Closed, WhatCannotBeDoneIsRefused) {
  Device device;
  const Particles none;
  EXPECT_THROW(extract_closed(device, none, {.cell = 0.05}), InvalidArgument);
  EXPECT_THROW(extract_closed(device, none, {.cell = NAN}), InvalidArgument);
  EXPECT_THROW(extract_closed(device, none, {.adaptive = 1.5}), InvalidArgument);
  EXPECT_THROW(extract_closed(device, none, {.adaptive = NAN}), InvalidArgument);
  Parameters ssm;
  ssm.method = Method::ssm;
  EXPECT_THROW(extract_closed(device, none, {}, ssm), InvalidArgument);
}

}  // namespace
}  // namespace meniscus::accuracy
