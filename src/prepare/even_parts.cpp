#include "prepare/even_parts.hpp"

#include <cstddef>
#include <limits>

#include "base/team.hpp"
#include "device/give_back.hpp"
#include "stages/closed/mesh_parts.hpp"
#include "stages/frame/project.hpp"

namespace meniscus {
namespace {

constexpr float kLeftOut = std::numeric_limits<float>::quiet_NaN();

// So many places that are not known yet.
EvenedPlaces unknown_places(const Disorder& disorder, std::size_t particles) {
  const std::vector<float> none(particles, kLeftOut);
  return {disorder.unit(), none, none, none};
}

// Where particles go that a process was sent, as far as they are the part's own.
EvenedPlaces even_out_part(const PartedFrame& frame, const Disorder& disorder,
                           const PickedParticles& picked, const SpaceBox& own, PartTally& tally) {
  const Particles& given = picked.particles;
  const std::vector<std::size_t> order = order_of_part(frame, given, own, tally);
  Projected placed = place_particles(coarser(frame.view, disorder.unit()),
                                     particles_in_order(given, order, frame.radius, false));
  even_out(placed, disorder, own.scaled(1 / disorder.unit()));
  EvenedPlaces places = unknown_places(disorder, given.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::size_t i = order[k];
    if (!own.holds(eye_from_world(frame.view, {given.x[i], given.y[i], given.z[i]}))) continue;
    places.x[i] = placed.x[k];
    places.y[i] = placed.y[k];
    places.z[i] = placed.z[k];
  }
  return places;
}

// Sends values of particles that processes were sent back to who sent them, who puts down those
// that are known.
void send_back(Team& team, const PickedParticles& picked, const std::vector<float>& values,
               std::vector<float>& to) {
  auto from = values.begin();
  for (int rank = 0; rank < team.size(); ++rank) {
    const auto end =
        from + static_cast<std::ptrdiff_t>(picked.received[static_cast<std::size_t>(rank)]);
    team.gather(
        std::vector<float>(from, end),
        [&](int by, std::vector<float>&& some) {
          const std::vector<std::size_t>& sent = picked.sent[static_cast<std::size_t>(by)];
          for (std::size_t k = 0; k < some.size(); ++k)
            if (some[k] == some[k]) to[sent[k]] = some[k];
        },
        rank);
    from = end;
  }
}

}  // namespace

EvenedPlaces even_out_in_parts(const Filling& filling, const ParticleSource& source,
                               const PartedFrame& frame, const Disorder& disorder, double block,
                               std::vector<PartTally>& tallies) {
  // Crowds are counted in cubes of two radii, which must be whole.
  const double around = relax_influence(disorder) * disorder.unit() + 2.5;
  Team& team = source.team();
  const auto processes = static_cast<std::size_t>(team.size());
  std::size_t share = 0;
  for (const ParticleRange& range : source.share()) share += static_cast<std::size_t>(range.count);
  EvenedPlaces all = unknown_places(disorder, share);
  const std::vector<BlockBox> parts =
      share_parts(filling.memory, frame, block, around, team.size());
  for (std::size_t first = 0; first < parts.size(); first += processes) {
    std::vector<SpaceBox> own(processes, SpaceBox::nowhere()), boxes = own;
    for (std::size_t k = 0; k < processes && first + k < parts.size(); ++k) {
      own[k] = space_of(parts[first + k], block);
      boxes[k] = own[k].wider(around);
    }
    filling.clock.start("order");
    const PickedParticles picked = pick_to_even_out(source, frame, boxes);
    filling.clock.start("relax");
    PartTally tally;
    const EvenedPlaces places =
        even_out_part(frame, disorder, picked, own[static_cast<std::size_t>(team.rank())], tally);
    tallies.push_back(tally);
    send_back(team, picked, places.x, all.x);
    send_back(team, picked, places.y, all.y);
    send_back(team, picked, places.z, all.z);
    filling.clock.stop();
    give_back_idle(filling.device);
  }
  return all;
}

}  // namespace meniscus
