#include "prepare/collect.hpp"

#include <algorithm>
#include <utility>

#include "base/team.hpp"

namespace meniscus {

std::vector<std::vector<float>*> arrays_of(Particles& particles) {
  std::vector<std::vector<float>*> arrays{&particles.x,     &particles.y,  &particles.z,
                                          &particles.vx,    &particles.vy, &particles.vz,
                                          &particles.radius};
  for (Attribute& attribute : particles.attributes) arrays.push_back(&attribute.values);
  return arrays;
}

Particles read_all(const ParticleSource& source) {
  Particles all;
  all.particle_radius = source.particle_radius();
  std::size_t size = 0, done = 0;
  for (const ParticleRange& range : source.share()) size += static_cast<std::size_t>(range.count);
  for (std::vector<float>* values : {&all.x, &all.y, &all.z}) values->resize(size);
  for (const std::string& name : source.attributes())
    all.attributes.push_back({name, std::vector<float>(size)});
  if (source.has_velocity())
    for (std::vector<float>* values : {&all.vx, &all.vy, &all.vz}) values->resize(size);
  if (source.has_radius()) all.radius.resize(size);
  for (const ParticleRange& range : source.share()) {
    const auto at = [&](std::vector<float>& values) {
      return values.empty() ? nullptr : values.data() + done;
    };
    const std::size_t count = static_cast<std::size_t>(range.count);
    ParticleArrays to{at(all.x),  at(all.y),  at(all.z),     at(all.vx),
                      at(all.vy), at(all.vz), at(all.radius)};
    for (Attribute& attribute : all.attributes) to.attributes.push_back(at(attribute.values));
    source.read(range.first, count, to);
    done += count;
  }
  Team& team = source.team();
  if (team.size() == 1) return all;
  // Into the frame's order: messages name particles by it.
  std::vector<std::vector<ParticleRange>> shares;
  team.gather(source.share(),
              [&](int, std::vector<ParticleRange>&& share) { shares.push_back(std::move(share)); });
  for (std::vector<float>* values : arrays_of(all)) {
    std::vector<float> ordered;
    team.gather(std::move(*values), [&](int rank, std::vector<float>&& some) {
      if (some.empty()) return;
      ordered.resize(static_cast<std::size_t>(source.size()));
      auto from = some.begin();
      for (const ParticleRange& range : shares[static_cast<std::size_t>(rank)]) {
        std::copy_n(from, range.count, ordered.begin() + range.first);
        from += range.count;
      }
    });
    *values = std::move(ordered);
  }
  return all;
}

}  // namespace meniscus
