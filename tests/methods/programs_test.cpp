// The list of what method fit builds is what it builds.
#include "methods/programs.hpp"

#include <gtest/gtest.h>

#include <set>

#include "device/device.hpp"
#include "frame/input.hpp"
#include "meniscus/closed.hpp"
#include "meniscus/extract.hpp"

namespace meniscus {
namespace {

std::set<std::string> built(const Device::State& state) {
  std::set<std::string> keys;
  for (const auto& [key, program] : state.programs) keys.insert(key);
  return keys;
}

class Forms : public testing::TestWithParam<DiscForm> {};

TEST_P(Forms, ProgramsOfFitAreThoseThatAFrameBuilds) {
  Device device;
  device.state().discs = GetParam();
  FrameInput frame = dam_frame();
  frame.particles.vx = frame.particles.vy = frame.particles.vz =
      std::vector<float>(frame.particles.size(), 1.0f);
  const Parameters parameters;  // image, mesh and motion
  std::set<std::string> listed;
  for (const ProgramName& program : programs_of(parameters, device.state()))
    EXPECT_TRUE(listed.insert(program.file + " " + program.options).second) << program.file;
  extract(device, frame.particles, frame.camera, parameters);
  EXPECT_EQ(built(device.state()), listed);
}

INSTANTIATE_TEST_SUITE_P(Discs, Forms, testing::Values(DiscForm::bins, DiscForm::minima),
                         [](const auto& test) {
                           return test.param == DiscForm::bins ? "ByBins" : "ByMinima";
                         });

TEST(Programs, OfClosedMeshesAreThoseThatAMeshBuilds) {
  Device device;
  FrameInput frame = dam_frame();
  frame.particles.vx = frame.particles.vy = frame.particles.vz =
      std::vector<float>(frame.particles.size(), 1.0f);
  std::set<std::string> listed;
  for (const ProgramName& program : closed_programs({}, device.state()))
    EXPECT_TRUE(listed.insert(program.file + " " + program.options).second) << program.file;
  extract_closed(device, frame.particles);
  EXPECT_EQ(built(device.state()), listed);
}

}  // namespace
}  // namespace meniscus
