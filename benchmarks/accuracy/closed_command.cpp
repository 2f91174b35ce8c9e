// Measuring closed meshes.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <utility>

#include "accuracy/closed.hpp"
#include "accuracy/commands.hpp"
#include "accuracy/particles.hpp"
#include "accuracy/peers.hpp"
#include "accuracy/series.hpp"
#include "base/printed.hpp"
#include "meniscus/closed.hpp"
#include "meniscus/device.hpp"

namespace meniscus::accuracy {
namespace {

void print(const std::string& scene, const std::string& method, const ClosedFigures& f,
           double seconds) {
  const auto cell = [](int digits, double value) {
    std::isnan(value) ? std::printf(" %8s", "-") : std::printf(" %8.*f", digits, value);
  };
  std::printf("%-12s %-12s", scene.c_str(), method.c_str());
  cell(4, f.distance_rms);
  cell(3, f.distance_999);
  cell(2, f.distance_most);
  cell(2, f.normal_median);
  cell(2, f.normal_95);
  cell(2, f.within_median);
  cell(2, f.within_95);
  cell(3, f.crease_rms);
  cell(2, 100 * f.volume);
  std::printf(" %8lld %5lld %5lld %5lld %5lld %5lld %7.0f\n", static_cast<long long>(f.triangles),
              static_cast<long long>(f.open_edges), static_cast<long long>(f.bad_edges),
              static_cast<long long>(f.bad_vertices), static_cast<long long>(f.pieces),
              static_cast<long long>(f.bubbles), 1000 * seconds);
  std::fflush(stdout);
}

using Make = std::function<Mesh(const Particles&)>;
using Methods = std::vector<std::pair<std::string, Make>>;

void measure_setting(const Methods& methods, const ScenesOptions& scenes, const Setup& setup,
                     const std::string& meshes, const std::string& prefix) {
  std::printf("%-12s %-12s %8s %8s %8s %8s %8s %8s %8s %8s %8s %8s %5s %5s %5s %5s %5s %7s\n",
              "scene", "method", "distance", "99.9 %", "farthest", "normal", "95 %", "within",
              "95 %", "crease", "volume%", "triangl.", "open", "edges", "fans", "piece", "bubbl",
              "ms");
  std::vector<ClosedFigures> sum(methods.size());
  std::vector<double> seconds(methods.size(), 0.0), of_creases(methods.size(), 0.0);
  double count = 0;
  for (const std::string& name : scenes_named(scenes.scenes)) {
    const Scene& scene = find_scene(name);
    if (!scene.splash.empty()) continue;  // whose truth is a field
    const double true_volume = volume(scene);
    for (const std::uint64_t seed : seeds_named(scenes.seeds)) {
      ++count;
      const Particles particles = make_particles(scene, setup.noise, seed, setup.filling);
      for (std::size_t m = 0; m < methods.size(); ++m) {
        const auto begin = std::chrono::steady_clock::now();
        const Mesh mesh = methods[m].second(particles);
        const double took =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        const ClosedFigures f = measure_closed(scene, true_volume, mesh);
        print(name, methods[m].first, f, took);
        if (!meshes.empty())
          write_mesh((std::filesystem::path(meshes) / (prefix + name + "_" + std::to_string(m) +
                                                       "_" + std::to_string(seed) + ".ply"))
                         .string(),
                     mesh);
        ClosedFigures& s = sum[m];
        s.distance_rms += f.distance_rms;
        s.distance_999 += f.distance_999;
        s.distance_most += f.distance_most;
        s.normal_median += f.normal_median;
        s.normal_95 += f.normal_95;
        s.within_median += f.within_median;
        s.within_95 += f.within_95;
        if (!std::isnan(f.crease_rms)) {
          s.crease_rms += f.crease_rms;
          ++of_creases[m];
        }
        s.volume += std::abs(f.volume);
        s.triangles += f.triangles;
        s.open_edges += f.open_edges;
        s.bad_edges += f.bad_edges;
        s.bad_vertices += f.bad_vertices;
        s.pieces += f.pieces;
        s.bubbles += f.bubbles;
        seconds[m] += took;
      }
    }
  }
  if (count == 0) return;
  for (std::size_t m = 0; m < methods.size(); ++m) {
    ClosedFigures& s = sum[m];
    for (double* const value :
         {&s.distance_rms, &s.distance_999, &s.distance_most, &s.normal_median, &s.normal_95,
          &s.within_median, &s.within_95, &s.volume})
      *value /= count;
    s.crease_rms /= of_creases[m];
    print("mean", methods[m].first, s, seconds[m] / count);
  }
}

}  // namespace

void run_closed_scenes(const CommonOptions& common, const ScenesOptions& scenes,
                       const ClosedOptions& options) {
  Device device(common.device);
  Methods methods;
  for (const double adaptive : {0.0, kAdaptive})
    for (const double cell : options.cells)
      methods.emplace_back((adaptive > 0 ? "adaptive " : "cell ") + printed("%g", cell),
                           [&device, closed = ClosedParams{.cell = cell, .adaptive = adaptive}](
                               const Particles& particles) {
                             return extract_closed(device, particles, closed).mesh;
                           });
  if (options.splashsurf)
    methods.emplace_back("splashsurf", [&](const Particles& particles) {
      return reconstruct_with_splashsurf(common.splashsurf, particles, kParticleRadius);
    });
  if (!options.openvdb.empty())
    methods.emplace_back("openvdb", [&](const Particles& particles) {
      return reconstruct_with_openvdb(options.openvdb, particles, kParticleRadius);
    });
  const Particles any = make_particles(find_scene("sphere"), 0, 1);
  for (const auto& [name, make] : methods) make(any);  // builds kernels
  for_each_setting(scenes.series, scenes.setup, Changes::particles,
                   [&](const Setup& setup, const std::string& prefix) {
                     measure_setting(methods, scenes, setup, options.meshes, prefix);
                   });
}

}  // namespace meniscus::accuracy
