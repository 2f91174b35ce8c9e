// What a frame asks of the device, in both forms: on a processor whose memory the host shares, and
// as on a GPU with memory of its own.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "device/device.hpp"
#include "frame/input.hpp"
#include "frame/sub_buffers.hpp"
#include "meniscus/extract.hpp"

namespace meniscus {
namespace {

struct Form {
  const char* name;
  bool own_memory;
  int width;
  CommandCounts most;  // counted on the dam at 1024x768; to be lowered with the counts
};

void take_form(Device& device, const Form& form) {
  Device::State& state = device.state();
  state.vector_width = form.width;
  if (!form.own_memory) return;
  state.staging = std::make_unique<Staging>(state.context);
  state.discs = DiscForm::minima;
}

constexpr Form kProcessor{"OnAProcessor", false, 8, {91, 1028, 0, 19, 8, 2}};
constexpr Form kGpu{"OnAGpu", true, 1, {60, 791, 2, 3, 3, 2}};

class Commands : public testing::TestWithParam<Form> {};

// Every launch, fill and argument costs the host its time, every read and wait leaves a GPU idle.
TEST_P(Commands, OfAFrameStayWithinTheirBudget) {
  const Form& form = GetParam();
  Device device;
  const Device::State& state = device.state();
  if (!form.own_memory && !state.is_in_place()) GTEST_SKIP() << "the device has memory of its own";
  take_form(device, form);
  const FrameInput dam = dam_frame();
  Parameters parameters;
  parameters.aovs = {true, false, false, false, false, false};  // depth and normals
  parameters.mesh = false;
  extract(device, dam.particles, dam.camera, parameters);  // builds the kernels
  const CommandCounts before = state.counts;
  const Surface surface = extract(device, dam.particles, dam.camera, parameters);
  const CommandCounts counts = state.counts.since(before);
  EXPECT_LE(counts.launches, form.most.launches);
  EXPECT_LE(counts.arguments, form.most.arguments);
  EXPECT_LE(counts.fills, form.most.fills);
  EXPECT_LE(counts.uploads, form.most.uploads);
  EXPECT_LE(counts.reads, form.most.reads);
  EXPECT_LE(counts.waits, form.most.waits);
  std::printf(
      "%s: %lld launches, %lld arguments, %lld fills, %lld uploads, %lld reads, %lld waits\n",
      form.name, (long long)counts.launches, (long long)counts.arguments, (long long)counts.fills,
      (long long)counts.uploads, (long long)counts.reads, (long long)counts.waits);
  // In any form, the same bits.
  Device as_opened;
  const Surface own = extract(as_opened, dam.particles, dam.camera, parameters);
  EXPECT_EQ(surface.depth, own.depth);
  EXPECT_TRUE(surface.normal == own.normal);
}

INSTANTIATE_TEST_SUITE_P(Forms, Commands, testing::Values(kProcessor, kGpu),
                         [](const auto& test) { return test.param.name; });

// The dam four times as large: from 6 pixels of a particle's radius on, samples look once more
// behind the front layer.
TEST_P(Commands, ACloseUpIsTheSameInBothForms) {
  Device device;
  if (!GetParam().own_memory && !device.state().is_in_place())
    GTEST_SKIP() << "the device has memory of its own";
  take_form(device, GetParam());
  FrameInput dam = dam_frame();
  Parameters parameters;
  parameters.aovs = {true, false, false, false, false, false};
  parameters.mesh = false;
  const auto launches_of = [&](const FrameInput& frame, Surface& surface) {
    surface = extract(device, frame.particles, frame.camera, parameters);  // builds the kernels
    const CommandCounts before = device.state().counts;
    surface = extract(device, frame.particles, frame.camera, parameters);
    return device.state().counts.since(before).launches;
  };
  Surface surface;
  const auto usual = launches_of(dam, surface);
  for (const int k : {0, 5}) dam.camera.projection[static_cast<std::size_t>(k)] *= 4;
  EXPECT_GT(launches_of(dam, surface), usual);
  Device as_opened;
  const Surface own = extract(as_opened, dam.particles, dam.camera, parameters);
  EXPECT_EQ(surface.depth, own.depth);
  EXPECT_TRUE(surface.normal == own.normal);
  EXPECT_LT(*std::min_element(own.depth.begin(), own.depth.end()), 1e9f) << "nothing is in view";
}

class GpuForm : public testing::TestWithParam<Method> {};

// NVIDIA's driver crashed on frames whose sub-buffers overlapped (docs/portability.md).
TEST_P(GpuForm, GivesKernelsPartsThatDoNotOverlap) {
  Device device;
  take_form(device, kGpu);
  const FrameInput dam = dam_frame();
  Parameters parameters;
  parameters.method = GetParam();
  parameters.layers = GetParam() == Method::fit ? 2 : 0;
  const int before = test::overlapping_sub_buffers();
  extract(device, dam.particles, dam.camera, parameters);
  EXPECT_EQ(test::overlapping_sub_buffers(), before);
}

INSTANTIATE_TEST_SUITE_P(Methods, GpuForm,
                         testing::Values(Method::fit, Method::groups, Method::stable, Method::paper,
                                         Method::ssm),
                         [](const auto& test) { return to_string(test.param); });

}  // namespace
}  // namespace meniscus
