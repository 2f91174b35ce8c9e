// Drawing by atomic minima against drawing bin by bin: whole frames, to the byte. (The stage's own
// case of verify, stage_cases/minima.cpp, compares each map; visible_test has what is hidden.)
#include "stages/frame/minima.hpp"

#include <gtest/gtest.h>

#include "base/content_hash.hpp"
#include "meniscus/extract.hpp"
#include "same_bits.hpp"
#include "stages/stage_test_support.hpp"
#include "verify/scenes.hpp"

namespace meniscus {
namespace {

using Minima = OnDevice;

TEST_P(Minima, GiveTheBytesOfBinsInWholeFramesOfEveryMethod) {
  for (const verify::Scene& scene : verify::kernel_scenes()) {
    if (!scene.small || scene.methods.empty()) continue;
    for (const Method method : scene.methods) {
      const Parameters parameters = verify::parameters_of(scene, method);
      const auto extracted = [&](DiscForm form, int width) {
        device_.state().discs = form;
        use_width(width);
        return extract(device_, scene.particles, scene.camera, parameters);
      };
      const Surface bins = extracted(DiscForm::bins, 8);
      for (const int width : {1, 8}) {
        const Surface minima = extracted(DiscForm::minima, width);
        EXPECT_TRUE(same_bits(minima, bins)) << scene.name << ", " << to_string(method);
        EXPECT_EQ(content_hash(minima), content_hash(bins));
      }
    }
  }
}

// The frame of the README, of 35,937 particles: discs that many work-items lower at once.
TEST_P(Minima, GiveTheBytesOfBinsInALargeFrame) {
  const Particles particles =
      read_particles(std::string(MENISCUS_EXAMPLE_DATA) + "/dam/frame_015.ply");
  const Camera camera = frame_particles(particles, {.width = 512, .height = 384});
  for (const Method method : {Method::fit, Method::paper, Method::spheres}) {
    Parameters parameters;
    parameters.method = method;
    std::vector<std::uint64_t> hashes;
    for (const DiscForm form : {DiscForm::bins, DiscForm::minima}) {
      device_.state().discs = form;
      hashes.push_back(content_hash(extract(device_, particles, camera, parameters)));
    }
    EXPECT_EQ(hashes[0], hashes[1]) << to_string(method);
  }
}

TEST(DiscForms, SuitTheKindOfDevice) {
  DeviceInfo info;
  info.kind = DeviceKind::cpu;
  EXPECT_EQ(default_tuning(info).discs, DiscForm::bins);
  info.kind = DeviceKind::gpu;
  EXPECT_EQ(default_tuning(info).discs, DiscForm::minima);
}

MENISCUS_ON_EVERY_DEVICE(Minima);

}  // namespace
}  // namespace meniscus
