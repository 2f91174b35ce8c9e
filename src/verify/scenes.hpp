// What verify runs the kernels on: small frames made from integers, the same on every machine.
#pragma once

#include <string>
#include <vector>

#include "meniscus/extract.hpp"
#include "meniscus/parameters.hpp"
#include "meniscus/types.hpp"

namespace meniscus::verify {

/// A frame with what is asked of it.
struct Scene {
  std::string name;  // "block"
  std::string size;  // for people: "102 particles, 24x17"
  bool small;        // a simulator has the time for it
  Particles particles;
  Camera camera;
  std::vector<Method> methods;
  std::vector<Particles> whitewater{};  // foam, spray and bubbles, or none
};

/// Frames that show each kernel something else: a block with a step and splash, one particle, none,
/// an odd number in an orthographic view, coordinates at the edges of what floats hold, a crowd on
/// few pixels, a wall beyond the image's edges, a storm and a swarm that make atomics
/// meet (no methods: verify/cases.cpp has what is run on them).
const std::vector<Scene>& kernel_scenes();

/// Whole frames as users have them.
const std::vector<Scene>& whole_frames();

Parameters parameters_of(const Scene& scene, Method method);

/// The surface of a scene, with its whitewater.
Surface surface_of(Device& device, const Scene& scene, Method method);

}  // namespace meniscus::verify
