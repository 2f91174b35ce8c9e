#include "accuracy/study.hpp"

#include <chrono>

#include "accuracy/parallel.hpp"
#include "accuracy/particles.hpp"

namespace meniscus::accuracy {
namespace {

constexpr double kStep = 0.3;  // pixels that the camera moves from frame to frame
constexpr int kMovingFrames = 4;

}  // namespace

std::vector<Case> make_cases(const std::vector<std::string>& scene_names,
                             const std::vector<std::uint64_t>& seeds, const Setup& setup) {
  std::vector<Case> cases;
  for (const std::string& name : scene_names)
    for (const std::uint64_t seed : seeds) cases.push_back({&find_scene(name), seed, {}, {}});
  for_each_index(static_cast<int>(cases.size()), [&](int k) {
    Case& c = cases[k];
    c.particles = make_particles(*c.scene, setup.noise, c.seed);
    c.truths.push_back(trace(*c.scene, lens_of(*c.scene, setup.orthographic)));
    const double step = kStep / c.truths[0].mean_scale();
    for (int frame = 1; setup.moving && frame < kMovingFrames; ++frame)
      c.truths.push_back(trace(*c.scene, lens_of(*c.scene, setup.orthographic, frame * step)));
  });
  return cases;
}

Measurement measure(Device& device, const Case& scene_case, Parameters parameters) {
  parameters.particle_radius = kParticleRadius;
  Measurement result;
  std::vector<Map> maps;
  for (const Truth& truth : scene_case.truths) {
    const auto start = std::chrono::steady_clock::now();
    Surface surface = extract(device, scene_case.particles, camera_of(truth.lens), parameters);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    maps.push_back({surface.depth, surface.normal});
    if (maps.size() > 1) continue;
    result.seconds = taken.count();
    result.surface = std::move(surface);
  }
  result.figures = compare(scene_case.truths[0], maps[0]);
  if (maps.size() > 1) result.figures.flicker = flicker(scene_case.truths, maps);
  return result;
}

}  // namespace meniscus::accuracy
