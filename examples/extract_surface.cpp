// Particles in, surface out, in ten lines: extract_surface FRAME.ply
#include <iostream>
#include <meniscus/meniscus.hpp>

int main(int argc, char** argv) try {
  const meniscus::Particles particles = meniscus::read_particles(argc > 1 ? argv[1] : "frame.ply");
  const meniscus::Camera camera =
      meniscus::frame_particles(particles, {.width = 640, .height = 480});
  meniscus::Device device;  // the fastest kind of OpenCL device found
  const meniscus::Surface surface = meniscus::extract(device, particles, camera);
  meniscus::write_png("surface.png", surface);
  meniscus::write_mesh("surface.ply", surface.mesh);
  std::cout << surface.mesh.triangle.size() << " triangles in surface.ply\n";
} catch (const meniscus::Error& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
