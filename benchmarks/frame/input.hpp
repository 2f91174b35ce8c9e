// What whole frames are measured on.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "meniscus/types.hpp"

namespace meniscus {

/// A frame of particles, seen by a camera. The particles are in memory, or stream from a file.
struct FrameInput {
  std::string name;  // for people and in the JSON
  Particles particles;
  std::string file;            // to stream from; empty: `particles` are in memory
  std::int64_t count = 0;      // particles
  double particle_radius = 0;  // world units, replaces the file's; 0: the file's
  Camera camera;
};

/// The benchmark frame: a breaking dam of 35,937 particles at 1024x768, part of the program.
FrameInput dam_frame();

/// The frame in a file, seen by the camera that frames it. Files that extract() can stream do: then
/// the time of a frame has the time of reading it.
FrameInput file_frame(const std::string& path, double particle_radius);

/// A dam break of `particles` particles (DamBreak, seed 1), seen by the camera that frames it.
FrameInput synthetic_frame(std::int64_t particles, int width, int height);

/// The same camera with another image size: the vertical field of view stays.
Camera resized(const Camera& camera, int width, int height);

/// The files that the program carries: frame_015.ply and camera.json.
std::string_view dam_file(std::string_view name);

}  // namespace meniscus
