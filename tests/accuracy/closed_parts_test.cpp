// Closed meshes that are made part by part have the bytes of those that are made at once.
#include "methods/closed_parts.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "accuracy/particles.hpp"
#include "device/stage_clock.hpp"
#include "meniscus/closed.hpp"
#include "meniscus/device.hpp"
#include "methods/closed.hpp"
#include "methods/placed_fluid.hpp"
#include "prepare/fill.hpp"
#include "stages/vec.hpp"

namespace meniscus::accuracy {
namespace {

constexpr double kBlock = 4;  // particle radii, of cells of one

// All of space, cut across one axis after the other where blocks have so many particles before
// them.
std::vector<BlockBox> cut(const WorldParticles& particles, const View& view, int parts,
                          std::size_t axis) {
  if (parts == 1) return {{}};
  std::vector<double> along;
  for (std::size_t i = 0; i < particles.x.size(); ++i) {
    const Vec3d at = eye_from_world(view, {particles.x[i], particles.y[i], particles.z[i]});
    along.push_back(axis == 0 ? at.x : axis == 1 ? at.y : at.z);
  }
  std::sort(along.begin(), along.end());
  std::vector<BlockBox> boxes;
  BlockBox box;
  for (int k = 1; k < parts; ++k) {
    const double at = along[along.size() * static_cast<std::size_t>(k) / parts];
    const auto block = static_cast<std::int32_t>(std::floor(at / kBlock));
    if (block <= box.low[axis]) continue;
    box.high[axis] = block;
    boxes.push_back(box);
    box.low[axis] = block;
    box.high[axis] = BlockBox::kAll;
  }
  boxes.push_back(box);
  return boxes;
}

// Cuts across all axes.
std::vector<BlockBox> octants(const WorldParticles& particles, const View& view) {
  std::vector<BlockBox> boxes{{}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int32_t at = cut(particles, view, 2, axis)[0].high[axis];
    std::vector<BlockBox> halves;
    for (const BlockBox& box : boxes)
      for (const bool high : {false, true}) {
        halves.push_back(box);
        (high ? halves.back().low : halves.back().high)[axis] = at;
      }
    boxes = halves;
  }
  return boxes;
}

// Those that lie in a box once they are evened out.
PlacedParticles some_of(const WorldParticles& all, const Projected& even, const SpaceBox& box,
                        double unit) {
  PlacedParticles in_box;
  WorldParticles& some = in_box.particles;
  some.moving = all.moving;
  for (const Attribute& attribute : all.attributes) some.attributes.push_back({attribute.name, {}});
  for (std::size_t i = 0; i < all.x.size(); ++i) {
    if (!box.holds(even.eye(i) * unit)) continue;
    add_position(in_box.placed, {even.x[i], even.y[i], even.z[i]});
    in_box.placed.scale.push_back(even.scale[i]);
    in_box.placed.index.push_back(static_cast<std::uint32_t>(some.x.size()));
    add_position(some, {all.x[i], all.y[i], all.z[i]});
    if (!all.scale.empty()) some.scale.push_back(all.scale[i]);
    if (all.moving) some.velocity.push_back(all.velocity[i]);
    for (std::size_t a = 0; a < all.attributes.size(); ++a)
      some.attributes[a].values.push_back(all.attributes[a].values[i]);
  }
  return in_box;
}

void expect_same(const Extraction& made, const Extraction& whole, const std::string& of) {
  EXPECT_EQ(made.mesh.position.size(), whole.mesh.position.size()) << of;
  EXPECT_TRUE(made.mesh.position == whole.mesh.position) << of;
  EXPECT_TRUE(made.mesh.normal == whole.mesh.normal) << of;
  EXPECT_TRUE(made.mesh.triangle == whole.mesh.triangle) << of;
  EXPECT_TRUE(made.mesh.velocity == whole.mesh.velocity) << of;
  ASSERT_EQ(made.mesh.attributes.size(), whole.mesh.attributes.size()) << of;
  for (std::size_t a = 0; a < made.mesh.attributes.size(); ++a)
    EXPECT_TRUE(made.mesh.attributes[a].values == whole.mesh.attributes[a].values) << of;
  EXPECT_EQ(made.counts.particles, whole.counts.particles) << of;
  EXPECT_EQ(made.counts.fits, whole.counts.fits) << of;
}

void expect_same_in_parts(const Particles& particles, const Disorder& disorder = {}) {
  Device device;
  StageClock clock(device, nullptr);
  Notices notices;
  const Camera none;
  const Parameters params;
  const ClosedParams closed;
  const auto source = source_of(particles);
  const FilledFrame frame =
      fill_everything({device, none, params, kStreamMemory, clock, notices}, *source);
  const WorldParticles& all = frame.particles;
  const Extraction whole = run_closed(device, frame.view, all, closed, params, disorder, nullptr);
  Projected even = place_particles(coarser(frame.view, disorder.unit()), all);
  even_out(even, disorder);
  if (disorder.anywhere() > 0) {
    const auto filled = with_voids(evened_fluid(frame.view, disorder, even));
    ASSERT_TRUE(filled.has_value());
    EXPECT_GT(even.size(), 0u);
    EXPECT_GT(filled->particles.size(), even.size() + 4) << "voids, so that parts have some";
  }
  const auto in_parts = [&](const std::vector<BlockBox>& parts, const ClosedParams& like) {
    const FillPart fill = [&](std::size_t, const std::vector<SpaceBox>& boxes, const SpaceBox&) {
      return some_of(all, even, boxes[0], disorder.unit());
    };
    return run_closed_in_parts(device, frame.view, alone(), parts, fill, like, params, disorder,
                               true, nullptr);
  };
  for (const int parts : {1, 2, 3, 7}) {
    const std::vector<BlockBox> boxes = cut(all, frame.view, parts, 0);
    ASSERT_GT(static_cast<int>(boxes.size()), parts / 2);
    expect_same(in_parts(boxes, closed), whole, std::to_string(parts) + " slabs");
  }
  expect_same(in_parts(octants(all, frame.view), closed), whole, "octants");
  // No room for cells: they are made in boxes of their own.
  ClosedParams boxed;
  boxed.memory = 0;
  expect_same(in_parts(cut(all, frame.view, 2, 0), boxed), whole, "slabs in boxes");
  Extraction at_once = run_closed(device, frame.view, all, boxed, params, disorder, nullptr);
  expect_same(std::move(at_once), whole, "boxes");
}

TEST(ClosedParts, HaveTheBytesOfTheWholeDam) {
  Particles dam = read_particles(std::string(MENISCUS_EXAMPLE_DATA) + "/dam/frame_015.ply");
  std::vector<float>& values = dam.attributes.emplace_back(Attribute{"value", {}}).values;
  for (const float x : dam.x) values.push_back(std::sin(3 * x));
  ASSERT_FALSE(dam.vx.empty());
  expect_same_in_parts(dam);
}

// Which a simulation may throw out of all bounds; of a frame that streams.
TEST(ClosedParts, LeaveOutAParticleThatLiesTooFar) {
  Particles block;
  block.particle_radius = 1;
  for (int i = 0; i < 66; ++i)
    for (int j = 0; j < 64; ++j)
      for (int k = 0; k < 64; ++k) add_position(block, {2.0f * i, 2.0f * j, 2.0f * k});
  ASSERT_GT(block.size(), static_cast<std::size_t>(kStreamed));
  Device device;
  for (const std::size_t memory : {std::size_t{1} << 30, std::size_t{50} << 20}) {
    ClosedParams closed;
    closed.cell = 4;
    closed.memory = memory;
    Particles with_stray = block;
    add_position(with_stray, {0, 1e12f, 0});
    const Surface whole = extract_closed(device, block, closed);
    const Surface rest = extract_closed(device, with_stray, closed);
    EXPECT_EQ(rest.mesh.triangle.size(), whole.mesh.triangle.size());
    EXPECT_THAT(whole.notices, testing::IsEmpty());
    ASSERT_EQ(rest.notices.size(), 1u);
    EXPECT_EQ(rest.notices[0].code, Code::too_far);
    EXPECT_EQ(rest.notices[0].count, 1);
    Parameters strict;
    strict.strict = true;
    EXPECT_THROW(extract_closed(device, with_stray, closed, strict), InputError);
  }
}

TEST(ClosedParts, HaveTheBytesOfAViolentScene) {
  expect_same_in_parts(make_particles(find_scene("crown"), 0.05, 1));
}

// A long bar with waves and drops: parts end far from each other's particles.
Particles long_bar(float noise, int drops) {
  std::mt19937 random(5);
  std::normal_distribution<float> off(0, noise);
  std::uniform_real_distribution<float> within(0, 1);
  Particles particles;
  particles.particle_radius = 1;
  const auto add = [&](float x, float y, float z) {
    add_position(particles, {x + off(random), y + off(random), z + off(random)});
    particles.vx.push_back(std::sin(x));
    particles.vy.push_back(y);
    particles.vz.push_back(z * x);
  };
  for (int i = 0; i < 450; ++i)
    for (int k = 0; k < 6; ++k)
      for (int j = 0; j < 6; ++j)
        if (j < 4 + 2 * std::sin(0.2 * i)) add(2.0f * i, 2.0f * j, 2.0f * k);
  for (int k = 0; k < drops; ++k)
    add(900 * within(random), 14 + 10 * within(random), 12 * within(random));
  return particles;
}

TEST(ClosedParts, HaveTheBytesOfALongBar) { expect_same_in_parts(long_bar(0.1f, 300)); }

// Bevels all along its edges, in whose place there are faces.
TEST(ClosedParts, HaveTheBytesOfABarOnItsLattice) { expect_same_in_parts(long_bar(0, 0)); }

// The residuals of all of it are beyond what is taken for noise at first.
TEST(ClosedParts, HaveTheBytesOfANoisyBar) { expect_same_in_parts(long_bar(0.35f, 0)); }

// Particles that are evened out first.
TEST(ClosedParts, HaveTheBytesOfAnIrregularBar) {
  expect_same_in_parts(long_bar(0.58f, 0), {.amount = 1});
}

// Particles that lie anywhere, whose unit of length is not the particle radius.
TEST(ClosedParts, HaveTheBytesOfABarOfParticlesAnywhere) {
  expect_same_in_parts(long_bar(0.9f, 0), {.amount = 1.6});
}

// Whose spacing is not twice the particle radius: forces reach farther.
TEST(ClosedParts, HaveTheBytesOfABarWhoseParticlesLieFarApart) {
  expect_same_in_parts(long_bar(0.58f, 0), {.amount = 1, .spacing = 2.4});
}

// Drops of seven particles, no fit of which is trusted: none reaches as far as fits nearly always
// do.
TEST(ClosedParts, HaveTheBytesOfARowOfDrops) {
  Particles particles;
  particles.particle_radius = 1;
  for (int drop = 0; drop < 40; ++drop)
    for (int i = -1; i <= 1; ++i)
      for (int j = -1; j <= 1; ++j)
        for (int k = -1; k <= 1; ++k) {
          const float x = 2.0f * i, y = 2.0f * j, z = 2.0f * k;
          if (x * x + y * y + z * z > 4) continue;
          add_position(particles, {20.0f * drop + x, y, z});
        }
  expect_same_in_parts(particles);
}

// White noise has every case of cells.
TEST(ClosedParts, HaveTheBytesOfWhiteNoise) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> within(0, 1);
  Particles particles;
  particles.particle_radius = 1.0 / 120;
  for (int k = 0; k < 20000; ++k)
    add_position(particles, {4 * within(random), within(random) * 0.5f, within(random) * 0.5f});
  expect_same_in_parts(particles);
}

}  // namespace
}  // namespace meniscus::accuracy
