// project: world -> eye space and screen (paper 2.1).
#pragma once

#include <cstdint>
#include <vector>

#include "device/device.hpp"
#include "device/records.hpp"
#include "stages/stage_data.hpp"

namespace meniscus {

/// World positions in canonical order, ready for the device.
struct WorldParticles {
  std::vector<float> x, y, z;           // [n] world units, finite
  std::vector<float> scale;             // [n] own radius over the common radius; empty: all 1
  bool moving = false;                  // whether they carry velocities
  std::vector<Vec3> velocity;           // [n] where moving: world units per second, or kNoVelocity
  std::vector<Attribute> attributes{};  // [n] each; NaN: not known
};

/// The particles in view, in canonical order.
struct Projected {
  std::vector<float> x, y, z;        // [n] eye space, particle radii
  std::vector<float> u, v;           // [n] pixels
  std::vector<float> ku, kv;         // [n] pixels that the particle's own radius spans; > 0
  std::vector<float> scale;          // [n] own radius over the common radius
  std::vector<std::uint32_t> index;  // [n] of each before those out of view were left out
  std::size_t size() const { return x.size(); }
  Vec3d eye(std::size_t i) const { return {x[i], y[i], z[i]}; }
};

/// Particles, and where they are in eye space.
struct PlacedParticles {
  WorldParticles particles;
  Projected placed;
};

/// A view as kernels take it; margin: particle radii around the screen.
records::Projection projection_of(const View& view, double margin);

/// Projects every particle and keeps those beyond the near plane whose disc of `margin` particle
/// radii meets the screen. On the host, which needs them next: a device would have to be waited
/// for.
Projected project_particles(const View& view, const WorldParticles& particles, double margin);

/// Sets the pixels of particles that were moved: u, v, ku, kv. They need not be in view any more.
void project_again(const View& view, Projected& particles);

/// Without a camera: all particles in the eye space of make_world_view(), without pixels.
Projected place_particles(const View& view, const WorldParticles& particles);

}  // namespace meniscus
