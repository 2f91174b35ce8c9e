// Foam, spray and bubbles over a surface.
#pragma once

#include <string>
#include <vector>

#include "meniscus/extract.hpp"

namespace meniscus MENISCUS_API {

/// Where the particles of one type are: all of a source's, or those whose attribute is a number.
struct WhitewaterSource {
  WhitewaterType type = WhitewaterType::foam;
  const ParticleSource* particles = nullptr;
  std::string attribute{};  // one of particles->attributes(); empty: all particles
  double value = 0;         // of the attribute
  std::string name{};       // in messages; empty: the type's
};

/// "foam", "spray" or "bubble".
std::string to_string(WhitewaterType type);

/// The type of that name. Throws InvalidArgument, with the names there are.
WhitewaterType whitewater_named(const std::string& name);

/// Draws whitewater into surface.whitewater, a map of each type that a source has, as
/// parameters.whitewater says (docs/whitewater.md). Particles are discs that face the camera.
///
///   foam, spray  are shown where there is no water, and up to `tolerance` behind its front
///   bubble       is shown in the water alone: from `tolerance` before its front on, up to the
///                first exit of the ray where the surface has layers, else however far behind
///
/// The result does not depend on the order of the particles. Frames of any size stream through the
/// device in chunks.
///
///   sources  each of another type
///   surface  with depth; of extract() or read_exr(). Whitewater that it has already is replaced
///   memory   of the device that chunks may take, bytes; never changes the result
///
/// Radii are parameters.whitewater.radius, else the particles' own, else the one that the source
/// states, else a quarter of surface.particle_radius. Particles whose coordinates are not finite
/// are left out with a notice, or an error where parameters.strict is set; velocities that are not
/// finite count as none. All particles without velocity: there is no map of it.
///
/// Throws InvalidArgument for a bad surface, parameters, or two sources of a type, InputError when
/// a source cannot be read, has no such attribute, or has a radius that is not a positive, finite
/// number, DeviceError.
void draw_whitewater(Device& device, const std::vector<WhitewaterSource>& sources,
                     const Parameters& parameters, Surface& surface,
                     std::vector<StageTime>* timings = nullptr, std::size_t memory = kStreamMemory);

}  // namespace MENISCUS_API
