// extract() of frames that stream: the same bytes whatever way they came, and a surface that is
// where the fluid's is.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "base/printed.hpp"
#include "meniscus/closed.hpp"
#include "meniscus/device.hpp"
#include "meniscus/extract.hpp"
#include "meniscus/io.hpp"
#include "own_source.hpp"
#include "prepare/choose_radius.hpp"
#include "prepare/fill.hpp"
#include "program/dam_break.hpp"
#include "same_bits.hpp"
#include "stages/vec.hpp"
#include "texts.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

// All turns about an axis and drifts.
const Vec3d kSpin{0.5, -2, 1};
Vec3d moves_at(const Vec3d& p) { return cross(kSpin, p) + Vec3d{3, 0, -1}; }

Particles dam_particles(const DamBreak& dam) {
  Particles particles = dam.particles();
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const Vec3 v = static_cast<Vec3>(moves_at({particles.x[i], particles.y[i], particles.z[i]}));
    particles.vx.push_back(v.x);
    particles.vy.push_back(v.y);
    particles.vz.push_back(v.z);
  }
  return particles;
}

const DamBreak& dam() {
  static const DamBreak made(300000, 1);
  return made;
}
const Particles& frame() {
  static const Particles made = dam_particles(dam());
  return made;
}

// Particles of this frame are some 1.7 pixels apart.
Camera small_camera() { return look_at({5, 2.2, 3.4}, {1.5, .3, .75}, {0, 1, 0}, 32, 320, 240); }

bool same(const Surface& a, const Surface& b) { return same_bits(a, b) && a.counts == b.counts; }

class ExtractSource : public testing::Test {
 protected:
  Device device_;
};

TEST_F(ExtractSource, GivesTheSameBytesForAnyMemoryAndOrder) {
  ASSERT_GE(static_cast<std::int64_t>(frame().size()), kStreamed);
  const Surface expected = extract(device_, frame(), small_camera());
  EXPECT_EQ(expected.counts.particles, 300000);
  EXPECT_TRUE(expected.counts.streamed);
  EXPECT_GT(expected.counts.representatives, 1000);
  EXPECT_LT(expected.counts.representatives, 100000);
  const auto source = source_of(frame());
  for (const std::size_t memory : {std::size_t{2} << 20, std::size_t{9} << 20})
    EXPECT_TRUE(same(expected, extract(device_, *source, small_camera(), {}, nullptr, memory)))
        << memory;

  std::vector<std::size_t> order(frame().size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), std::mt19937(1));
  Particles shuffled = frame();
  for (std::size_t i = 0; i < order.size(); ++i) {
    shuffled.x[i] = frame().x[order[i]];
    shuffled.y[i] = frame().y[order[i]];
    shuffled.z[i] = frame().z[order[i]];
    shuffled.vx[i] = frame().vx[order[i]];
    shuffled.vy[i] = frame().vy[order[i]];
    shuffled.vz[i] = frame().vz[order[i]];
  }
  EXPECT_TRUE(same(expected, extract(device_, shuffled, small_camera())));
}

TEST_F(ExtractSource, WarnsOfCoarsePositionsByTheParticlesOwnRadius) {
  constexpr float kAway = 1 << 19;
  Particles far = frame();
  for (float& x : far.x) x += kAway;
  Camera camera = look_at({5 + kAway, 2.2, 3.4}, {1.5 + kAway, .3, .75}, {0, 1, 0}, 32, 320, 240);
  const Surface surface = extract(device_, far, camera);
  EXPECT_GT(surface.counts.representatives, 0);
  EXPECT_THAT(texts(surface.notices),
              testing::Contains(testing::HasSubstr(
                  printed("their radius is %g: positions are rounded", surface.particle_radius))));
}

TEST_F(ExtractSource, RefusesBadRadiiAlikeInFramesOfAllSizes) {
  for (Particles particles : {frame(), dam_particles(DamBreak(1000, 1))}) {
    particles.radius.assign(particles.size(), 0.01f);
    particles.radius[5] = -1;
    EXPECT_THROW(extract(device_, particles, small_camera()), InvalidArgument);
    EXPECT_THROW(extract(device_, *source_of(particles), small_camera()), InvalidArgument);
    EXPECT_THROW(extract(device_, OwnSource(particles), small_camera()), InputError);
  }
}

// A few large particles among the others would cover the whole front.
TEST_F(ExtractSource, ParticlesOfVeryDifferentRadiiAreAllOfOne) {
  for (const bool streams : {false, true}) {
    Particles particles = streams ? frame() : dam_particles(DamBreak(3000, 1));
    const auto alike = static_cast<float>(particles.particle_radius);
    const auto with_radii = [&](float large) {
      particles.radius.assign(particles.size(), alike);
      for (std::size_t i = 0; i < particles.size(); i += 20) particles.radius[i] = large;
      // Near enough that particles are not thinned.
      return extract(device_, particles,
                     look_at({3, 1.4, 2}, {1.5, .3, .75}, {0, 1, 0}, 16, 480, 360));
    };
    const Surface expected = with_radii(alike), mixed = with_radii(10 * alike);
    EXPECT_EQ(mixed.counts.representatives, -1);
    EXPECT_THAT(texts(expected.notices), testing::IsEmpty());
    EXPECT_THAT(texts(mixed.notices),
                testing::ElementsAre(testing::AllOf(
                    testing::HasSubstr(
                        printed("the particles' radii run from %.6g to %.6g", alike, 10 * alike)),
                    testing::HasSubstr(printed("their median, %.6g, is used for all", alike)))));
    EXPECT_TRUE(same(mixed, expected)) << streams;
    EXPECT_FALSE(same(with_radii(1.2f * alike), expected)) << streams;
  }
}

TEST_F(ExtractSource, ARadiusThatIsGivenEndsWhatIsSaidOfTheOthers) {
  Particles particles = dam_particles(DamBreak(3000, 1));
  Parameters parameters;
  parameters.particle_radius = particles.particle_radius;
  const Surface expected = extract(device_, particles, small_camera(), parameters);
  particles.radius.assign(particles.size(), static_cast<float>(particles.particle_radius));
  for (std::size_t i = 0; i < particles.size(); i += 20) particles.radius[i] *= 10;
  const Surface mixed = extract(device_, particles, small_camera(), parameters);
  EXPECT_THAT(texts(mixed.notices), testing::IsEmpty());
  EXPECT_TRUE(same(mixed, expected));
  parameters.method = Method::spheres;  // of their own sizes
  EXPECT_GT(extract(device_, particles, small_camera(), parameters).counts.pixels,
            mixed.counts.pixels);
}

TEST_F(ExtractSource, TellsHowIrregularlyTheParticlesLay) {
  Parameters parameters;
  const auto disorder_of = [&](const Particles& particles) {
    return extract(device_, particles, small_camera(), parameters).disorder;
  };
  const Particles sph = read_particles(std::string(MENISCUS_EXAMPLE_DATA) + "/dam/frame_015.ply"),
                  flip = dam_particles(DamBreak(20000, 1, 0.29));
  EXPECT_EQ(disorder_of(sph), 0);
  EXPECT_NEAR(disorder_of(flip), 1, 0.15);
  EXPECT_NEAR(extract_closed(device_, flip).disorder, 1, 0.15);
  parameters.disorder = 0.25;
  EXPECT_EQ(disorder_of(sph), 0.25);
  parameters.method = Method::ssm;  // which takes particles as they are
  EXPECT_EQ(disorder_of(flip), 0);
}

// A view draws a lone particle as large as it is, too.
TEST_F(ExtractSource, DrawsDropsOfIrregularParticles) {
  Particles one;
  one.x = one.y = one.z = {0};
  one.particle_radius = 1;
  const Camera camera = look_at({0, 0, 20}, {0, 0, 0}, {0, 1, 0}, 20, 400, 400);
  Parameters parameters;
  parameters.disorder = 0;
  const auto pixels = static_cast<double>(extract(device_, one, camera, parameters).counts.pixels);
  EXPECT_GT(pixels, 10000);
  for (const double disorder : {0.25, 0.5, 1.0, 1.5, 2.0}) {
    parameters.disorder = disorder;
    EXPECT_NEAR(static_cast<double>(extract(device_, one, camera, parameters).counts.pixels),
                pixels, 0.05 * pixels)
        << disorder;
  }
}

// A frame that streams is told by samples; its parts are made with what they tell.
TEST_F(ExtractSource, ClosesIrregularParticlesThatStreamAsThoseAtHand) {
  const DamBreak irregular(270000, 1, 0.29);
  const Particles flip = irregular.particles();
  ASSERT_GE(static_cast<std::int64_t>(flip.size()), kStreamed);
  const Surface surface = extract_closed(device_, flip);
  EXPECT_NEAR(surface.disorder, 1, 0.15);
  EXPECT_TRUE(same(surface, extract_closed(device_, flip, {.memory = 20 << 20}))) << "in parts";
  Parameters parameters;
  parameters.disorder = 0;
  EXPECT_FALSE(same_bits(surface, extract_closed(device_, flip, {}, parameters)));
}

TEST_F(ExtractSource, ClosesOrderlyParticlesThatStreamAsTheyAre) {
  std::mt19937 random(5);
  std::normal_distribution<float> noise(0, 0.1f);  // radii
  Particles lattice;
  lattice.particle_radius = 1;
  for (int i = 0; i < 65 * 65 * 64; ++i)
    add_position(lattice, {2.0f * (i % 65) + noise(random), 2.0f * (i / 65 % 65) + noise(random),
                           2.0f * (i / (65 * 65)) + noise(random)});
  ASSERT_GE(static_cast<std::int64_t>(lattice.size()), kStreamed);
  Parameters parameters;
  parameters.disorder = 0;
  const Surface surface = extract_closed(device_, lattice);
  EXPECT_EQ(surface.disorder, 0);
  EXPECT_TRUE(same(surface, extract_closed(device_, lattice, {}, parameters)));
}

// Where particles are thinned.
TEST_F(ExtractSource, TellsThatTheRadiusDoesNotFitTheSpacing) {
  const double fitting = frame().particle_radius;
  for (const double factor : {0.01, 0.2, 1.0, 1.4, 3.0}) {
    Parameters parameters;
    parameters.mesh = false;
    parameters.particle_radius = factor * fitting;
    const Surface surface =
        extract(device_, frame(), look_at({5, 2.2, 3.4}, {1.5, .3, .75}, {0, 1, 0}, 32, 64, 48),
                parameters);
    const auto told = std::find_if(surface.notices.begin(), surface.notices.end(),
                                   [](const Notice& notice) { return !std::isnan(notice.wanted); });
    ASSERT_EQ(told == surface.notices.end(), factor == 1 || factor == 1.4) << factor;
    EXPECT_TRUE(surface.counts.representatives > 0 || surface.counts.spray > 0) << factor;
    if (told == surface.notices.end()) continue;
    EXPECT_EQ(told->code, factor < 1 ? Code::radius_too_small : Code::radius_too_large);
    EXPECT_NEAR(told->wanted, fitting, 0.07 * fitting);
  }
}

TEST_F(ExtractSource, NamesTheLeastMemory) {
  const auto source = source_of(frame());
  EXPECT_THAT(text_of_thrown<InvalidArgument>(
                  [&] { extract(device_, *source, small_camera(), {}, nullptr, 1000); }),
              testing::HasSubstr("memory is 1000 bytes, must be at least"));
}

// The error of the thinned surface, along its normal, in pixels: representatives are 3.4 pixels
// apart, and docs/performance.md has a median of .1 pixels at 1.5 and at .7 pixels a spacing.
TEST_F(ExtractSource, ThinningKeepsTheSurface) {
  Parameters parameters;
  parameters.mesh = false;
  const Surface surface = extract(device_, frame(), small_camera(), parameters);
  std::vector<double> errors;
  int found = 0, open = 0;
  for (std::size_t s = 0; s < surface.depth.size(); ++s) {
    const Vec3 p = surface.position[s];
    if (surface.kind[s] != Kind::surface || p.x < 0.1f || p.x > 1 || p.z < 0.1f || p.z > 1.3f)
      continue;
    const double h = dam().height(p.x, p.z), e = 1e-4;
    const double slope =
        std::hypot((dam().height(p.x + e, p.z) - h) / e, (dam().height(p.x, p.z + e) - h) / e);
    const double pixel = 5 * 2 * std::tan(0.2793) / 240;  // world units, 5 units before the eye
    errors.push_back(std::abs(p.y - h) / std::sqrt(1 + slope * slope) / pixel);
    ++found;
  }
  for (std::size_t s = 0; s < surface.depth.size(); ++s) open += surface.kind[s] == Kind::none;
  ASSERT_GT(found, 1000);
  EXPECT_LT(open, 70000);
  std::nth_element(errors.begin(), errors.begin() + found / 2, errors.end());
  EXPECT_LT(errors[static_cast<std::size_t>(found / 2)], 0.2);
  std::nth_element(errors.begin(), errors.begin() + found * 95 / 100, errors.end());
  EXPECT_LT(errors[static_cast<std::size_t>(found * 95 / 100)], 0.8);
}

// A representative has the mean velocity of what it stands for, which it lies no farther from than
// half of the representatives' spacing S; a pixel's is a mean over representatives within 2 S. What
// turns is linear, so that this is the velocity of a place within 2.5 S: ten pixels, 4 apart each.
// Sums are of steps of 2^-20 S per second.
TEST_F(ExtractSource, ThinningKeepsTheMotion) {
  Parameters parameters;
  parameters.method = Method::stable;
  const Surface surface = extract(device_, frame(), small_camera(), parameters);
  ASSERT_GT(surface.counts.representatives, 1000);
  const double pixel = 6.2 * 2 * std::tan(0.2793) / 240;  // at the tank's far end
  const auto expect = [&](const Vec3& velocity, const Vec3& at) {
    EXPECT_LT(length(Vec3d(velocity) - moves_at(Vec3d(at))), 10 * pixel * length(kSpin));
  };
  int covered = 0;
  for (std::size_t s = 0; s < surface.depth.size(); ++s) {
    if (surface.kind[s] == Kind::none) continue;
    ++covered;
    expect(surface.velocity[s], surface.position[s]);
  }
  EXPECT_GT(covered, 10000);
  for (std::size_t k = 0; k < surface.mesh.position.size(); ++k)
    expect(surface.mesh.velocity[k], surface.mesh.position[k]);
}

// An attribute takes the way of velocities, in sums of its own: scaled to its largest value in
// steps of 2^-36 of it, so that the two differ by the rounding of floats and of the velocities'
// steps.
TEST_F(ExtractSource, ThinningCarriesAttributesAsVelocities) {
  Particles particles = frame();
  particles.attributes = {{"vy", particles.vy}, {"tiny", particles.vx}};
  for (float& value : particles.attributes[1].values) value *= 0x1p-60f;
  Parameters parameters;
  parameters.method = Method::stable;
  const Surface surface = extract(device_, particles, small_camera(), parameters);
  ASSERT_GT(surface.counts.representatives, 1000);
  ASSERT_EQ(surface.attributes.size(), 2u);
  float most = 0;
  for (const Vec3& v : surface.velocity) most = std::max({most, std::abs(v.x), std::abs(v.y)});
  ASSERT_GT(most, 0);
  const float step = most * 1e-5f;
  for (std::size_t s = 0; s < surface.depth.size(); ++s) {
    ASSERT_NEAR(surface.attributes[0].values[s], surface.velocity[s].y, step);
    ASSERT_NEAR(surface.attributes[1].values[s] * 0x1p60f, surface.velocity[s].x, step);
  }
  for (std::size_t k = 0; k < surface.mesh.position.size(); ++k)
    ASSERT_NEAR(surface.mesh.attributes[0].values[k], surface.mesh.velocity[k].y, step);
}

TEST_F(ExtractSource, ReportsVelocitiesThatAreNoneOfWhatIsSeen) {
  Particles particles = frame();
  for (std::size_t i = 0; i < particles.size(); i += 2) particles.vy[i] = NAN;
  Parameters parameters;
  parameters.mesh = false;
  const Surface surface = extract(device_, particles, small_camera(), parameters);
  ASSERT_EQ(surface.notices.size(), 1u);
  EXPECT_THAT(texts(surface.notices)[0],
              testing::AllOf(testing::HasSubstr("particles near what is seen have NaN, infinite or "
                                                "absurd velocities (the first is particle "),
                             testing::HasSubstr("left out")));
  for (const Vec3& v : surface.velocity)
    EXPECT_TRUE(std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z));
  parameters.strict = true;
  EXPECT_THROW(extract(device_, particles, small_camera(), parameters), InputError);
  parameters.motion = false;
  EXPECT_TRUE(extract(device_, particles, small_camera(), parameters).velocity.empty());
}

// A lone particle far from the rest shows as one pixel, nearer than a particle's size can.
TEST_F(ExtractSource, LosesNoLoneParticle) {
  Particles particles = frame();
  const Vec3 lone{1.5f, 1.1f, 0.75f};
  add_position(particles, Vec3d(lone));
  particles.vx.push_back(0);
  particles.vy.push_back(7);
  particles.vz.push_back(0);
  Parameters parameters;
  parameters.mesh = false;
  const Surface without = extract(device_, frame(), small_camera(), parameters);
  const Surface with = extract(device_, particles, small_camera(), parameters);
  int more = 0;
  for (std::size_t s = 0; s < with.depth.size(); ++s) {
    if (with.kind[s] != Kind::splash || without.kind[s] == Kind::splash) continue;
    // The particle moves the bounds, and with them which particles stand for others: where blend
    // and field share a sample by halves, its kind may change. The lone particle lies 1.4 before
    // all else.
    if (std::abs(with.depth[s] - without.depth[s]) < 0.1f) continue;
    ++more;
    const double apart = std::hypot(with.position[s].x - lone.x, with.position[s].y - lone.y,
                                    with.position[s].z - lone.z);
    EXPECT_LT(apart, 0.02);  // a pixel and a particle: .012 and .009
    EXPECT_NEAR(with.velocity[s].y, 7, 1e-5);
  }
  EXPECT_GE(more, 1);
  EXPECT_LE(more, 4);
}

// A small dam, and a corner of a box on either side, not so far that it is a stray.
Particles dam_in_a_box() {
  Particles particles = dam_particles(DamBreak(20000, 1));
  for (const float corner : {-20.0f, 20.0f}) {
    add_position(particles, {corner, corner, corner});
    particles.vx.push_back(corner);
    particles.vy.push_back(0);
    particles.vz.push_back(0);
  }
  return particles;
}

// The same with so many more, out of view, that it streams.
Particles streaming(Particles particles) {
  std::mt19937 random(4);
  while (static_cast<std::int64_t>(particles.size()) < kStreamed) {
    add_position(particles, {18 + static_cast<float>(random() % 1000) * 0.002f,
                             18 + static_cast<float>(random() % 1000) * 0.002f,
                             18 + static_cast<float>(random() % 1000) * 0.002f});
    particles.vx.push_back(5);
    particles.vy.push_back(NAN);
    particles.vz.push_back(5);
  }
  return particles;
}

// What is not thinned is what a smaller frame of the same particles gives: far ones, out of view,
// make a frame large and change nothing.
TEST_F(ExtractSource, WithoutThinningNothingChanges) {
  const Particles particles = dam_in_a_box(), large = streaming(particles);
  const Camera camera = small_camera();
  for (const Method method : {Method::fit, Method::ssm, Method::paper}) {
    Parameters parameters;
    parameters.method = method;
    const Surface expected = extract(device_, particles, camera, parameters);
    Surface found = extract(device_, large, camera, parameters);
    EXPECT_EQ(found.counts.particles, kStreamed);
    EXPECT_TRUE(found.counts.streamed && !expected.counts.streamed);
    found.counts.particles = static_cast<std::int64_t>(particles.size());
    found.counts.streamed = false;
    EXPECT_TRUE(same(expected, found)) << to_string(method);
  }
}

// A solver that has failed leaves many particles in one place: they show one drop.
TEST_F(ExtractSource, ACrowdIsADropInFramesOfAnySize) {
  const auto with_crowd = [](std::size_t count) {
    Particles particles = dam_in_a_box();
    for (std::size_t k = 0; k < count; ++k) {
      add_position(particles, {1.5f, 1, 0.75f});
      particles.vx.push_back(3);
      particles.vy.push_back(2);
      particles.vz.push_back(1);
    }
    return particles;
  };
  const Camera camera = small_camera();
  const Surface one = extract(device_, with_crowd(1), camera);
  EXPECT_THAT(texts(one.notices), testing::IsEmpty());
  const auto expect_one = [&](Surface many) {
    EXPECT_THAT(texts(many.notices),
                testing::Contains(testing::HasSubstr("up to 1000 particles crowd into a cube")));
    many.counts = one.counts;
    EXPECT_TRUE(same(one, many));
  };
  expect_one(extract(device_, with_crowd(1000), camera));
  expect_one(extract(device_, streaming(with_crowd(1000)), camera));
}

TEST_F(ExtractSource, ACrowdDoesNotTouchTheEstimatedRadius) {
  Particles particles = dam_in_a_box();
  particles.particle_radius = 0;
  Notices notices;
  const double alone = choose_radius(*source_of(particles), {}, notices);
  for (std::vector<float>* values :
       {&particles.x, &particles.y, &particles.z, &particles.vx, &particles.vy, &particles.vz})
    values->resize(50000, values->front());
  EXPECT_EQ(choose_radius(*source_of(particles), {}, notices), alone);
}

TEST_F(ExtractSource, ReportsBadParticlesOnceAndRefusesThemWhenStrict) {
  Particles particles = frame();
  particles.x[17] = NAN;
  particles.y[400] = INFINITY;
  Parameters parameters;
  parameters.mesh = false;
  const Surface surface = extract(device_, particles, small_camera(), parameters);
  EXPECT_THAT(texts(surface.notices),
              testing::ElementsAre("2 of 300000 particles have NaN or infinite coordinates (the "
                                   "first is particle 17) and were dropped"));
  parameters.strict = true;
  EXPECT_THROW(extract(device_, particles, small_camera(), parameters), InputError);
}

TEST_F(ExtractSource, AnEmptyViewIsEmpty) {
  Parameters parameters;
  const Camera away = look_at({5, 2.2, 3.4}, {10, 3, 9}, {0, 1, 0}, 32, 64, 48);
  const Surface surface = extract(device_, frame(), away, parameters);
  EXPECT_EQ(surface.counts.in_view, 0);
  EXPECT_THAT(texts(surface.notices),
              testing::ElementsAre(
                  "no particle is in view: the surface is empty (check where the camera is "
                  "and looks)"));
}

TEST(FrameSource, FramesWhatItsParticlesWould) {
  const Camera a = frame_particles(frame(), {.width = 320, .height = 240});
  const Camera b = frame_particles(OwnSource(frame()), {.width = 320, .height = 240});
  EXPECT_EQ(a.view, b.view);
  EXPECT_EQ(a.projection, b.projection);
}

}  // namespace
}  // namespace meniscus
