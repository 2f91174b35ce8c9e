#include "verify/scenes.hpp"

#include <cfloat>
#include <cmath>
#include <memory>

#include "base/printed.hpp"
#include "frame/input.hpp"
#include "meniscus/camera.hpp"
#include "meniscus/whitewater.hpp"
#include "program/dam_break.hpp"
#include "stages/vec.hpp"
#include "verify/random.hpp"

namespace meniscus::verify {
namespace {

// A camera whose lens is given by numbers, since the library's tangent differs from one machine to
// the next. focal: half the image's height at distance `focal` is 1.
Camera camera_at(std::array<double, 3> eye, std::array<double, 3> target, double focal, int width,
                 int height) {
  Camera camera = look_at(eye, target, {0, 1, 0}, 45, width, height);
  camera.projection[0] = focal * height / width;
  camera.projection[5] = focal;
  return camera;
}

Camera orthographic(Camera camera, double half_height) {
  camera.projection = {camera.height / half_height / camera.width,
                       0,
                       0,
                       0.1,
                       0,
                       1 / half_height,
                       0,
                       -0.05,
                       0,
                       0,
                       -0.02,
                       -1.02,
                       0,
                       0,
                       0,
                       1};
  return camera;
}

std::vector<Method> every_method() {
  std::vector<Method> methods;
  for (const MethodEntry& entry : method_list()) methods.push_back(entry.method);
  return methods;
}

void add(Particles& particles, double x, double y, double z) { add_position(particles, {x, y, z}); }

// Two layers of 7 x 7 with a step, three pieces of splash.
Particles block() {
  Particles particles;
  particles.particle_radius = 0.5;
  Random random(7);
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 7; ++j)
      for (int i = 0; i < 7; ++i) {
        // Not as arguments: compilers differ in which one they work out first.
        const double z = random(-.2, .2), y = random(-.12, .12), x = random(-.12, .12);
        add(particles, i + x, j + y, (i < 4 ? 0 : -5) - k + z);
      }
  add(particles, 8.4, 3.1, 0.5);
  add(particles, 1.2, 8.4, 2.1);
  add(particles, 1.9, 8.9, 2.2);
  return particles;
}

// A heap of `count` particles about one spacing apart, in a cube around the origin.
Particles heap(int count, unsigned seed, double spacing) {
  Particles particles;
  particles.particle_radius = spacing / 2;
  Random random(seed);
  int side = 1;
  while (side * side * side < count) ++side;
  for (int n = 0; n < count; ++n) {
    const double half = 0.5 * (side - 1);
    const double z = random(-.2, .2), y = random(-.2, .2), x = random(-.2, .2);
    add(particles, spacing * (n % side - half + x), spacing * (n / side % side - half + y),
        spacing * (n / side / side - half + z));
  }
  return particles;
}

void move(Particles& particles) {
  for (std::size_t k = 0; k < particles.size(); ++k) {
    particles.vx.push_back(0.5f * particles.y[k]);
    particles.vy.push_back(-0.25f * particles.x[k]);
    particles.vz.push_back(0.5f);
  }
}

// A heap, and beside it what floats hold at their edges.
Particles edges() {
  Particles particles = heap(60, 3, 1);
  const float denormal = 1e-40f, largest = FLT_MAX, none = NAN, far = INFINITY;
  for (const float x :
       {denormal, -denormal, FLT_MIN, largest, -largest, none, far, -far, 1e6f, -0.0f})
    for (const float y : {0.0f, denormal, largest, -largest}) add(particles, x, y, 0.3f);
  for (int k = 0; k < 6; ++k) add(particles, 2.5, 0.5, 0.25);        // one upon the other
  for (int k = 0; k < 6; ++k) add(particles, -2.5, 0.5 * k, 0.125);  // in a row
  move(particles);
  particles.vx[3] = denormal;
  particles.vy[5] = 1e30f;
  return particles;
}

// A wall two particles thick that fills the view up to its edges.
Particles wall() {
  Particles particles;
  particles.particle_radius = 0.5;
  Random random(13);
  for (int k = 0; k < 2; ++k)
    for (int j = -9; j <= 9; ++j)
      for (int i = -14; i <= 14; ++i)
        add(particles, i + random(-.2, .2), j + random(-.2, .2),
            (i > 3 ? -1.5 : 0) - k + random(-.2, .2));
  move(particles);
  return particles;
}

// Foam and bubbles about the particles and spray above some, of different sizes.
std::vector<Particles> whitewater_around(const Particles& water) {
  std::vector<Particles> types(3);
  Random random(23);
  for (std::size_t k = 0; k < water.size(); ++k) {
    Particles& type = types[k % 3];
    const bool spray = k % 3 == 1;
    const double r = water.particle_radius, wide = spray ? 6 * r : r;
    add(type, water.x[k] + random(-wide, wide),
        water.y[k] + random(-wide, wide) + (spray ? 6 * r : 0), water.z[k] + random(-wide, wide));
    type.radius.push_back(static_cast<float>(r * random(.02, .6)));
  }
  move(types[0]);
  move(types[1]);
  return types;
}

std::string size_of_scene(const Particles& particles, const Camera& camera) {
  return counted(particles.size(), "particle") + ", " + std::to_string(camera.width) + "x" +
         std::to_string(camera.height);
}

Scene scene(const char* name, bool small, Particles particles, const Camera& camera,
            std::vector<Method> methods) {
  return {name,   size_of_scene(particles, camera),
          small,  std::move(particles),
          camera, std::move(methods)};
}

std::vector<Scene> make_kernel_scenes() {
  std::vector<Scene> scenes;
  Particles stepped = block();
  move(stepped);
  scenes.push_back(scene("block", true, std::move(stepped),
                         camera_at({9, 10, 11}, {3.2, 3.6, -1}, 2.6, 24, 17), every_method()));
  Particles one;
  one.particle_radius = 0.5;
  add(one, 0.1, 0.2, 0.3);
  scenes.push_back(
      scene("one", true, one, camera_at({1, 2, 4}, {0, 0, 0}, 2, 9, 7), every_method()));
  Particles none;
  none.particle_radius = 0.5;
  scenes.push_back(
      scene("none", true, none, camera_at({1, 2, 4}, {0, 0, 0}, 2, 5, 3), every_method()));
  Particles odd = heap(131, 5, 1);
  Random random(9);
  for (std::size_t k = 0; k < odd.size(); ++k)
    odd.radius.push_back(static_cast<float>(random(.35, .65)));
  scenes.push_back(scene("odd", false, std::move(odd),
                         orthographic(camera_at({3, 4, 9}, {0, 0, 0}, 2, 61, 43), 5),
                         every_method()));
  scenes.push_back(
      scene("edges", false, edges(), camera_at({4, 5, 8}, {0, 0, 0}, 2, 33, 29), every_method()));
  Particles crowd = heap(6000, 11, 1);
  move(crowd);
  scenes.push_back(scene("crowd", false, std::move(crowd),
                         camera_at({30, 40, 90}, {0, 0, 0}, 2, 20, 18), every_method()));
  scenes.push_back(
      scene("wall", false, wall(), camera_at({0.3, 0.4, 9}, {0, 0, 0}, 2, 45, 27), every_method()));
  // Many on few pixels, for the kernels with atomics alone: all work-items meet.
  scenes.push_back(scene("storm", false, heap(300000, 17, 1),
                         camera_at({100, 70, 240}, {0, 0, 0}, 2.6, 14, 9), {}));
  // The same with particles so large that they cover whole cells (bound_cells).
  scenes.push_back(
      scene("swarm", false, heap(60000, 19, 1), camera_at({10, 7, 60}, {0, 0, 0}, 12, 90, 60), {}));
  return scenes;
}

std::vector<Scene> make_whole_frames() {
  std::vector<Scene> frames;
  const auto dam_break = [&](const char* name, std::int64_t count, int width, int height,
                             bool small) {
    Particles particles = synthetic_frame(count, width, height).particles;
    move(particles);
    frames.push_back(scene(name, small, std::move(particles),
                           camera_at({4.2, 2.4, 3.6}, {1.4, 0.2, 0.7}, 2.2, width, height),
                           every_method()));
  };
  dam_break("pool", 60, 25, 19, true);
  dam_break("breaking dam", 9000, 320, 240, false);
  frames.back().whitewater = whitewater_around(frames.back().particles);
  FrameInput dam = dam_frame();
  frames.push_back(scene("dam 015", false, std::move(dam.particles), resized(dam.camera, 400, 300),
                         every_method()));
  return frames;
}

}  // namespace

const std::vector<Scene>& kernel_scenes() {
  static const std::vector<Scene> scenes = make_kernel_scenes();
  return scenes;
}

const std::vector<Scene>& whole_frames() {
  static const std::vector<Scene> frames = make_whole_frames();
  return frames;
}

Parameters parameters_of(const Scene& scene, Method method) {
  Parameters parameters;
  parameters.method = method;
  if (scene.camera.width < 64) {  // some cells of the mesh and of the region wide at least
    parameters.grid.cell = 3;
    parameters.region.sigma_s = 0.3;
  }
  return parameters;
}

Surface surface_of(Device& device, const Scene& scene, Method method) {
  const Parameters parameters = parameters_of(scene, method);
  Surface surface = extract(device, scene.particles, scene.camera, parameters);
  if (scene.whitewater.empty()) return surface;
  std::vector<std::unique_ptr<ParticleSource>> particles;
  std::vector<WhitewaterSource> sources;
  for (const WhitewaterType type : kWhitewaterTypes) {
    particles.push_back(source_of(scene.whitewater.at(particles.size())));
    sources.push_back({.type = type, .particles = particles.back().get()});
  }
  draw_whitewater(device, sources, parameters, surface);
  return surface;
}

}  // namespace meniscus::verify
