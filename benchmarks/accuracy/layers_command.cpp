// Measuring layers along rays.
#include <span>
#include <string>
#include <vector>

#include "accuracy/commands.hpp"
#include "accuracy/layers.hpp"
#include "accuracy/particles.hpp"
#include "accuracy/series.hpp"
#include "accuracy/table.hpp"
#include "base/printed.hpp"
#include "meniscus/device.hpp"

namespace meniscus::accuracy {
namespace {

using F = LayerFigures;

template <auto Member>
double of(const F& figures) {
  return static_cast<double>(figures.*Member);
}

template <auto Share>
double percent_of(const F& figures) {
  return 100 * figures.*Share;
}

const Column<F> kColumns[] = {
    {"pixels", 8, 0, of<&F::pixels>, Over::total},
    {"inner", 8, 0, of<&F::inner>, Over::total},
    {"thickness", 9, 4, of<&F::thickness_rms>},
    {"99.9 %", 8, 3, of<&F::thickness_999>},
    {"front", 8, 4, of<&F::front_rms>},
    {"back", 8, 4, of<&F::back_rms>},
    {"normal", 8, 2, of<&F::normal_median>},
    {"95 %", 8, 2, of<&F::normal_95>},
    {"second %", 9, 2, percent_of<&F::second_right>},
    {"inner %", 9, 2, percent_of<&F::second_right_inner>},
    {"number %", 9, 2, percent_of<&F::number_right>},
    {"films %", 7, 2, percent_of<&F::films>},
};

std::string label(const std::string& scene) { return printed("%-12s", scene.c_str()); }

void measure_setting(Device& device, const ScenesOptions& scenes, const Setup& setup) {
  const std::span<const Column<F>> columns = kColumns;
  print_head(label("scene"), columns);
  std::vector<F> rows;
  for (const std::string& name : scenes_named(scenes.scenes)) {
    const Scene& scene = find_scene(name);
    if (!scene.splash.empty()) continue;  // whose truth is a field
    for (const std::uint64_t seed : seeds_named(scenes.seeds)) {
      const Lens lens = lens_of(posed_for(scene, setup, seed), setup.orthographic);
      Parameters parameters;
      parameters.particle_radius = kParticleRadius;
      parameters.mesh = false;
      parameters.layers = 8;
      const Surface surface =
          extract(device, make_particles(scene, setup.noise, seed, setup.filling), camera_of(lens),
                  parameters);
      rows.push_back(measure_layers(trace_layers_of(scene, lens), surface));
      print_row(label(name), columns, rows.back());
    }
  }
  if (!rows.empty()) print_values(label("mean"), columns, values_over(columns, rows));
}

}  // namespace

void run_layer_scenes(const CommonOptions& common, const ScenesOptions& scenes) {
  Device device(common.device);
  for_each_setting(
      scenes.series, scenes.setup, Changes::view,
      [&](const Setup& setup, const std::string&) { measure_setting(device, scenes, setup); });
}

}  // namespace meniscus::accuracy
