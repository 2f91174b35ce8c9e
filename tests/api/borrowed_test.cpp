// Particles in memory of others: every layout gives the surface that vectors of floats give.
#include "meniscus/borrowed.hpp"

#include <gmock/gmock.h>

#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "device/stage_clock.hpp"
#include "meniscus/device.hpp"
#include "meniscus/extract.hpp"
#include "meniscus/named_parameters.hpp"
#include "same_bits.hpp"
#include "stages/vec.hpp"
#include "texts.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(Column, ReadsFloatsAndDoublesAtAnyDistance) {
  const std::vector<float> values{0, 1, 2, 3, 4, 5, 6};
  const Column every_third(values.data(), 3, 3 * sizeof(float));
  EXPECT_THAT((std::vector{every_third[0], every_third[1], every_third[2]}), ElementsAre(0, 3, 6));
  const Column backwards(values.data() + 6, 7, -std::ptrdiff_t{sizeof(float)});
  float copied[3];
  backwards.copy(2, 3, copied);
  EXPECT_THAT(copied, ElementsAre(4, 3, 2));
  const double wide[] = {0.1, 1e300, -1e-300};
  const Column doubles(wide, 3);
  doubles.copy(0, 3, copied);
  EXPECT_THAT(copied, ElementsAre(0.1f, std::numeric_limits<float>::infinity(), -0.0f));
  EXPECT_EQ(doubles[0], 0.1f);
  EXPECT_TRUE(Column().empty());
  Column().copy(0, 0, nullptr);
}

TEST(Column, ReadsWhereNothingIsAligned) {
  std::vector<char> bytes(1 + 3 * 13);
  for (int k = 0; k < 3; ++k) {
    const double value = 1.5 * k;
    std::memcpy(bytes.data() + 1 + 13 * k, &value, sizeof value);
  }
  const Column packed(reinterpret_cast<const double*>(bytes.data() + 1), 3, 13);
  float copied[3];
  packed.copy(0, 3, copied);
  EXPECT_THAT(copied, ElementsAre(0, 1.5f, 3));
  EXPECT_EQ(packed[2], 3);
}

Particles cube(int side) {
  Particles particles;
  particles.particle_radius = 0.5;
  for (int k = 0; k < side * side * side; ++k) {
    add_position(particles, Vec3d(k % side, k / side % side, k / side / side));
    particles.vx.push_back(particles.y.back());
    particles.vy.push_back(0);
    particles.vz.push_back(-1);
    particles.radius.push_back(k % 5 == 0 ? 0.45f : 0.5f);
  }
  return particles;
}

// Rows of seven doubles and a byte, as a simulation's records may be.
struct Records {
  static constexpr std::ptrdiff_t kRow = 7 * sizeof(double) + 1;
  std::vector<char> bytes;
  BorrowedParticles borrowed;

  explicit Records(const Particles& p) : bytes(p.size() * static_cast<std::size_t>(kRow)) {
    const std::vector<float>* const from[] = {&p.x, &p.y, &p.z, &p.vx, &p.vy, &p.vz, &p.radius};
    Column* const to[] = {&borrowed.x,  &borrowed.y,  &borrowed.z,     &borrowed.vx,
                          &borrowed.vy, &borrowed.vz, &borrowed.radius};
    for (std::size_t c = 0; c < 7; ++c) {
      for (std::size_t i = 0; i < p.size(); ++i) {
        const double value = (*from[c])[i];
        std::memcpy(bytes.data() + static_cast<std::ptrdiff_t>(i) * kRow + c * sizeof value, &value,
                    sizeof value);
      }
      *to[c] = Column(reinterpret_cast<const double*>(bytes.data() + c * sizeof(double)), p.size(),
                      kRow);
    }
    borrowed.particle_radius = p.particle_radius;
  }
};

TEST(Borrowed, GivesTheSameSurfaceAsVectors) {
  const Particles particles = cube(12);
  const Records records(particles);
  const Camera camera = frame_particles(particles, {.width = 80, .height = 60});
  EXPECT_EQ(frame_particles(records.borrowed, {.width = 80, .height = 60}).view, camera.view);
  Device device;
  const Surface expected = extract(device, particles, camera);
  ASSERT_FALSE(expected.mesh.triangle.empty());
  for (const Surface& surface : {extract(device, records.borrowed, camera),
                                 extract(device, *source_of(records.borrowed), camera)}) {
    EXPECT_TRUE(same_bits(surface.depth, expected.depth));
    EXPECT_TRUE(same_bits(surface.velocity, expected.velocity));
    EXPECT_TRUE(same_bits(surface.mesh.position, expected.mesh.position));
    EXPECT_EQ(texts(surface.notices), texts(expected.notices));
  }
}

TEST(Borrowed, GivesTheSameSurfaceWhereItStreams) {
  const Particles particles = cube(66);  // 2^18 and more
  const Records records(particles);
  const Camera camera = frame_particles(particles, {.width = 80, .height = 60});
  Device device;
  const Surface expected = extract(device, particles, camera);
  const Surface surface = extract(device, records.borrowed, camera);
  EXPECT_TRUE(same_bits(surface.depth, expected.depth));
  EXPECT_TRUE(same_bits(surface.velocity, expected.velocity));
}

TEST(Borrowed, RefusesColumnsThatDoNotFit) {
  Particles particles = cube(3);
  const Camera camera = frame_particles(particles, {.width = 8, .height = 6});
  BorrowedParticles borrowed(particles);
  borrowed.y = Column(particles.y.data(), 26);
  Device device;
  EXPECT_THAT(text_of_thrown<InvalidArgument>([&] { extract(device, borrowed, camera); }),
              HasSubstr("x, y and z have 27, 26 and 27 values"));
  borrowed = BorrowedParticles(particles);
  borrowed.radius = Column(particles.radius.data(), 5);
  EXPECT_THROW(source_of(borrowed), InvalidArgument);
  particles.density = {1};
  EXPECT_THROW(extract(device, particles, camera), InvalidArgument);
}

TEST(OnStage, IsCalledAtEachStageAndMayEndIt) {
  const Particles particles = cube(8);
  const Camera camera = frame_particles(particles, {.width = 64, .height = 48});
  Device device;
  std::vector<StageTime> timings;
  std::vector<std::string> begun, timed;
  device.on_stage([&](const std::string& stage) { begun.push_back(stage); });
  const Surface expected = extract(device, particles, camera, {}, &timings);
  for (const StageTime& time : timings)
    if (time.stage != kBuilding) timed.push_back(time.stage);
  EXPECT_EQ(begun, timed);
  ASSERT_GT(begun.size(), 5u);
  // Wherever it ends, the next frame is as ever.
  for (std::size_t last = 0; last < begun.size(); ++last) {
    std::size_t count = 0;
    device.on_stage([&](const std::string&) {
      if (count++ == last) throw std::logic_error("enough");
    });
    EXPECT_THROW(extract(device, particles, camera), std::logic_error) << begun[last];
  }
  device.on_stage({});
  EXPECT_TRUE(same_bits(extract(device, particles, camera).depth, expected.depth));
}

TEST(NamedParameters, AreSetByName) {
  Parameters parameters;
  for (const NamedParameter& one : named_parameters()) {
    set_parameter(parameters, one.name, one.value);
    EXPECT_THROW(set_parameter(parameters, one.name, 2 * one.most + 1), InvalidArgument)
        << one.name;
    parameters = {};
  }
  EXPECT_EQ(describe(parameters), describe(Parameters{}));
  set_parameter(parameters, "support", 7.5);
  EXPECT_EQ(parameters.fit.support, 7.5);
  set_parameter(parameters, "passes", 2);
  EXPECT_EQ(parameters.fit.passes, 2);
  EXPECT_THROW(set_parameter(parameters, "passes", 1.5), InvalidArgument);
  EXPECT_THROW(set_parameter(parameters, "passes", 1e300), InvalidArgument);
  EXPECT_THAT(text_of_thrown<InvalidArgument>([&] { set_parameter(parameters, "foot-print", 1); }),
              HasSubstr("nearest name is footprint"));
  EXPECT_EQ(text_of_thrown<InvalidArgument>([&] { set_parameter(parameters, "foo", 1); }),
            "there is no parameter foo; named_parameters() lists those there are");
}

TEST(Version, MacrosAndFunctionAgree) {
  EXPECT_EQ(version(), std::to_string(MENISCUS_VERSION / 1'000'000) + "." +
                           std::to_string(MENISCUS_VERSION / 1000 % 1000) + "." +
                           std::to_string(MENISCUS_VERSION % 1000));
  static_assert(MENISCUS_VERSION >= MENISCUS_VERSION_OF(0, 1, 0));
}

}  // namespace
}  // namespace meniscus
