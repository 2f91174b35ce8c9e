// Particles that need not fit into memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "meniscus/types.hpp"

namespace meniscus {

struct Survey;

/// Where ParticleSource::read puts what: for each value that is wanted an array with room for one a
/// particle, null for the others.
struct ParticleArrays {
  float *x = nullptr, *y = nullptr, *z = nullptr;
  float *vx = nullptr, *vy = nullptr, *vz = nullptr;
  float* radius = nullptr;
};

/// A frame of particles that is read in parts, several times if need be. Reading changes nothing:
/// several threads may read at once.
class ParticleSource {
 public:
  ParticleSource() = default;
  ParticleSource(const ParticleSource&) = delete;
  ParticleSource& operator=(const ParticleSource&) = delete;
  virtual ~ParticleSource() = default;

  virtual std::int64_t size() const = 0;
  virtual bool has_radius() const = 0;         // whether each particle has a radius of its own
  virtual bool has_velocity() const = 0;       // whether each particle has a velocity
  virtual double particle_radius() const = 0;  // world units, as it is stated; 0: it is not
  virtual std::string item() const = 0;        // what a particle is called in messages

  /// Copies `count` particles from `first` on into the arrays that are not null; those of values
  /// that the source does not have stay as they are. Values are as the source has them. Throws
  /// InputError.
  virtual void read(std::int64_t first, std::size_t count, const ParticleArrays& to) const = 0;

  /// The particles where they are all in memory anyway, else null.
  virtual const Particles* in_memory() const { return nullptr; }

 private:
  friend const Survey& survey_of(const ParticleSource& source);
  mutable std::shared_ptr<const Survey> survey_;  // once somebody has asked
};

/// Opens a file of particles (see read_particles). A large binary .ply whose rows all have one size
/// is left on disk; all else is read into memory here.
///
///   particle_radius  > 0, world units: replaces every radius that the file states; 0: the file's
///
/// Throws InputError.
std::unique_ptr<ParticleSource> open_particles(const std::string& path, double particle_radius = 0);

/// Particles in memory, which must outlive the source and stay as they are.
std::unique_ptr<ParticleSource> source_of(const Particles& particles);

}  // namespace meniscus
