// Measuring the analytic scenes.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iterator>

#include "accuracy/commands.hpp"
#include "accuracy/error_map.hpp"
#include "accuracy/results.hpp"
#include "accuracy/series.hpp"
#include "base/comma_separated.hpp"
#include "meniscus/device.hpp"

namespace meniscus::accuracy {
namespace {

void print_header(const Series& series, const Setting& setting) {
  print_title(series, setting);
  std::printf("%-12s %-14s", "", "");
  for (const FigureField& field : figure_fields())
    std::printf(" %8s", field.name.substr(0, field.name.find('_')).c_str());
  std::printf("\n%-12s %-14s", "scene", "method");
  for (const FigureField& field : figure_fields()) {
    const auto split = field.name.find('_');
    std::printf(" %8s", split == std::string::npos ? "" : field.name.substr(split + 1).c_str());
  }
  std::printf(" %8s\n%-12s %-14s", "time", "", "");
  for (const FigureField& field : figure_fields())
    // printf counts bytes, and the degree sign has two.
    std::printf(" %*s", field.unit == "°" ? 9 : 8, field.unit.c_str());
  std::printf(" %8s\n", "ms");
}

void print(const Row& row) {
  std::printf("%-12s %-14s", row.scene.c_str(), row.method.c_str());
  for (const FigureField& field : figure_fields()) {
    const double value = row.figures.*field.value;
    if (std::isnan(value))
      std::printf(" %8s", "-");
    else
      std::printf(" %8.*f", field.digits, value);
  }
  std::printf(" %8.0f\n", 1000 * row.seconds);
  std::fflush(stdout);
}

void write_pictures(const std::string& folder, const Row& row, const Case& scene_case,
                    const Surface& surface) {
  const std::string name = row.scene + "_" + row.method + "_" + std::to_string(scene_case.seed);
  const std::string stem =
      (std::filesystem::path(folder) / (file_prefix(row.series, row.setting) + name)).string();
  write_png(stem + "_lit.png", surface, Preview::lit);
  write_png(stem + "_normal.png", surface, Preview::normal);
  write_png(stem + "_groups.png", surface, Preview::groups);
  const Bytes errors = error_map(scene_case.truths[0], {surface.depth, surface.normal});
  write_file(stem + "_error.png", errors.data(), errors.size());
}

/// The truth of the case's first frame, as methods give theirs.
Surface true_surface(const Case& scene_case) {
  const Truth& truth = scene_case.truths[0];
  return surface_of(truth.lens, map_of(truth), kParticleRadius);
}

/// What is gathered while the scenes are measured.
struct Gathered {
  std::vector<Row> rows;     // means over the seeds and over the scenes
  std::vector<Row> by_seed;  // with the seeds in `seeds`
  std::vector<std::uint64_t> seeds;
  Gallery gallery;  // the first setting's first seed
};

/// Rows of every scene with every method, then the means over the scenes. Only one scene's cases
/// are in memory at a time.
void measure_setting(const std::vector<Contender>& contenders, const CommonOptions& common,
                     const ScenesOptions& options, const Series& series, const Setting& setting,
                     Gathered& gathered) {
  Setup setup = options.setup;
  setting.change(setup);
  print_header(series, setting);
  const bool with_gallery = !common.html.empty() && gathered.rows.empty();
  std::vector<std::vector<Row>> of_method(contenders.size());
  for (const std::string& scene : scenes_named(options.scenes)) {
    const std::vector<Case> cases = make_cases({scene}, seeds_named(options.seeds), setup);
    Gallery::Row pictures{scene, {}};
    if (with_gallery) {
      const Surface truth = true_surface(cases[0]);
      pictures.cells.push_back(
          {"truth", picture_of(truth, Preview::lit), picture_of(truth, Preview::normal)});
    }
    if (!common.pictures.empty())
      for (const Case& c : cases)
        write_pictures(common.pictures, {series.name, setting.name, scene, "truth", false, {}, 0},
                       c, true_surface(c));
    for (std::size_t k = 0; k < contenders.size(); ++k) {
      std::vector<Row> of_seed;
      for (const Case& c : cases) {
        const Measurement m = measure(contenders[k].extract, c);
        of_seed.push_back({series.name, setting.name, scene, contenders[k].name, c.scene->smooth,
                           m.figures, m.seconds});
        gathered.by_seed.push_back(of_seed.back());
        gathered.seeds.push_back(c.seed);
        if (!common.pictures.empty()) write_pictures(common.pictures, of_seed.back(), c, m.surface);
        if (with_gallery && of_seed.size() == 1)
          pictures.cells.push_back({contenders[k].name,
                                    error_map(c.truths[0], {m.surface.depth, m.surface.normal}),
                                    picture_of(m.surface, Preview::normal)});
      }
      of_method[k].push_back(mean_of(of_seed, scene));
      print(of_method[k].back());
    }
    if (with_gallery) gathered.gallery.rows.push_back(std::move(pictures));
  }

  for (const std::vector<Row>& all : of_method) {
    gathered.rows.insert(gathered.rows.end(), all.begin(), all.end());
    std::vector<Row> smooth;
    std::copy_if(all.begin(), all.end(), std::back_inserter(smooth),
                 [](const Row& row) { return row.smooth; });
    gathered.rows.push_back(mean_of(all, kMean));
    print(gathered.rows.back());
    if (smooth.empty()) continue;
    gathered.rows.push_back(mean_of(smooth, kSmoothMean));
    print(gathered.rows.back());
  }
}

nlohmann::json document_of(const Gathered& gathered, const CommonOptions& common,
                           const ScenesOptions& options, const std::string& device) {
  nlohmann::json document{{"version", version()},
                          {"device", device},
                          {"noise", options.setup.noise},
                          {"seeds", seeds_named(options.seeds)},
                          {"orthographic", options.setup.orthographic},
                          {"settings", common.settings}};
  for (const Row& row : gathered.rows) document["rows"].push_back(to_json(row));
  for (std::size_t k = 0; k < gathered.by_seed.size(); ++k) {
    nlohmann::json row = to_json(gathered.by_seed[k]);
    row["seed"] = gathered.seeds[k];
    document["by_seed"].push_back(std::move(row));
  }
  return document;
}

Report report_of(Gathered gathered, const CommonOptions& common, const ScenesOptions& options,
                 const std::string& device) {
  Report report;
  report.title = "Accuracy of Meniscus";
  report.introduction =
      "Analytic solids, filled with particles, extracted by each method and compared with the "
      "truth, which comes from ray casting the solid. Lengths are in s, the particle spacing: two "
      "particle radii. The best value of a line is bold; a dash: nothing to measure.";
  report.facts = {
      {"version", version()},
      {"device", device},
      {"seeds", comma_separated(seeds_named(options.seeds),
                                [](std::uint64_t seed) { return std::to_string(seed); })},
      {"noise", shown(Quantity{"", "s", 2, Better::low, ""}, options.setup.noise) +
                    " s in each coordinate, unless "
                    "the series says otherwise"}};
  if (!common.settings.empty()) report.facts.emplace_back("set", comma_separated(common.settings));
  add_tables(gathered.rows, report);
  Gallery& gallery = gathered.gallery;
  if (!gallery.rows.empty()) {
    gallery.title = "Where the surfaces are wrong";
    gallery.note =
        "Each scene with the first seed. The error along the true normal, by colour; or the "
        "normals of the extracted surface. Click a picture to enlarge it.";
    gallery.first_kind = "errors";
    gallery.second_kind = "normals";
    report.galleries.push_back(std::move(gallery));
  }
  report.error_legend = true;
  return report;
}

}  // namespace

void run_scenes(const CommonOptions& common, const ScenesOptions& options) {
  Device device(common.device);
  const std::vector<Contender> contenders = contenders_of(common, device);
  if (!common.pictures.empty()) std::filesystem::create_directories(common.pictures);
  Gathered gathered;
  for (const Series& series : series_named(options.series))
    for (const Setting& setting : series.settings)
      measure_setting(contenders, common, options, series, setting, gathered);
  const std::string name = device.info().name;
  const std::string json = document_of(gathered, common, options, name).dump(1) + "\n";
  write_results(common, json, report_of(std::move(gathered), common, options, name));
}

}  // namespace meniscus::accuracy
