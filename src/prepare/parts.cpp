#include "prepare/parts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "base/team.hpp"
#include "meniscus/error.hpp"
#include "prepare/attributes.hpp"
#include "prepare/canonical_order.hpp"
#include "prepare/check_radius.hpp"
#include "prepare/choose_radius.hpp"
#include "prepare/collect.hpp"
#include "prepare/crowds.hpp"
#include "prepare/origin.hpp"
#include "prepare/survey.hpp"
#include "prepare/velocities.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kChunk = std::size_t{1} << 18;  // particles that are read at a time

constexpr double kThinnest = 64;  // side of a part, particle radii
constexpr double kBytes = 256;    // that a particle takes where a part is made

bool is_finite(const ParticleChunk& chunk, std::size_t i) {
  return std::isfinite(chunk.x[i]) && std::isfinite(chunk.y[i]) && std::isfinite(chunk.z[i]);
}

Vec3d place_of_particle(const View& view, const ParticleChunk& chunk, std::size_t i) {
  return eye_from_world(view, {chunk.x[i], chunk.y[i], chunk.z[i]});
}

SpaceBox in_world(const View& view, SpaceBox box) {
  const std::array origin{view.origin.x, view.origin.y, view.origin.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.low[axis] = origin[axis] + view.radius * box.low[axis];
    box.high[axis] = origin[axis] + view.radius * box.high[axis];
  }
  return box;
}

// Checks what particles carry, over all processes.
class Checks {
 public:
  explicit Checks(const ParticleSource& source) : values_(source.attributes().size()) {}
  void look_at(const ParticleChunk& chunk, std::size_t i) {
    const std::int64_t place = chunk.first + static_cast<std::int64_t>(i);
    if (!chunk.vx.empty()) velocities_.checked({chunk.vx[i], chunk.vy[i], chunk.vz[i]}, place);
    for (std::size_t a = 0; a < chunk.attributes.size(); ++a)
      values_[a].checked(chunk.attributes[a][i], place);
  }
  void report(const ParticleSource& source, const Parameters& params, Notices& notices) const {
    joined(source.team(), velocities_).report("particles", params, notices);
    for (std::size_t a = 0; a < values_.size(); ++a)
      joined(source.team(), values_[a]).report(source.attributes()[a], params, notices);
  }

 private:
  template <class Check>
  static Check joined(Team& team, const Check& own) {
    Check all;
    for (const Check& one : team.joined<Check>({own})) all.add(one);
    return all;
  }
  VelocityCheck velocities_;
  std::vector<ValueCheck> values_;
};

void add_particle(const ParticleChunk& chunk, std::size_t i, Particles& to) {
  to.x.push_back(chunk.x[i]);
  to.y.push_back(chunk.y[i]);
  to.z.push_back(chunk.z[i]);
  if (!chunk.radius.empty()) to.radius.push_back(chunk.radius[i]);
  if (!chunk.vx.empty()) {
    to.vx.push_back(chunk.vx[i]);
    to.vy.push_back(chunk.vy[i]);
    to.vz.push_back(chunk.vz[i]);
  }
  for (std::size_t a = 0; a < chunk.attributes.size(); ++a)
    to.attributes[a].values.push_back(chunk.attributes[a][i]);
}

// Sends each process what was kept for it.
PickedParticles exchanged(Team& team, std::vector<Particles>& kept) {
  PickedParticles picked;
  picked.received = {kept[0].size()};
  for (std::size_t to = 0; to < kept.size() && team.size() > 1; ++to) {
    std::vector<std::size_t> counts;
    team.gather(
        std::vector<std::size_t>{kept[to].size()},
        [&](int, std::vector<std::size_t>&& count) { counts.push_back(count[0]); },
        static_cast<int>(to));
    if (static_cast<int>(to) == team.rank()) picked.received = counts;
    for (std::vector<float>* const values : arrays_of(kept[to])) {
      std::vector<float> all;
      team.gather(
          std::move(*values),
          [&](int, std::vector<float>&& some) { all.insert(all.end(), some.begin(), some.end()); },
          static_cast<int>(to));
      *values = std::move(all);
    }
  }
  picked.particles = std::move(kept[static_cast<std::size_t>(team.rank())]);
  require(picked.particles.size() < (std::size_t{1} << 31),
          "particles: more than 2^31 - 1 in one part");
  return picked;
}

// Nothing of these arrays.
std::vector<Particles> room_for(std::size_t boxes, const std::vector<std::string>& attributes) {
  Particles none;
  for (const std::string& name : attributes) none.attributes.push_back({name, {}});
  return std::vector<Particles>(boxes, none);
}

// Calls pick(box, chunk, i, k) for the particles of this process's share that boxes hold, in the
// space of where(chunk, i, k): the i-th of a chunk, the k-th of the share.
template <class Where, class Pick>
void each_in_boxes(const ParticleSource& source, const ChunkValues& values,
                   const std::vector<SpaceBox>& boxes, const Where& where, const Pick& pick) {
  std::size_t before = 0;  // particles of chunks before
  for_each_chunk(source, kChunk, values, [&](ParticleChunk& chunk) {
    for (std::size_t i = 0; i < chunk.count; ++i) {
      const Vec3d at = where(chunk, i, before + i);
      for (std::size_t b = 0; b < boxes.size(); ++b)
        if (boxes[b].holds(at) && is_finite(chunk, i)) pick(b, chunk, i, before + i);
    }
    before += chunk.count;
  });
}

// Where a particle is given; boxes are to be in_world().
Vec3d where_given(const ParticleChunk& chunk, std::size_t i, std::size_t) {
  return {chunk.x[i], chunk.y[i], chunk.z[i]};
}

std::vector<SpaceBox> in_world(const PartedFrame& frame, std::vector<SpaceBox> boxes) {
  for (SpaceBox& box : boxes) box = in_world(frame.view, box.within(frame.within));
  return boxes;
}

// Picks particles by where they are, with all that they carry.
Particles pick_given(const ParticleSource& source, const PartedFrame& frame,
                     const std::vector<SpaceBox>& boxes) {
  std::vector<Particles> kept = room_for(boxes.size(), source.attributes());
  each_in_boxes(source, {.radius = true, .velocity = frame.moving, .attributes = true},
                in_world(frame, boxes), where_given,
                [&](std::size_t box, const ParticleChunk& chunk, std::size_t i, std::size_t) {
                  add_particle(chunk, i, kept[box]);
                });
  return exchanged(source.team(), kept).particles;
}

// Picks particles by where they have gone, which are their last attributes: x, y and z.
Particles pick_evened(const ParticleSource& source, const PartedFrame& frame,
                      std::vector<SpaceBox> boxes, const EvenedPlaces& evened) {
  std::vector<std::string> carried = source.attributes();
  carried.insert(carried.end(), {"x", "y", "z"});
  std::vector<Particles> kept = room_for(boxes.size(), carried);
  for (SpaceBox& box : boxes) box = box.scaled(1 / evened.unit);
  each_in_boxes(
      source, {.radius = true, .velocity = frame.moving, .attributes = true}, boxes,
      [&](const ParticleChunk&, std::size_t, std::size_t k) {
        return Vec3d{evened.x[k], evened.y[k], evened.z[k]};
      },
      [&](std::size_t box, const ParticleChunk& chunk, std::size_t i, std::size_t k) {
        add_particle(chunk, i, kept[box]);
        auto place = kept[box].attributes.end() - 3;
        for (const float at : {evened.x[k], evened.y[k], evened.z[k]})
          (place++)->values.push_back(at);
      });
  return exchanged(source.team(), kept).particles;
}

// Marks what cannot be used, which has been reported before.
void check_values(WorldParticles& world) {
  VelocityCheck velocities;
  for (Vec3& velocity : world.velocity) velocity = velocities.checked(velocity, 0);
  ValueCheck values;
  for (Attribute& attribute : world.attributes)
    for (float& value : attribute.values) value = values.checked(value, 0);
}

}  // namespace

PartedFrame survey_parts(const Filling& filling, const ParticleSource& source, double block,
                         double farthest) {
  PartedFrame frame;
  Team& team = source.team();
  const Parameters& params = filling.params;
  filling.clock.start("survey");
  const Survey& survey = survey_of(source);
  report_dropped(survey.size - survey.finite, survey.size, survey.first_bad, params,
                 filling.notices);
  frame.radius = choose_radius(source, params, filling.notices);
  frame.misfit_told = check_radius(source, survey, frame.radius, filling.notices);
  frame.all = survey.size;
  frame.view = team.from_first(
      make_world_view(frame.radius, origin_of(survey.low, survey.high, survey.sample)));
  warn_of_coarse_positions(frame.view, frame.radius, filling.notices);
  frame.within = SpaceBox::around_origin(farthest);
  const bool far_ones = reaches_beyond(frame.view, frame.within, survey.low, survey.high);
  frame.moving = params.motion && source.has_velocity();
  frame.counts.blocks = blocks_of_cubes(block);
  CubeCounter counter(frame.counts.blocks * block);
  Checks checks(source);
  const bool counted = team.size() > 1 || static_cast<double>(frame.all) * kBytes >
                                              static_cast<double>(filling.memory);
  std::int64_t far = 0;
  if (counted || far_ones || frame.moving || !source.attributes().empty())
    for_each_chunk(source, kChunk, {.velocity = params.motion, .attributes = true},
                   [&](ParticleChunk& chunk) {
                     for (std::size_t i = 0; i < chunk.count; ++i) {
                       if (!is_finite(chunk, i)) continue;
                       const Vec3d at = place_of_particle(frame.view, chunk, i);
                       if (!frame.within.holds(at)) {
                         ++far;
                         continue;
                       }
                       if (counted) counter.add(at);
                       checks.look_at(chunk, i);
                     }
                   });
  const std::vector<std::int64_t> all_far = team.joined<std::int64_t>({far});
  report_far(std::accumulate(all_far.begin(), all_far.end(), std::int64_t{0}), survey.finite,
             farthest, params, filling.notices);
  const std::size_t notices_before = filling.notices.all().size();
  checks.report(source, params, filling.notices);
  frame.all_known = filling.notices.all().size() == notices_before;
  std::map<std::array<std::int32_t, 3>, std::int64_t> all;
  for (const CubeCounts::Cube& cube : team.joined(counter.cubes())) all[cube.at] += cube.count;
  for (const auto& [at, count] : all) frame.counts.cubes.push_back({at, count});
  filling.clock.stop();
  return frame;
}

std::vector<BlockBox> share_parts(std::size_t memory, const PartedFrame& frame, double block,
                                  double halo, int processes) {
  return share_space(frame.counts, {memory, kBytes, block, halo, kThinnest, processes});
}

PickedParticles pick_to_even_out(const ParticleSource& source, const PartedFrame& frame,
                                 const std::vector<SpaceBox>& boxes) {
  std::vector<Particles> kept = room_for(boxes.size(), {});
  std::vector<std::vector<std::size_t>> sent(boxes.size());
  each_in_boxes(source, {.radius = true, .velocity = frame.moving}, in_world(frame, boxes),
                where_given,
                [&](std::size_t box, const ParticleChunk& chunk, std::size_t i, std::size_t k) {
                  add_particle(chunk, i, kept[box]);
                  sent[box].push_back(k);
                });
  PickedParticles picked = exchanged(source.team(), kept);
  picked.sent = std::move(sent);
  return picked;
}

std::vector<std::size_t> order_of_part(const PartedFrame& frame, const Particles& particles,
                                       const SpaceBox& own, PartTally& tally) {
  const bool owns_all = own == SpaceBox{};
  const auto is_own = [&](std::size_t i) {
    return owns_all ||
           own.holds(eye_from_world(frame.view, {particles.x[i], particles.y[i], particles.z[i]}));
  };
  Notices told_before, of_crowds;
  std::vector<std::size_t> order = canonical_order(particles, {}, told_before);
  for (std::size_t k = 0; k < order.size(); ++k) {
    if (!is_own(order[k])) continue;
    ++tally.had;
    if (k > 0 && at_one_position(particles, order[k - 1], order[k])) ++tally.copies;
  }
  order = without_crowds(particles, std::move(order), frame.radius, of_crowds);
  tally.dropped =
      tally.had - static_cast<std::int64_t>(std::count_if(order.begin(), order.end(), is_own));
  for (const Notice& notice : of_crowds.all()) {
    if (notice.code == Code::crowded && tally.dropped > 0) tally.largest = notice.found;
    if (notice.code == Code::radius_too_large) tally.too_large = notice.found / notice.wanted;
    if (notice.code == Code::radius_too_small) tally.too_small = notice.wanted / notice.found;
  }
  return order;
}

PlacedParticles fill_part(const Filling& filling, const ParticleSource& source,
                          const PartedFrame& frame, const std::vector<SpaceBox>& boxes,
                          const SpaceBox& own, PartTally& tally) {
  filling.clock.start("order");
  const Particles mine = pick_given(source, frame, boxes);
  PlacedParticles part;
  part.particles =
      particles_in_order(mine, order_of_part(frame, mine, own, tally), frame.radius, frame.moving);
  check_values(part.particles);
  part.placed = place_particles(frame.view, part.particles);
  filling.clock.stop();
  return part;
}

PlacedParticles fill_part(const Filling& filling, const ParticleSource& source,
                          const PartedFrame& frame, const std::vector<SpaceBox>& boxes,
                          const EvenedPlaces& evened) {
  filling.clock.start("order");
  const Particles mine = pick_evened(source, frame, boxes, evened);
  Notices told_before;
  PlacedParticles part;
  part.particles =
      particles_in_order(mine, canonical_order(mine, {}, told_before), frame.radius, frame.moving);
  part.placed = place_particles(frame.view, part.particles);
  for (std::vector<float>* const to : {&part.placed.z, &part.placed.y, &part.placed.x}) {
    *to = std::move(part.particles.attributes.back().values);
    part.particles.attributes.pop_back();
  }
  check_values(part.particles);
  filling.clock.stop();
  return part;
}

void report(const std::vector<PartTally>& tallies, const PartedFrame& frame, Notices& notices) {
  PartTally all;
  // What a part says of the radius counts where all say so that can tell.
  double too_large = SpaceBox::kFar, too_small = SpaceBox::kFar;
  for (const PartTally& part : tallies) {
    all.had += part.had;
    all.dropped += part.dropped;
    all.copies += part.copies;
    all.largest = std::max(all.largest, part.largest);
    if (part.had < static_cast<std::int64_t>(kTelling)) continue;
    too_large = std::min(too_large, part.too_large);
    too_small = std::min(too_small, part.too_small);
  }
  const auto size = static_cast<std::size_t>(frame.all), had = static_cast<std::size_t>(all.had);
  if (all.copies > 0) notices.add(coinciding(static_cast<std::size_t>(all.copies), size));
  if (!frame.misfit_told && too_large > 0 && too_large < SpaceBox::kFar)
    notices.add(radius_misfit(frame.radius, frame.radius / too_large));
  if (!frame.misfit_told && too_small > 0 && too_small < SpaceBox::kFar)
    notices.add(radius_misfit(frame.radius, frame.radius * too_small));
  if (all.dropped > 0)
    notices.add(crowded(static_cast<std::size_t>(all.largest),
                        static_cast<std::size_t>(all.dropped), had, frame.radius));
}

}  // namespace meniscus
