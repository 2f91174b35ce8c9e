// One way in: particles in memory, in a source of somebody's own and streaming get the same
// answers.
#include <gmock/gmock.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "meniscus/device.hpp"
#include "meniscus/extract.hpp"
#include "own_source.hpp"
#include "prepare/fill.hpp"
#include "program/dam_break.hpp"
#include "same_bits.hpp"
#include "stages/vec.hpp"
#include "texts.hpp"

namespace meniscus {
namespace {

Particles small_dam() {
  Particles particles = DamBreak(6000, 1).particles();
  for (std::vector<float>* v : {&particles.vx, &particles.vy, &particles.vz})
    v->assign(particles.size(), 1);
  particles.radius.assign(particles.size(), static_cast<float>(particles.particle_radius));
  particles.attributes = {{"heat", particles.x}};
  // Corners of a box around it and around those that follow.
  for (const float corner : {-20.0f, 20.0f}) {
    for (std::vector<float>* axis : {&particles.x, &particles.y, &particles.z})
      axis->push_back(corner);
    for (std::vector<float>* v : {&particles.vx, &particles.vy, &particles.vz}) v->push_back(1);
    particles.radius.push_back(particles.radius.front());
    particles.attributes[0].values.push_back(0);
  }
  return particles;
}

// The same with so many more, out of view, on a lattice as wide as the dam's, that it streams.
Particles streaming(Particles particles) {
  const float step = 2 * static_cast<float>(DamBreak(6000, 1).particle_radius());
  const int side = 64;
  for (std::int64_t k = 0; static_cast<std::int64_t>(particles.size()) < kStreamed; ++k) {
    add_position(particles, {10 + step * static_cast<float>(k % side),
                             10 + step * static_cast<float>(k / side % side),
                             10 + step * static_cast<float>(k / side / side)});
    for (std::vector<float>* v : {&particles.vx, &particles.vy, &particles.vz})
      if (!v->empty()) v->push_back(1);
    if (!particles.radius.empty()) particles.radius.push_back(particles.radius.front());
    for (Attribute& attribute : particles.attributes) attribute.values.push_back(0);
  }
  return particles;
}

Camera camera() { return look_at({5, 2.2, 3.4}, {1.5, .3, .75}, {0, 1, 0}, 32, 96, 72); }

// What came of a frame: a surface, or the kind of error and its notice.
struct Outcome {
  Surface surface;
  std::string error;
  Notice notice;
};

bool same(const Surface& a, const Surface& b) {
  bool all = same_bits(a, b) && a.attributes.size() == b.attributes.size();
  for (std::size_t k = 0; all && k < a.attributes.size(); ++k)
    all = a.attributes[k].name == b.attributes[k].name &&
          same_bits(a.attributes[k].values, b.attributes[k].values);
  return all;
}

class Door : public testing::Test {
 protected:
  Outcome come_in(const std::function<Surface()>& extract) {
    Outcome outcome;
    try {
      outcome.surface = extract();
    } catch (const InputError& error) {
      outcome = {{}, "InputError", error.notice};
    } catch (const InvalidArgument& error) {
      outcome = {{}, "InvalidArgument", error.notice};
    }
    return outcome;
  }

  // By all ways in; `change` makes the frame what it is.
  void expect_alike(const std::string& what, const std::function<void(Particles&)>& change,
                    const std::set<Code>& codes, Parameters parameters = {},
                    const Camera& seen_by = camera()) {
    SCOPED_TRACE(what);
    Particles particles = small_dam();
    change(particles);
    const Outcome expected =
        come_in([&] { return extract(device_, particles, seen_by, parameters); });
    std::set<Code> found;
    for (const Notice& notice : expected.surface.notices) found.insert(notice.code);
    if (!expected.error.empty()) found.insert(expected.notice.code);
    EXPECT_EQ(found, codes);

    for (const bool in_file : {false, true}) {
      const Outcome other = come_in([&] {
        return in_file ? extract(device_, OwnSource(particles), seen_by, parameters)
                       : extract(device_, *source_of(particles), seen_by, parameters);
      });
      EXPECT_EQ(other.error, expected.error);
      EXPECT_EQ(to_string(other.notice), to_string(expected.notice));
      EXPECT_EQ(texts(other.surface.notices), texts(expected.surface.notices));
      EXPECT_TRUE(same(other.surface, expected.surface));
      EXPECT_EQ(other.surface.counts, expected.surface.counts);
      EXPECT_EQ(other.surface.particle_radius, expected.surface.particle_radius);
    }

    // Where it streams it is more particles, which some numbers tell.
    const Particles large = streaming(particles);
    for (const bool in_file : {false, true}) {
      const Outcome streamed = come_in([&] {
        return in_file ? extract(device_, OwnSource(large), seen_by, parameters)
                       : extract(device_, large, seen_by, parameters);
      });
      EXPECT_EQ(streamed.error, expected.error);
      EXPECT_EQ(streamed.notice.code, expected.notice.code);
      EXPECT_EQ(streamed.notice.count, expected.notice.count);
      EXPECT_EQ(streamed.notice.place, expected.notice.place);
      ASSERT_EQ(streamed.surface.notices.size(), expected.surface.notices.size())
          << testing::PrintToString(texts(streamed.surface.notices));
      for (std::size_t k = 0; k < expected.surface.notices.size(); ++k) {
        EXPECT_EQ(streamed.surface.notices[k].code, expected.surface.notices[k].code);
        EXPECT_EQ(streamed.surface.notices[k].place, expected.surface.notices[k].place);
        if (expected.surface.notices[k].code != Code::none_in_view) {  // which counts all
          EXPECT_EQ(streamed.surface.notices[k].count, expected.surface.notices[k].count);
        }
      }
      EXPECT_TRUE(same(streamed.surface, expected.surface));
      EXPECT_EQ(streamed.surface.camera.width, expected.surface.camera.width);
      EXPECT_EQ(streamed.surface.particle_radius, expected.surface.particle_radius);
    }
  }

  Device device_;
};

TEST_F(Door, GivesTheSameSurfaceHoweverTheParticlesCome) {
  expect_alike("as they are", [](Particles&) {}, {});
  expect_alike("radius as stated", [](Particles& p) { p.radius.clear(); }, {});
  Parameters parameters;
  parameters.particle_radius = 1.1 * small_dam().particle_radius;
  expect_alike(
      "radius as told", [](Particles&) {}, {}, parameters);
}

TEST_F(Door, SaysTheSameOfParticlesThatCannotBeUsed) {
  Parameters strict;
  strict.strict = true;
  const auto lose = [](Particles& p) { p.x[17] = NAN, p.y[400] = INFINITY; };
  expect_alike("not finite", lose, {Code::not_finite});
  expect_alike("not finite, strict", lose, {Code::not_finite}, strict);
  const auto stop = [](Particles& p) { p.vy[17] = NAN; };
  const auto cool = [](Particles& p) { p.attributes[0].values[18] = INFINITY; };
  expect_alike("a velocity", stop, {Code::bad_velocities});
  expect_alike("a velocity, strict", stop, {Code::bad_velocities}, strict);
  expect_alike("an attribute", cool, {Code::bad_attribute});
  expect_alike("an attribute, strict", cool, {Code::bad_attribute}, strict);
}

TEST_F(Door, RefusesTheSame) {
  Parameters wrong;
  wrong.fit.support = -1;
  expect_alike(
      "parameter", [](Particles&) {}, {Code::parameter_out_of_range}, wrong);
  // The camera's fault is named before the parameters', and theirs before the particles'.
  const auto bad = [](Particles& p) { p.radius[5] = -1; };
  expect_alike("parameter and radius", bad, {Code::parameter_out_of_range}, wrong);
  expect_alike("camera, parameter and radius", bad, {Code::other}, wrong, Camera{});
}

TEST_F(Door, SaysTheSameOfAnEmptyView) {
  const Camera away = look_at({5, 2.2, 3.4}, {10, -8, 30}, {0, 1, 0}, 32, 64, 48);
  expect_alike(
      "out of view", [](Particles&) {}, {Code::none_in_view}, {}, away);
}

// On a part of a device the host's loops keep to as many threads, in frames of any size.
TEST_F(Door, KeepsToTheThreadsOfAPart) {
  const int all = tbb::this_task_arena::max_concurrency();
  DeviceInfo info = select_device();
  info.is_part = true;
  info.compute_units = 1;
  Device part(info);
  std::map<std::string, int> threads;  // of each stage
  part.on_stage(
      [&](const std::string& stage) { threads[stage] = tbb::this_task_arena::max_concurrency(); });
  Parameters parameters;
  parameters.mesh = false;
  const Particles particles = small_dam(), large = streaming(particles);
  extract(part, particles, camera(), parameters);
  EXPECT_GT(threads.size(), 5u);
  extract(part, large, camera(), parameters);
  EXPECT_EQ(threads.count("survey"), 1u);
  EXPECT_EQ(threads.count("select"), 1u);
  for (const auto& [stage, count] : threads) EXPECT_EQ(count, 1) << stage;
  EXPECT_EQ(tbb::this_task_arena::max_concurrency(), all);
}

}  // namespace
}  // namespace meniscus
