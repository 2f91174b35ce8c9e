// Particles that need not fit into memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "meniscus/borrowed.hpp"
#include "meniscus/export.hpp"
#include "meniscus/types.hpp"

namespace meniscus MENISCUS_API {

struct ReadOptions;
struct MENISCUS_INTERNAL Survey;
class MENISCUS_INTERNAL Team;
class ParticleSource;
MENISCUS_INTERNAL const Survey& survey_of(const ParticleSource& source);

/// Particles that follow each other in a frame.
struct ParticleRange {
  std::int64_t first = 0, count = 0;
};

/// Where ParticleSource::read puts what: for each value that is wanted an array with room for one a
/// particle, null for the others.
struct ParticleArrays {
  float *x = nullptr, *y = nullptr, *z = nullptr;
  float *vx = nullptr, *vy = nullptr, *vz = nullptr;
  float* radius = nullptr;
  std::vector<float*> attributes{};  // in the order of ParticleSource::attributes, or none at all

  /// The same arrays from another place on.
  ParticleArrays from(std::size_t place) const;
};

/// A frame of particles that is read in parts, several times if need be. Reading changes nothing:
/// several threads may read at once. Where several processes share the work, `size` and the numbers
/// of particles are those of the whole frame in all of them, and each reads only its share.
class ParticleSource {
 public:
  ParticleSource() = default;
  ParticleSource(const ParticleSource&) = delete;
  ParticleSource& operator=(const ParticleSource&) = delete;
  virtual ~ParticleSource() = default;

  virtual std::int64_t size() const = 0;
  virtual std::string name(std::int64_t particle) const = 0;  // in messages: "vertex 812"
  virtual bool has_radius() const = 0;         // whether each particle has a radius of its own
  virtual bool has_velocity() const = 0;       // whether each particle has a velocity
  virtual double particle_radius() const = 0;  // world units, as it is stated; 0: it is not
  virtual std::vector<std::string> attributes() const { return {}; }  // names of what it carries

  /// Copies `count` particles from `first` on into the arrays that are not null; those of values
  /// that the source does not have stay as they are. Values are as the source has them. Throws
  /// InputError.
  virtual void read(std::int64_t first, std::size_t count, const ParticleArrays& to) const = 0;

  /// The particles where they are all in memory anyway, else null.
  virtual const BorrowedParticles* in_memory() const { return nullptr; }

  /// The processes that read the frame together (src/base/team.hpp); by default this one alone.
  virtual Team& team() const;
  /// What this process reads, ascending. Each particle is in one process's share.
  virtual std::vector<ParticleRange> share() const { return {{0, size()}}; }

 private:
  friend const Survey& survey_of(const ParticleSource& source);
  mutable std::shared_ptr<const Survey> survey_;  // once somebody has asked
};

/// Opens a file of particles (see read_particles). A large file whose values lie at places that are
/// known before they are read is left on disk (docs/formats.md says of which formats); all else is
/// read into memory here. A * in the path stands for any characters of a file's or folder's name:
/// all files that match, in natural order (part 2 before part 10), are parts of one frame.
///
///   particle_radius  > 0, world units: replaces every radius that the file states; 0: the file's
///
/// Throws InputError, also when parts differ in whether they have radii or in the radius they
/// state; InvalidArgument for a radius below 0.
std::unique_ptr<ParticleSource> open_particles(const std::string& path, double particle_radius = 0);
std::unique_ptr<ParticleSource> open_particles(const std::string& path, const ReadOptions& options);

/// Throws InvalidArgument unless every array has one entry a particle, the optional ones also none,
/// and radii are > 0 and finite (`particle_radius` also 0: not known). The message names the array.
/// Positions and velocities may be NaN and infinite: see Parameters::strict.
void check(const Particles& particles);
void check(const BorrowedParticles& particles);

/// Particles in memory, which must outlive the source and stay as they are; none is copied. Throws
/// InvalidArgument where an array has neither one entry a particle nor none.
std::unique_ptr<ParticleSource> source_of(const Particles& particles);
std::unique_ptr<ParticleSource> source_of(const BorrowedParticles& particles);

}  // namespace MENISCUS_API
