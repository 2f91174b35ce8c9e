#include "frame/input.hpp"

#include "enclosing_camera.hpp"
#include "io/readers.hpp"
#include "meniscus/camera.hpp"
#include "meniscus/io.hpp"
#include "meniscus/source.hpp"
#include "program/dam_break.hpp"

namespace meniscus {
FrameInput dam_frame() {
  const auto file = [](const std::string& name) {
    return InputFile{name, std::string(dam_file(name))};
  };
  FrameInput frame;
  frame.name = "dam 015";
  frame.particles = particles_of(file("frame_015.ply"), 0);
  frame.count = static_cast<std::int64_t>(frame.particles.size());
  frame.camera = camera_of(file("camera.json"));
  return frame;
}

FrameInput file_frame(const std::string& path, double particle_radius) {
  const auto source = open_particles(path, particle_radius);
  FrameInput frame;
  frame.name = path;
  frame.count = source->size();
  frame.particle_radius = particle_radius;
  frame.camera = frame_particles(*source);
  if (source->in_memory())
    frame.particles = read_particles(path, particle_radius);
  else
    frame.file = path;
  return frame;
}

FrameInput synthetic_frame(std::int64_t particles, int width, int height) {
  const DamBreak dam(particles, 1);
  FrameInput frame;
  frame.particles = dam.particles();
  frame.name = "synthetic";
  frame.count = dam.size();
  frame.camera = enclosing_camera(frame.particles, width, height);
  return frame;
}

Camera resized(const Camera& camera, int width, int height) {
  Camera result = camera;
  result.width = width;
  result.height = height;
  const double stretch =
      (static_cast<double>(camera.width) / camera.height) / (static_cast<double>(width) / height);
  for (std::size_t k = 0; k < 4; ++k) result.projection[k] *= stretch;
  return result;
}

}  // namespace meniscus
