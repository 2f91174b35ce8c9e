// Particles that the ranks of a team read together.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/team.hpp"
#include "meniscus/extract.hpp"

namespace meniscus {

/// Of particles that all ranks have in memory, each reads some; rank 3 nothing.
class SharedSource : public ParticleSource {
 public:
  SharedSource(const Particles& particles, Team& team)
      : inner_(source_of(particles)), team_(team) {}
  std::int64_t size() const override { return inner_->size(); }
  bool has_radius() const override { return inner_->has_radius(); }
  bool has_velocity() const override { return inner_->has_velocity(); }
  double particle_radius() const override { return inner_->particle_radius(); }
  std::string name(std::int64_t particle) const override { return inner_->name(particle); }
  Team& team() const override { return team_; }
  std::vector<ParticleRange> share() const override {
    std::vector<ParticleRange> share;
    const int readers = std::min(team_.size(), 3);
    constexpr std::int64_t kStep = 700;
    for (std::int64_t k = team_.rank() < 3 ? team_.rank() : size(); k * kStep < size();
         k += readers)
      share.push_back({k * kStep, std::min(kStep, size() - k * kStep)});
    return share;
  }
  void read(std::int64_t first, std::size_t count, const ParticleArrays& to) const override {
    inner_->read(first, count, to);
  }

 private:
  std::unique_ptr<ParticleSource> inner_;
  Team& team_;
};

}  // namespace meniscus
