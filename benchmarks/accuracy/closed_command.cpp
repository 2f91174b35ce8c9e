// Measuring closed meshes.
#include <chrono>
#include <filesystem>
#include <functional>
#include <span>
#include <utility>

#include "accuracy/closed.hpp"
#include "accuracy/commands.hpp"
#include "accuracy/particles.hpp"
#include "accuracy/peers.hpp"
#include "accuracy/series.hpp"
#include "accuracy/table.hpp"
#include "base/elapsed.hpp"
#include "base/printed.hpp"
#include "meniscus/closed.hpp"
#include "meniscus/device.hpp"

namespace meniscus::accuracy {
namespace {

struct Row {
  ClosedFigures figures;
  double milliseconds;  // to make it
};

using F = ClosedFigures;

template <auto Member>
double of(const Row& row) {
  return static_cast<double>(row.figures.*Member);
}

const Column<Row> kColumns[] = {
    {"distance", 8, 4, of<&F::distance_rms>},
    {"99.9 %", 8, 3, of<&F::distance_999>},
    {"farthest", 8, 2, of<&F::distance_most>},
    {"normal", 8, 2, of<&F::normal_median>},
    {"95 %", 8, 2, of<&F::normal_95>},
    {"within", 8, 2, of<&F::within_median>},
    {"95 %", 8, 2, of<&F::within_95>},
    {"crease", 8, 3, of<&F::crease_rms>, Over::known},
    {"volume%", 8, 2, [](const Row& r) { return 100 * r.figures.volume; }, Over::magnitude},
    {"triangl.", 8, 0, of<&F::triangles>, Over::total},
    {"open", 5, 0, of<&F::open_edges>, Over::total},
    {"edges", 5, 0, of<&F::bad_edges>, Over::total},
    {"fans", 5, 0, of<&F::bad_vertices>, Over::total},
    {"piece", 5, 0, of<&F::pieces>, Over::total},
    {"bubbl", 5, 0, of<&F::bubbles>, Over::total},
    {"ms", 7, 0, [](const Row& r) { return r.milliseconds; }},
};

std::string labels(const std::string& scene, const std::string& method) {
  return printed("%-12s %-12s", scene.c_str(), method.c_str());
}

using Make = std::function<Mesh(const Particles&)>;
using Methods = std::vector<std::pair<std::string, Make>>;

void measure_setting(const Methods& methods, const ScenesOptions& scenes, const Setup& setup,
                     const std::string& meshes, const std::string& prefix) {
  const std::span<const Column<Row>> columns = kColumns;
  print_head(labels("scene", "method"), columns);
  std::vector<std::vector<Row>> rows(methods.size());
  for (const std::string& name : scenes_named(scenes.scenes)) {
    const Scene& scene = find_scene(name);
    if (!scene.splash.empty()) continue;  // whose truth is a field
    const double true_volume = volume(scene);
    for (const std::uint64_t seed : seeds_named(scenes.seeds)) {
      const Particles particles = make_particles(scene, setup.noise, seed, setup.filling);
      for (std::size_t m = 0; m < methods.size(); ++m) {
        const auto begin = std::chrono::steady_clock::now();
        const Mesh mesh = methods[m].second(particles);
        const double milliseconds = milliseconds_since(begin);
        rows[m].push_back({measure_closed(scene, true_volume, mesh), milliseconds});
        print_row(labels(name, methods[m].first), columns, rows[m].back());
        if (!meshes.empty())
          write_mesh((std::filesystem::path(meshes) / (prefix + name + "_" + std::to_string(m) +
                                                       "_" + std::to_string(seed) + ".ply"))
                         .string(),
                     mesh);
      }
    }
  }
  for (std::size_t m = 0; m < methods.size(); ++m)
    if (!rows[m].empty())
      print_values(labels("mean", methods[m].first), columns, values_over(columns, rows[m]));
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
