#include "prepare/fill.hpp"

#include <array>
#include <functional>
#include <utility>

#include "base/order_statistics.hpp"
#include "base/parallel.hpp"
#include "base/printed.hpp"
#include "base/team.hpp"
#include "prepare/attributes.hpp"
#include "prepare/canonical_order.hpp"
#include "prepare/check_radius.hpp"
#include "prepare/choose_radius.hpp"
#include "prepare/collect.hpp"
#include "prepare/crowds.hpp"
#include "prepare/origin.hpp"
#include "prepare/stream.hpp"
#include "prepare/survey.hpp"
#include "prepare/velocities.hpp"

namespace meniscus {
namespace {

/// Particles in an order, and their bounds.
struct Ordered {
  WorldParticles world;
  std::array<float, 3> low{}, high{};
};

Ordered in_order(const BorrowedParticles& particles, const std::vector<std::size_t>& order,
                 double radius, bool own_sizes, bool moving) {
  Ordered made;
  WorldParticles& world = made.world;
  const std::array axes{std::pair{&particles.x, &world.x}, std::pair{&particles.y, &world.y},
                        std::pair{&particles.z, &world.z}};
  parallel_for(axes.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      std::vector<float>& to = *axes[k].second;
      to.resize(order.size());
      for (std::size_t i = 0; i < order.size(); ++i) to[i] = (*axes[k].first)[order[i]];
      const Bounds bounds = bounds_of(to);
      made.low[k] = bounds.least;
      made.high[k] = bounds.most;
    }
  });
  if (own_sizes && !particles.radius.empty())
    for (const std::size_t i : order)
      world.scale.push_back(static_cast<float>(particles.radius[i] / radius));
  world.moving = moving;
  if (moving)
    for (const std::size_t i : order)
      world.velocity.push_back({particles.vx[i], particles.vy[i], particles.vz[i]});
  for (const BorrowedAttribute& attribute : particles.attributes) {
    Attribute& ordered = world.attributes.emplace_back(Attribute{attribute.name, {}});
    for (const std::size_t i : order) ordered.values.push_back(attribute.values[i]);
  }
  return made;
}

/// Leaves out velocities and attributes that cannot be used; `order` has their places in the frame.
void check_values(const std::vector<std::size_t>& order, const Parameters& params,
                  WorldParticles& world, Notices& notices) {
  const auto place = [&](std::size_t k) { return static_cast<std::int64_t>(order[k]); };
  VelocityCheck velocities;
  for (std::size_t k = 0; k < world.velocity.size(); ++k)
    world.velocity[k] = velocities.checked(world.velocity[k], place(k));
  velocities.report("particles", params, notices);
  for (Attribute& attribute : world.attributes) {
    ValueCheck values;
    for (std::size_t k = 0; k < attribute.values.size(); ++k)
      attribute.values[k] = values.checked(attribute.values[k], place(k));
    values.report(attribute.name, params, notices);
  }
}

/// What is known of some particles, whose radii all are > 0.
RadiusClues clues_of(const BorrowedParticles& particles, const std::vector<std::size_t>& order) {
  RadiusClues clues{.stated = particles.particle_radius};
  if (particles.radius.empty() || order.empty()) return clues;
  std::vector<float> radii;
  for (const std::size_t i : order) radii.push_back(particles.radius[i]);
  const Bounds bounds = bounds_of(radii);
  clues.least = bounds.least;
  clues.most = bounds.most;
  clues.middle = median_of(std::move(radii));
  return clues;
}

/// Puts particles in order, without those that lie `farthest` particle radii or more from the
/// origin. `view` makes the view of a radius and an origin; the one of make_world_view(), where
/// `farthest` is finite.
template <class MakeView>
FilledFrame fill_whole(const Filling& filling, const BorrowedParticles& particles,
                       const MakeView& view, double farthest) {
  FilledFrame frame;
  filling.clock.start("order");
  std::vector<std::size_t> order = canonical_order(particles, filling.params, filling.notices);
  std::function<RadiusEstimate()> estimate;
  if (!order.empty()) estimate = [&] { return estimate_radius(particles, order); };
  const RadiusClues clues = clues_of(particles, order);
  frame.radius = choose_radius(filling.params, clues, estimate, filling.notices);
  order = without_crowds(particles, std::move(order), frame.radius, filling.notices);
  const auto ordered = [&] {
    return in_order(particles, order, frame.radius,
                    draws_own_sizes(filling.params, clues, frame.radius),
                    filling.params.motion && !particles.vx.empty());
  };
  Ordered made = ordered();
  std::array<double, 3> origin{};
  if (!order.empty()) {
    std::vector<std::array<float, 3>> sample;
    constexpr std::size_t kSample = 1024;
    for (std::size_t i = 0; i < order.size(); i += 1 + order.size() / kSample)
      sample.push_back({made.world.x[i], made.world.y[i], made.world.z[i]});
    origin = origin_of(made.low, made.high, sample);
  }
  frame.view = view(frame.radius, origin);
  const SpaceBox near = SpaceBox::around_origin(farthest);
  if (reaches_beyond(frame.view, near, made.low, made.high)) {
    const std::size_t far = std::erase_if(order, [&](std::size_t i) {
      return !near.holds(
          eye_from_world(frame.view, {particles.x[i], particles.y[i], particles.z[i]}));
    });
    report_far(static_cast<std::int64_t>(far), static_cast<std::int64_t>(far + order.size()),
               farthest, filling.params, filling.notices);
    made = ordered();
  }
  frame.particles = std::move(made.world);
  check_values(order, filling.params, frame.particles, filling.notices);
  warn_of_coarse_positions(frame.view, frame.radius, filling.notices);
  filling.clock.stop();
  return frame;
}

FilledFrame fill_streaming(const Filling& filling, const ParticleSource& source) {
  FilledFrame frame;
  filling.clock.start("survey");
  const Survey& survey = survey_of(source);
  report_dropped(survey.size - survey.finite, survey.size, survey.first_bad, filling.params,
                 filling.notices);
  frame.radius = choose_radius(source, filling.params, filling.notices);
  const bool misfit_told = check_radius(source, survey, frame.radius, filling.notices);
  frame.all = survey.size;
  const std::array<double, 3> origin = origin_of(survey.low, survey.high, survey.sample);
  // All processes see what the first one sees, to the last bit, whatever machines they run on.
  Team& team = source.team();
  frame.view = team.from_first(make_view(filling.camera, frame.radius, origin));
  const OnScreen screen = team.from_first(measure_spacing(frame.view, survey));
  frame.factor = thinning(screen, filling.params);
  if (frame.factor > 1)
    frame.view = team.from_first(make_view(filling.camera, frame.factor * frame.radius, origin));
  warn_of_coarse_positions(frame.view, frame.radius, filling.notices);
  if (frame.factor > 1) {
    thin_frame(filling, source, screen, frame);
    return frame;
  }
  const Particles kept = keep_near(filling, source, frame.view, screen);
  if (!team.leads()) return frame;
  filling.clock.start("order");
  require(kept.size() < (std::size_t{1} << 31), "particles: more than 2^31 - 1 in view");
  Notices of_crowds;
  const std::vector<std::size_t> order = without_crowds(
      kept, canonical_order(kept, filling.params, filling.notices), frame.radius, of_crowds);
  for (const Notice& notice : of_crowds.all())
    if (!misfit_told || notice.code == Code::crowded) filling.notices.add(notice);
  frame.particles =
      in_order(kept, order, frame.radius,
               draws_own_sizes(filling.params, clues_of(survey, source), frame.radius),
               filling.params.motion && source.has_velocity())
          .world;
  filling.clock.stop();
  return frame;
}

template <class MakeView>
FilledFrame fill_in_memory(const Filling& filling, const ParticleSource& source,
                           const MakeView& view, double farthest) {
  if (const BorrowedParticles* const all = source.in_memory()) {
    FilledFrame frame = fill_whole(filling, *all, view, farthest);
    // Without particles the source alone tells whether they would have velocities.
    if (all->size() == 0) frame.particles.moving = filling.params.motion && source.has_velocity();
    return frame;
  }
  survey_of(source);  // throws as for a larger frame
  const Particles all = read_all(source);
  if (!source.team().leads()) return {};
  check(all);
  return fill_whole(filling, all, view, farthest);
}

}  // namespace

void report_far(std::int64_t far, std::int64_t size, double farthest, const Parameters& params,
                Notices& notices) {
  if (far == 0) return;
  report_dropped({.code = Code::too_far,
                  .text = std::to_string(far) + " of " + std::to_string(size) +
                          printed(" particles lie more than %.3g particle radii from the middle of "
                                  "the others, farther than a mesh reaches",
                                  farthest),
                  .count = far,
                  .of = size,
                  .wanted = farthest},
                 ": they were dropped", params, notices);
}

bool reaches_beyond(const View& view, const SpaceBox& box, const std::array<float, 3>& low,
                    const std::array<float, 3>& high) {
  return !box.holds(eye_from_world(view, {low[0], low[1], low[2]})) ||
         !box.holds(eye_from_world(view, {high[0], high[1], high[2]}));
}

WorldParticles particles_in_order(const BorrowedParticles& particles,
                                  const std::vector<std::size_t>& order, double radius,
                                  bool moving) {
  return in_order(particles, order, radius, false, moving).world;
}

FilledFrame fill_frame(const Filling& filling, const ParticleSource& source) {
  return source.size() >= kStreamed ? fill_streaming(filling, source)
                                    : fill_whole_frame(filling, source);
}

FilledFrame fill_whole_frame(const Filling& filling, const ParticleSource& source) {
  require(source.size() < (std::int64_t{1} << 31), "particles: more than 2^31 - 1");
  return fill_in_memory(
      filling, source,
      [&](double radius, const std::array<double, 3>& origin) {
        return make_view(filling.camera, radius, origin);
      },
      SpaceBox::kFar);
}

FilledFrame fill_everything(const Filling& filling, const ParticleSource& source, double farthest) {
  require(source.size() < (std::int64_t{1} << 31), "particles: more than 2^31 - 1");
  return fill_in_memory(filling, source, make_world_view, farthest);
}

}  // namespace meniscus
