// Layers of extracted surfaces: right on solids that are known, and no matter how they are asked
// for.
#include "accuracy/layers.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "accuracy/particles.hpp"
#include "base/parallel.hpp"
#include "meniscus/device.hpp"
#include "meniscus/extract.hpp"
#include "prepare/stream.hpp"
#include "same_bits.hpp"
#include "stages/view.hpp"
#include "thrown.hpp"

namespace meniscus::accuracy {
namespace {

using testing::HasSubstr;

Parameters with_layers(int most) {
  Parameters parameters;
  parameters.particle_radius = kParticleRadius;
  parameters.mesh = false;
  parameters.layers = most;
  return parameters;
}

struct Solid {
  const char* scene;
  bool orthographic;
  double thickness, back, normal;  // s, s, degrees; about 1.5 times what is found
};

void PrintTo(const Solid& solid, std::ostream* out) {
  *out << solid.scene << (solid.orthographic ? " orthographic" : "");
}

class LayersOf : public testing::TestWithParam<Solid> {};

TEST_P(LayersOf, AreNearTheTruth) {
  const Solid& solid = GetParam();
  const Scene scene = scaled(find_scene(solid.scene), 5);
  const Lens lens = lens_of(scene, solid.orthographic);
  Device device;
  const Surface surface =
      extract(device, make_particles(scene, 0.05, 1), camera_of(lens), with_layers(2));
  const LayerFigures f = measure_layers(trace_layers_of(scene, lens), surface);
  EXPECT_GT(f.inner, 5000);
  EXPECT_LT(f.thickness_rms, solid.thickness);
  EXPECT_LT(f.back_rms, solid.back);
  EXPECT_LT(f.normal_median, solid.normal);
  EXPECT_GT(f.second_right, 0.98);
  EXPECT_LT(f.films, 0.01);
}

INSTANTIATE_TEST_SUITE_P(
    Solids, LayersOf,
    testing::Values(Solid{"sphere", false, 0.06, 0.04, 1}, Solid{"twolayer", false, 0.08, 0.04, 1},
                    Solid{"sheet", true, 0.1, 0.05, 1}, Solid{"capsules", false, 0.15, 0.08, 1.5},
                    Solid{"notch", false, 0.12, 0.033, 1}),
    [](const auto& info) {
      return std::string(info.param.scene) + (info.param.orthographic ? "Orthographic" : "");
    });

bool same(const Layers& a, const Layers& b) {
  return a.most == b.most && same_bits(a.count, b.count) && same_bits(a.thickness, b.thickness) &&
         same_bits(a.entry, b.entry) && same_bits(a.exit, b.exit) &&
         same_bits(a.back_normal, b.back_normal);
}

TEST(ExtractLayers, LeaveTheFrontAsItIs) {
  const Scene scene = scaled(find_scene("sheet"), 4);
  const Particles particles = make_particles(scene, 0.05, 1);
  const Camera camera = camera_of(lens_of(scene));
  Device device;
  for (const Method method : {Method::fit, Method::groups, Method::stable}) {
    Parameters without = with_layers(0), with = with_layers(3);
    without.method = with.method = method;
    const Surface plain = extract(device, particles, camera, without),
                  layered = extract(device, particles, camera, with);
    EXPECT_EQ(plain.layers.most, 0);
    EXPECT_TRUE(plain.layers.count.empty());
    EXPECT_TRUE(same_bits(plain, layered));
    const Layers& layers = layered.layers;
    const std::size_t pixels = layered.depth.size();
    ASSERT_EQ(layers.entry.size(), 3 * pixels);
    std::size_t several = 0;
    for (std::size_t p = 0; p < pixels; ++p) {
      EXPECT_EQ(layers.entry[p], layered.depth[p]);
      EXPECT_EQ(layers.count[p] > 0, std::isfinite(layered.depth[p]));
      const auto count = std::min<std::size_t>(layers.count[p], 3);
      several += count > 1;
      for (std::size_t k = 0; k < 3; ++k) {
        const float from = layers.entry[k * pixels + p], to = layers.exit[k * pixels + p];
        if (k >= count) {
          EXPECT_TRUE(std::isinf(from) && std::isinf(to));
          continue;
        }
        EXPECT_GT(to, from);
        if (k > 0) {
          EXPECT_GT(from, layers.exit[(k - 1) * pixels + p]);
        }
      }
    }
    EXPECT_GT(several, 1000u);
    const Surface alone = on_threads(1, [&] { return extract(device, particles, camera, with); });
    EXPECT_TRUE(same(alone.layers, layers));
  }
}

// Frames of 2^18 particles and more stream, and what lies behind the front goes past; layers want
// it.
TEST(ExtractLayers, SeeThroughAFrameThatStreams) {
  constexpr int kSide = 64;  // 2^18 particles
  Particles particles;
  particles.particle_radius = 0.5;
  for (int k = 0; k < kSide; ++k)
    for (int j = 0; j < kSide; ++j)
      for (int i = 0; i < kSide; ++i) add_position(particles, {i + 0.5, j + 0.5, k + 0.5});
  const Camera camera = look_at({32, 32, 200}, {32, 32, 32}, {0, 1, 0}, 26, 48, 36);
  Device device;
  for (const double thin : {0.0, 4.0}) {
    Parameters parameters = with_layers(1);
    parameters.thin = thin;
    const Surface surface = extract(device, particles, camera, parameters);
    EXPECT_EQ(surface.counts.representatives > 0, thin > 0);
    const std::size_t middle = 18 * 48 + 24;
    EXPECT_EQ(surface.layers.entry[middle], surface.depth[middle]);
    EXPECT_NEAR(surface.layers.exit[middle], 200, 0.1);
    EXPECT_NEAR(surface.layers.thickness[middle], 64, 0.5);
    EXPECT_EQ(surface.layers.count[middle], 1u);
  }
}

// Cells of the mesh that rays leave have places up to 8 million particle radii away.
TEST(ExtractLayers, LeaveOutAStrayThatNoMeshReaches) {
  const Scene scene = scaled(find_scene("sphere"), 4);
  Particles particles = make_particles(scene, 0.05, 1);
  const Camera camera = camera_of(lens_of(scene));
  Device device;
  const Surface expected = extract(device, particles, camera, with_layers(1));
  const View view = make_view(camera, 1, {});
  const Vec3d far = world_from_eye(view, {0, 0, -2e7 * kParticleRadius});
  add_position(particles, far);
  const Surface found = extract(device, particles, camera, with_layers(1));
  EXPECT_EQ(found.counts.in_view, expected.counts.in_view + 1);
  const std::size_t middle =
      static_cast<std::size_t>(camera.height / 2) * static_cast<std::size_t>(camera.width) +
      static_cast<std::size_t>(camera.width / 2);
  EXPECT_EQ(found.layers.count[middle], 1u);
  // The middle of the particles, around which the device has its coordinates, is another one.
  EXPECT_NEAR(found.layers.thickness[middle], expected.layers.thickness[middle], 1e-3);
}

TEST(ExtractLayers, AreRefusedOfMethodsWithAFrontAlone) {
  for (const MethodEntry& entry : method_list()) {
    Parameters parameters = with_layers(1);
    parameters.method = entry.method;
    const bool layered = entry.method == Method::fit || entry.method == Method::groups ||
                         entry.method == Method::stable;
    EXPECT_EQ(has_layers(entry.method), layered) << entry.name;
    const OnScreen dense{.spacing = 0.5, .particles = 2.0 * kStreamed};
    EXPECT_EQ(thinning(dense, parameters) > 1, layered) << entry.name;
    if (layered) {
      EXPECT_NO_THROW(check(parameters));
      continue;
    }
    EXPECT_THAT(
        text_of_thrown<InvalidArgument>([&] { check(parameters); }),
        testing::AllOf(HasSubstr("method " + entry.name + " has one layer"),
                       HasSubstr("are found by methods fit, groups and stable (leave layers out")));
  }
  EXPECT_THROW(check(with_layers(-1)), InvalidArgument);
  EXPECT_THROW(check(with_layers(9)), InvalidArgument);
  EXPECT_NO_THROW(check(with_layers(8)));
}

TEST(ExtractLayers, OfNothingAreEmpty) {
  Device device;
  const Surface surface = extract(
      device, Particles{}, look_at({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, 40, 8, 6), with_layers(2));
  EXPECT_EQ(surface.layers.count, std::vector<std::uint32_t>(48, 0));
  EXPECT_EQ(surface.layers.exit.size(), 96u);
}

}  // namespace
}  // namespace meniscus::accuracy
