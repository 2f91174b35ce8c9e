#include "verify/cases.hpp"

#include <numeric>

#include "meniscus/extract.hpp"
#include "prepare/gather.hpp"
#include "stages/extras/whitewater.hpp"
#include "stages/frame/project.hpp"
#include "stages/frame/visible.hpp"
#include "verify/with_discs.hpp"

namespace meniscus::verify {
namespace {

// The passes over particles that stream (stream.cl).
void run_stream(Device& device, const Scene& scene) {
  device.state().stage = "stream";
  const auto source = source_of(scene.particles);
  const View view = make_view(scene.camera, scene.particles.particle_radius, {0, 0, 0});
  // All in one part: the next one would find what the last one left in the list, in any order.
  const std::size_t all = scene.particles.size();
  const FrontMap map = find_fronts(
      device, view, *source, all,
      {.cell = 2, .border = 4, .margin = 2, .block = 8, .around = 8, .reach = 4, .thickness = 0.8});
  select_near(device, view, *source, all, map, {}, [](const auto&, const auto&) {});
  device.state().stage.clear();
}

// Who is seen (visible.cl, bins.cl), of so many that work-items meet in the atomics.
void run_visible(Device& device, const Scene& scene) {
  device.state().stage = "visible";
  const View view = make_view(scene.camera, scene.particles.particle_radius, {0, 0, 0});
  const WorldParticles world{
      scene.particles.x, scene.particles.y, scene.particles.z, {}, false, {}};
  const Projected projected = project_particles(view, world, 2);
  std::vector<std::int32_t> all(projected.size());
  std::iota(all.begin(), all.end(), 0);
  find_visible(device, view, projected, all, {}, 0);
  device.state().stage.clear();
}

// Sums of whitewater, of so many that work-items meet in all of them; velocities are positions.
void run_whitewater(Device& device, const Scene& scene) {
  device.state().stage = "whitewater";
  const View view = make_view(scene.camera, scene.particles.particle_radius, {0, 0, 0});
  const auto x = upload(device, scene.particles.x), y = upload(device, scene.particles.y),
             z = upload(device, scene.particles.z);
  const auto radius = upload(device, std::vector<float>(x.size, 0.3f));
  const std::vector<float> depth(pixel_grid(view).size(), world_depth(view, 450));
  const WhitewaterType type = WhitewaterType::bubble;
  const WhitewaterSums sums = no_whitewater(device, view, true, true);
  draw_whitewater(device, view, {x, y, z, radius, x, y, z}, x.size,
                  shown_depths(device, view, type, depth, {}, 1), sums);
  finish_whitewater(device, view, type, sums);
  device.state().stage.clear();
}

// Two work-items that race do not collide every time.
constexpr int kStormRounds = 6;

// What is run on a scene that no method has: many work-items meet, round after round.
void add_storm(const Scene& scene, std::vector<Case>& cases) {
  cases.push_back(
      {"whitewater on " + scene.name, scene.size, false, false, [&scene](Device& device) {
         for (int k = 0; k < kStormRounds; ++k) run_whitewater(device, scene);
       }});
  for (const DiscForm form : {DiscForm::bins, DiscForm::minima})
    cases.push_back(
        {form == DiscForm::bins ? "visible on " + scene.name : "visible by minima on " + scene.name,
         scene.size, false, false, [&scene, form](Device& device) {
           const WithDiscs with(device, form);
           for (int k = 0; k < kStormRounds; ++k) run_visible(device, scene);
         }});
}

void add_scene(const Scene& scene, std::vector<Case>& cases) {
  for (const Method method : scene.methods)
    cases.push_back({to_string(method) + " on " + scene.name, scene.size, scene.small, scene.small,
                     [&scene, method](Device& device) {
                       extract(device, scene.particles, scene.camera, parameters_of(scene, method));
                     }});
  const bool storm = scene.methods.empty();
  if (scene.particles.size() > 1)
    cases.push_back({"stream on " + scene.name, scene.size, scene.small, scene.small,
                     [&scene, storm](Device& device) {
                       for (int k = 0; k < (storm ? kStormRounds : 1); ++k)
                         run_stream(device, scene);
                     }});
  if (storm) add_storm(scene, cases);
}

}  // namespace

const std::vector<Variant>& variants() {
  static const std::vector<Variant> all{{"width 8", 8, false, kRowGroup, 0},
                                        {"width 1", 1, false, kRowGroup, 0},
                                        {"width 8 or 16, groups of 16", 8, true, 16, 64},
                                        {"width 1, groups of 32", 1, false, 32, 64}};
  return all;
}

const std::vector<Case>& kernel_cases() {
  static const std::vector<Case> all = [] {
    std::vector<Case> cases;
    for (const Scene& scene : kernel_scenes()) add_scene(scene, cases);
    for (const StageCase& stage : stage_cases())
      for (const int size : stage.sizes) cases.push_back(case_of(stage, size));
    return cases;
  }();
  return all;
}

Case case_of(const StageCase& stage, int size) {
  const bool least = size == stage.sizes.front();
  return {std::string("stage ") + stage.stage, "size " + std::to_string(size), least, least,
          [&stage, size](Device& device) { stage.run(device, size); }};
}

std::string key_of(const Case& which, int width) {
  return which.name + ", " + which.size + ", width " + std::to_string(width);
}

std::string frame_key(const Scene& frame, Method method) {
  return "frame " + to_string(method) + " on " + frame.name;
}

}  // namespace meniscus::verify
