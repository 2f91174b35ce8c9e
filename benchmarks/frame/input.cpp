#include "frame/input.hpp"

#include "dam_break.hpp"
#include "io/readers.hpp"
#include "meniscus/camera.hpp"

namespace meniscus {
FrameInput dam_frame() {
  const auto file = [](const std::string& name) {
    return InputFile{name, std::string(dam_file(name))};
  };
  return {"dam 015", particles_of(file("frame_015.ply"), 0), camera_of(file("camera.json"))};
}

FrameInput synthetic_frame(std::int64_t particles, int width, int height) {
  const DamBreak dam(particles, 1);
  FrameInput frame;
  Particles& p = frame.particles;
  p.particle_radius = dam.particle_radius();
  for (auto* values : {&p.x, &p.y, &p.z}) values->reserve(static_cast<std::size_t>(dam.size()));
  dam.emit([&](std::span<const float> block) {
    for (std::size_t k = 0; k < block.size(); k += 3) {
      p.x.push_back(block[k]);
      p.y.push_back(block[k + 1]);
      p.z.push_back(block[k + 2]);
    }
  });
  frame.name = "synthetic";
  frame.camera = frame_particles(p, width, height);
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
