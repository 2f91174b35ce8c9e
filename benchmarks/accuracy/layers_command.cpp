// Measuring layers along rays.
#include <cmath>
#include <cstdio>
#include <string>

#include "accuracy/commands.hpp"
#include "accuracy/layers.hpp"
#include "accuracy/particles.hpp"
#include "accuracy/series.hpp"
#include "meniscus/device.hpp"

namespace meniscus::accuracy {
namespace {

void print(const std::string& scene, const LayerFigures& f) {
  std::printf("%-12s %8lld %8lld %9.4f %8.3f %8.4f %8.4f %8.2f %8.2f %9.2f %9.2f %9.2f %7.2f\n",
              scene.c_str(), static_cast<long long>(f.pixels), static_cast<long long>(f.inner),
              f.thickness_rms, f.thickness_999, f.front_rms, f.back_rms, f.normal_median,
              f.normal_95, 100 * f.second_right, 100 * f.second_right_inner, 100 * f.number_right,
              100 * f.films);
  std::fflush(stdout);
}

void measure_setting(Device& device, const ScenesOptions& scenes, const Setup& setup) {
  std::printf("%-12s %8s %8s %9s %8s %8s %8s %8s %8s %9s %9s %9s %7s\n", "scene", "pixels", "inner",
              "thickness", "99.9 %", "front", "back", "normal", "95 %", "second %", "inner %",
              "number %", "films %");
  LayerFigures mean;
  double count = 0;
  for (const std::string& name : scenes_named(scenes.scenes)) {
    const Scene& scene = find_scene(name);
    if (!scene.splash.empty()) continue;  // whose truth is a field
    for (const std::uint64_t seed : seeds_named(scenes.seeds)) {
      const Lens lens = lens_of(shown(scene, setup, seed), setup.orthographic);
      Parameters parameters;
      parameters.particle_radius = kParticleRadius;
      parameters.mesh = false;
      parameters.layers = 8;
      const Surface surface =
          extract(device, make_particles(scene, setup.noise, seed, setup.filling), camera_of(lens),
                  parameters);
      const LayerFigures f = measure_layers(trace_layers_of(scene, lens), surface);
      print(name, f);
      ++count;
      mean.pixels += f.pixels;
      mean.inner += f.inner;
      for (double LayerFigures::*const value :
           {&LayerFigures::thickness_rms, &LayerFigures::thickness_999, &LayerFigures::front_rms,
            &LayerFigures::back_rms, &LayerFigures::normal_median, &LayerFigures::normal_95,
            &LayerFigures::second_right, &LayerFigures::second_right_inner,
            &LayerFigures::number_right, &LayerFigures::films})
        mean.*value += f.*value;
    }
  }
  if (count == 0) return;
  for (double LayerFigures::*const value :
       {&LayerFigures::thickness_rms, &LayerFigures::thickness_999, &LayerFigures::front_rms,
        &LayerFigures::back_rms, &LayerFigures::normal_median, &LayerFigures::normal_95,
        &LayerFigures::second_right, &LayerFigures::second_right_inner, &LayerFigures::number_right,
        &LayerFigures::films})
    mean.*value /= count;
  print("mean", mean);
}

}  // namespace

void run_layer_scenes(const CommonOptions& common, const ScenesOptions& scenes) {
  Device device(common.device);
  for_each_setting(
      scenes.series, scenes.setup, Changes::view,
      [&](const Setup& setup, const std::string&) { measure_setting(device, scenes, setup); });
}

}  // namespace meniscus::accuracy
