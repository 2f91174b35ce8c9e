// What is measured side by side: the methods of the library, and splashsurf.
#pragma once

#include <functional>
#include <string>

#include "accuracy/map.hpp"
#include "accuracy/scene.hpp"
#include "meniscus/extract.hpp"

namespace meniscus::accuracy {

/// The surface of particles that a lens sees, in the particles' unit of length.
using Extractor = std::function<Surface(const Particles&, const Lens&)>;

struct Contender {
  std::string name;
  Extractor extract;
};

/// A method of the library. The device must live as long as the contender.
Contender library_method(Device& device, const Parameters& parameters);

/// splashsurf (see peers.hpp), its mesh ray-cast. The particles must state their radius. The
/// surface's mesh has the vertices that the lens sees, and no triangles. Particles that come again
/// are not reconstructed again.
Contender splashsurf(const std::string& program);

/// A map as a surface that can be drawn.
Surface surface_of(const Lens& lens, const Map& map, double particle_radius);

}  // namespace meniscus::accuracy
