// Particles that are not in memory for those who read them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "meniscus/extract.hpp"

namespace meniscus {

/// A source of somebody's own.
class OwnSource : public ParticleSource {
 public:
  explicit OwnSource(const Particles& particles) : source_(source_of(particles)) {}
  std::int64_t size() const override { return source_->size(); }
  std::string name(std::int64_t particle) const override { return source_->name(particle); }
  bool has_radius() const override { return source_->has_radius(); }
  bool has_velocity() const override { return source_->has_velocity(); }
  double particle_radius() const override { return source_->particle_radius(); }
  std::vector<std::string> attributes() const override { return source_->attributes(); }
  void read(std::int64_t first, std::size_t count, const ParticleArrays& to) const override {
    source_->read(first, count, to);
  }

 private:
  std::unique_ptr<ParticleSource> source_;
};

}  // namespace meniscus
