// What a plug-in shows of itself: plain data in and out.
#include <cmath>
#include <meniscus/meniscus.hpp>

int pixels_with_surface(const float* x, const float* y, const float* z, int count) {
  meniscus::Particles particles;
  particles.x.assign(x, x + count);
  particles.y.assign(y, y + count);
  particles.z.assign(z, z + count);
  const meniscus::Camera camera = meniscus::frame_particles(particles, {.width = 64, .height = 48});
  meniscus::Device device;
  int pixels = 0;
  for (const float depth : meniscus::extract(device, particles, camera).depth)
    pixels += depth < INFINITY;
  return pixels;
}
