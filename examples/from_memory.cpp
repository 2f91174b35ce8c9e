// Particles of one's own, a camera, and the maps that are wanted: a spinning ball into ball.exr
#include <iostream>
#include <meniscus/meniscus.hpp>

namespace {

// What a simulation has in memory: positions, velocities, and how large a particle is.
meniscus::Particles ball(int radius, float spacing) {
  meniscus::Particles particles;
  particles.particle_radius = spacing / 2;
  for (int i = -radius; i <= radius; ++i)
    for (int j = -radius; j <= radius; ++j)
      for (int k = -radius; k <= radius; ++k) {
        if (i * i + j * j + k * k > radius * radius) continue;
        const float x = spacing * static_cast<float>(i), y = spacing * static_cast<float>(j),
                    z = spacing * static_cast<float>(k);
        particles.x.push_back(x);
        particles.y.push_back(y);
        particles.z.push_back(z);
        particles.vx.push_back(z);  // world units per second, about the y axis
        particles.vy.push_back(0);
        particles.vz.push_back(-x);
      }
  return particles;
}

}  // namespace

int main() try {
  const meniscus::Particles particles = ball(12, 0.05f);
  const meniscus::Camera camera = meniscus::look_at({0, 1, 2}, {0, 0, 0}, {0, 1, 0}, 40, 640, 480);

  meniscus::Parameters parameters;  // lengths in particle radii; each is an option of the program
  parameters.mesh = false;
  parameters.aovs = meniscus::aovs_named("N,V");  // beside depth

  meniscus::Device device;  // each thread needs one of its own
  meniscus::Surface surface = meniscus::extract(device, particles, camera, parameters);
  for (const meniscus::Notice& notice : surface.notices) std::cerr << to_string(notice) << '\n';

  // Row by row from the top: surface.depth[row * camera.width + column], world units.
  surface.forward = meniscus::screen_motion(surface, camera, 24);  // the camera stands still
  meniscus::write_exr("ball.exr", surface, parameters);
  std::cout << "depth in the middle: " << surface.depth[240 * 640 + 320] << '\n';
} catch (const meniscus::Error& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
