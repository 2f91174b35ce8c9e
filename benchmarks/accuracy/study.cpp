#include "accuracy/study.hpp"

#include <chrono>

#include "accuracy/figures/flicker.hpp"
#include "accuracy/figures/mesh_distance.hpp"
#include "accuracy/parallel.hpp"
#include "base/elapsed.hpp"

namespace meniscus::accuracy {
namespace {

constexpr double kStep = 0.3;  // pixels that the camera moves from frame to frame
constexpr int kMovingFrames = 4;

/// Frames 1 to 3 of the case, whose scene is turned to its camera, in this motion.
Flow flow_of(const Case& scene_case, const Scene& scene, const Motion& motion, double Figures::*rms,
             double Figures::*p999) {
  Flow flow{rms, p999, motion, {}, {}};
  for (int frame = 1; frame < kMovingFrames; ++frame) {
    flow.particles.push_back(moved(scene_case.particles, motion, frame));
    flow.truths.push_back(trace(moved(scene, motion, frame), scene_case.truths[0].lens));
  }
  return flow;
}

}  // namespace

Scene posed_for(const Scene& scene, const Setup& setup, std::uint64_t seed) {
  const Scene turned = moved_back(posed(scene, seed), setup.distance);
  return setup.scale > 0 ? scaled(turned, setup.scale) : turned;
}

std::vector<Case> make_cases(const std::vector<std::string>& scene_names,
                             const std::vector<std::uint64_t>& seeds, const Setup& setup) {
  std::vector<Case> cases;
  for (const std::string& name : scene_names)
    for (const std::uint64_t seed : seeds)
      cases.push_back({&find_scene(name), seed, {}, {}, setup.jitter, {}});
  for_each_index(static_cast<int>(cases.size()), [&](int k) {
    Case& c = cases[k];
    const Scene scene = posed_for(*c.scene, setup, c.seed);
    c.particles = make_particles(scene, setup.noise, c.seed, setup.filling);
    c.truths.push_back(trace(scene, lens_of(scene, setup.orthographic)));
    const bool is_steady_seed = k % seeds.size() < setup.moving_seeds;
    if (setup.flowing && is_steady_seed)
      c.flows = {
          flow_of(c, scene, rigid_motion(scene.target), &Figures::moved, &Figures::moved_p999),
          flow_of(c, scene, smooth_bend(), &Figures::bent, &Figures::bent_p999)};
    const bool moving = setup.moving && is_steady_seed;
    if (!moving && setup.jitter == 0) return;
    const double step = moving ? kStep / c.truths[0].mean_scale() : 0;
    for (int frame = 1; frame < kMovingFrames; ++frame)
      c.truths.push_back(step > 0 ? trace(scene, lens_of(scene, setup.orthographic, frame * step))
                                  : c.truths[0]);
  });
  return cases;
}

Measurement measure(Device& device, const Case& scene_case, const Parameters& parameters) {
  return measure(library_method(device, parameters).extract, scene_case);
}

Measurement measure(const Extractor& extract, const Case& scene_case) {
  Measurement result;
  std::vector<Map> maps;
  for (const Truth& truth : scene_case.truths) {
    const int frame = static_cast<int>(maps.size());
    const Particles particles =
        frame > 0 ? jittered(scene_case.particles, scene_case.jitter, scene_case.seed, frame)
                  : scene_case.particles;
    const auto start = std::chrono::steady_clock::now();
    Surface surface = extract(particles, truth.lens);
    const double seconds = seconds_since(start);
    maps.push_back({surface.depth, surface.normal});
    if (maps.size() > 1) continue;
    result.seconds = seconds;
    result.surface = std::move(surface);
  }
  result.figures = compare(scene_case.truths[0], maps[0]);
  if (maps.size() > 1) {
    const Flicker change = flicker(scene_case.truths, maps);
    const bool jittered = scene_case.jitter > 0;
    (jittered ? result.figures.jitter : result.figures.flicker) = change.rms;
    (jittered ? result.figures.jitter_p999 : result.figures.flicker_p999) = change.p999;
  }
  for (const Flow& flow : scene_case.flows) {
    std::vector<Truth> truths{scene_case.truths[0]};
    std::vector<Map> flowing{maps[0]};
    for (std::size_t k = 0; k < flow.truths.size(); ++k) {
      const Surface surface = extract(flow.particles[k], flow.truths[k].lens);
      flowing.push_back({surface.depth, surface.normal});
      truths.push_back(flow.truths[k]);
    }
    const Flicker change = flicker(truths, flowing, flow.motion);
    result.figures.*flow.rms = change.rms;
    result.figures.*flow.p999 = change.p999;
  }
  if (!result.surface.mesh.position.empty()) {
    const MeshDistance mesh =
        mesh_distance(*scene_case.scene, scene_case.truths[0], result.surface.mesh);
    result.figures.mesh_rms = mesh.rms;
    result.figures.mesh_p95 = mesh.p95;
    result.figures.mesh_p999 = mesh.p999;
    result.figures.mesh_outline = mesh.outline_rms;
  }
  return result;
}

}  // namespace meniscus::accuracy
