// survey: what a frame is like as a whole, from one pass over its particles.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "meniscus/source.hpp"

namespace meniscus {

/// Some particles in memory, padded to a multiple of 64 with positions at the origin.
struct ParticleChunk {
  std::int64_t first = 0;
  std::size_t count = 0;
  std::vector<float> x, y, z;  // [stride] world units
  // Empty where the source has none or none was asked for:
  std::vector<float> vx, vy, vz;               // [stride] world units per second
  std::vector<float> radius;                   // [stride] world units
  std::vector<std::vector<float>> attributes;  // [stride] each
  std::size_t stride() const { return x.size(); }
};

/// What a chunk holds beside positions.
struct ChunkValues {
  bool radius = false, velocity = false, attributes = false;
};

/// Particles of a chunk, at most: so many that what is done once for each chunk takes no time.
inline constexpr std::size_t kMostChunk = std::size_t{1} << 20;

/// How many particles a chunk has whose buffers take so many bytes for each: as many as fit into
/// `memory` bytes of the device, in whole work-groups of 64; one of these at least.
std::size_t chunk_within(std::size_t memory, std::size_t bytes_per_particle);

/// Calls work(chunk) for all particles of this process's share, at most `size` at a time, in order;
/// the next chunk is read by another thread meanwhile. `work` may keep the chunk by swapping it for
/// another one, whose memory is then used again. Throws what reading or `work` throws.
void for_each_chunk(const ParticleSource& source, std::size_t size, const ChunkValues& also,
                    const std::function<void(ParticleChunk&)>& work);

/// The positions for which `wanted` says so, of all shares, in every process.
Particles positions_where(const ParticleSource& source,
                          const std::function<bool(float x, float y, float z)>& wanted);

struct Survey {
  std::int64_t size = 0, finite = 0;   // particles; those whose coordinates are all finite
  std::int64_t first_bad = -1;         // the first of the others
  std::array<float, 3> low{}, high{};  // of the finite ones, world units
  // Of the finite ones' own; 0: none has one.
  float least_radius = 0, middle_radius = 0, largest_radius = 0;
  std::vector<std::array<float, 3>> sample;  // finite ones whose position has a small hash
};

/// survey_particles of a source, made when it is first asked for: then by all processes of its
/// team. Not for two threads at once.
const Survey& survey_of(const ParticleSource& source);

/// The size of a sample of more particles than that, about: one in n / kSample is taken.
inline constexpr std::int64_t kSample = 1 << 16;

/// Looks at every particle, each process of the source's team at those of its share; the result is
/// the same in all. It does not depend on the particles' order but for `first_bad` and the sample's
/// order. Throws InputError, naming the first such particle, when a radius is not a positive
/// number, or when the one that the source states is none.
Survey survey_particles(const ParticleSource& source);

}  // namespace meniscus
