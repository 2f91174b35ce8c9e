// meniscus-accuracy: extracts the analytic scenes and prints how far the maps are from the truth.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "accuracy/error_map.hpp"
#include "accuracy/series.hpp"
#include "accuracy/study.hpp"
#include "meniscus/device.hpp"
#include "parameter_list.hpp"

namespace meniscus::accuracy {
namespace {

struct Options {
  std::vector<std::string> methods;
  std::vector<std::string> scenes;
  std::vector<std::string> series{"main"};
  std::vector<std::string> seeds{"1"};
  std::vector<std::string> settings;
  Setup setup;
  bool mesh = false;
  std::string splashsurf = "pysplashsurf";  // program
  std::string device, json, pictures;
};

/// One line of the table: the mean over the seeds, or over the scenes.
struct Row {
  std::string series, setting, scene, method;
  bool smooth = false;  // as the scene is
  Figures figures;
  double seconds = 0;
};

/// Applies name=value; the names are those of parameter_list.
void apply(const std::string& setting, Parameters& parameters) {
  const auto equals = setting.find('=');
  const std::string name = setting.substr(0, equals);
  for (const ParameterEntry& entry : parameter_list(parameters)) {
    if (entry.name != name || equals == std::string::npos) continue;
    const char* const end = setting.data() + setting.size();
    const auto read = [&](auto* value) {
      const auto [at, error] = std::from_chars(setting.data() + equals + 1, end, *value);
      return error == std::errc() && at == end;
    };
    if (std::visit(read, entry.value)) return;
    break;
  }
  throw InvalidArgument("--set is " + setting +
                        ", must be name=value with a name from meniscus extract --help");
}

void print_header(const Series& series, const Setting& setting) {
  std::printf("\nseries %s, setting %s: %s\n", series.name.c_str(), setting.name.c_str(),
              series.what.c_str());
  std::printf("%-12s %-14s", "", "");
  for (const FigureField& field : figure_fields())
    std::printf(" %8s", field.name.substr(0, field.name.find('_')).c_str());
  std::printf("\n%-12s %-14s", "scene", "method");
  for (const FigureField& field : figure_fields()) {
    const auto split = field.name.find('_');
    std::printf(" %8s", split == std::string::npos ? "" : field.name.substr(split + 1).c_str());
  }
  std::printf(" %8s\n%-12s %-14s", "time", "", "");
  for (const FigureField& field : figure_fields()) std::printf(" %8s", field.unit.c_str());
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

nlohmann::json to_json(const Row& row) {
  nlohmann::json figures;
  for (const FigureField& field : figure_fields()) {
    const double value = row.figures.*field.value;
    figures[field.name] = std::isnan(value) ? nlohmann::json() : nlohmann::json(value);
  }
  return {{"series", row.series}, {"setting", row.setting}, {"scene", row.scene},
          {"method", row.method}, {"seconds", row.seconds}, {"figures", std::move(figures)}};
}

void write_json(const Options& options, const std::vector<Row>& rows, const std::string& device) {
  nlohmann::json document{{"version", version()},
                          {"device", device},
                          {"noise", options.setup.noise},
                          {"seeds", seeds_named(options.seeds)},
                          {"orthographic", options.setup.orthographic},
                          {"settings", options.settings}};
  for (const Row& row : rows) document["rows"].push_back(to_json(row));
  std::ofstream file(options.json);
  file << document.dump(1) << '\n';
  file.close();
  if (!file) throw OutputError(options.json + ": cannot be written");
}

void write_pictures(const std::string& folder, const Row& row, const Case& scene_case,
                    const Surface& surface) {
  const std::string name = row.scene + "_" + row.method + "_" + std::to_string(scene_case.seed);
  std::string prefix = row.series == "main" ? "" : row.series + "_" + row.setting + "_";
  std::replace(prefix.begin(), prefix.end(), ' ', '_');
  const std::string stem = (std::filesystem::path(folder) / (prefix + name)).string();
  write_png(stem + "_lit.png", surface, Preview::lit);
  write_png(stem + "_normal.png", surface, Preview::normal);
  write_png(stem + "_groups.png", surface, Preview::groups);
  write_error_map(stem + "_error.png", scene_case.truths[0], {surface.depth, surface.normal});
}

/// All rows are of one setting and method.
Row mean_of(const std::vector<Row>& rows, const std::string& scene) {
  Row result{rows[0].series, rows[0].setting, scene, rows[0].method, rows[0].smooth, {}, 0};
  std::vector<Figures> figures;
  for (const Row& row : rows) {
    figures.push_back(row.figures);
    result.seconds += row.seconds / static_cast<double>(rows.size());
  }
  result.figures = mean(figures);
  return result;
}

/// Rows of every scene with every method, then the means over the scenes. Only one scene's cases
/// are in memory at a time.
std::vector<Row> measure_setting(const std::vector<Contender>& contenders, const Options& options,
                                 const Series& series, const Setting& setting) {
  Setup setup = options.setup;
  setting.change(setup);
  print_header(series, setting);
  std::vector<std::vector<Row>> of_method(contenders.size());
  for (const std::string& scene : options.scenes) {
    const std::vector<Case> cases = make_cases({scene}, seeds_named(options.seeds), setup);
    for (std::size_t k = 0; k < contenders.size(); ++k) {
      std::vector<Row> of_seed;
      for (const Case& c : cases) {
        const Measurement m = measure(contenders[k].extract, c);
        of_seed.push_back({series.name, setting.name, scene, contenders[k].name, c.scene->smooth,
                           m.figures, m.seconds});
        if (!options.pictures.empty())
          write_pictures(options.pictures, of_seed.back(), c, m.surface);
      }
      of_method[k].push_back(mean_of(of_seed, scene));
      print(of_method[k].back());
    }
  }

  std::vector<Row> rows;
  for (const std::vector<Row>& all : of_method) {
    rows.insert(rows.end(), all.begin(), all.end());
    std::vector<Row> smooth;
    std::copy_if(all.begin(), all.end(), std::back_inserter(smooth),
                 [](const Row& row) { return row.smooth; });
    rows.push_back(mean_of(all, "mean"));
    print(rows.back());
    if (smooth.empty()) continue;
    rows.push_back(mean_of(smooth, "smooth mean"));
    print(rows.back());
  }
  return rows;
}

std::vector<Contender> contenders_of(const Options& options, Device& device) {
  std::vector<Contender> contenders;
  for (const std::string& name : options.methods) {
    if (name == "splashsurf") {
      contenders.push_back(splashsurf(options.splashsurf));
      continue;
    }
    Parameters parameters;
    parameters.method = method_named(name);
    parameters.mesh = options.mesh;
    parameters.particle_radius = kParticleRadius;
    for (const std::string& setting : options.settings) apply(setting, parameters);
    check(parameters);
    contenders.push_back(library_method(device, parameters));
  }
  return contenders;
}

void run(const Options& options) {
  Device device(options.device);
  const std::vector<Contender> contenders = contenders_of(options, device);
  if (!options.pictures.empty()) std::filesystem::create_directories(options.pictures);

  std::vector<Row> rows;
  for (const Series& series : series_named(options.series))
    for (const Setting& setting : series.settings) {
      const auto of_setting = measure_setting(contenders, options, series, setting);
      rows.insert(rows.end(), of_setting.begin(), of_setting.end());
    }
  if (!options.json.empty()) write_json(options, rows, device.info().name);
}

}  // namespace
}  // namespace meniscus::accuracy

int main(int argc, char** argv) {
  using namespace meniscus;
  accuracy::Options options;
  for (const MethodEntry& entry : method_list()) options.methods.push_back(entry.name);
  for (const accuracy::Scene& scene : accuracy::scenes()) options.scenes.push_back(scene.name);
  CLI::App app{
      "Extracts analytic scenes and prints how far the maps are from the truth. Lengths are in s, "
      "the particle spacing (two particle radii)."};
  app.add_option("--method", options.methods, "Methods; beside the library's also splashsurf")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--scene", options.scenes, "Scenes")->delimiter(',')->capture_default_str();
  app.add_option("--series", options.series,
                 "What is varied: main, noise, lattice, spacing, orthographic, wide, narrow, "
                 "jitter or all of them")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--seeds", options.seeds,
                 "Seeds of the particles and the camera's place; a row is the mean over them. "
                 "tuning (1,2,3), reporting (1001,1002,1003) or numbers: 1 to 99 for choosing "
                 "constants, 1001 and above for reporting")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--noise", options.setup.noise, "Standard deviation of the positions, s")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_flag("--ortho", options.setup.orthographic, "Orthographic cameras");
  app.add_flag("--flicker", options.setup.moving,
               "Move the camera by 0.3 pixels three times and measure the change of the error");
  app.add_flag("--mesh", options.mesh, "Make the meshes, too, and measure their vertices");
  app.add_option("--splashsurf", options.splashsurf, "The program of method splashsurf")
      ->capture_default_str();
  app.add_option("--set", options.settings,
                 "name=value: any length or number of meniscus extract --help");
  app.add_option("--device", options.device, "OpenCL device: index, part of a name, cpu or gpu");
  app.add_option("--json", options.json, "Write the table to this file");
  app.add_option("--pictures", options.pictures,
                 "Write previews and error maps to this folder; an error map is white where right, "
                 "red 0.2 s in front, blue 0.2 s behind, green missing, yellow too much");
  try {
    app.parse(argc, argv);
    accuracy::run(options);
    return 0;
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    return code == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "meniscus-accuracy: error: %s\n", error.what());
    return 1;
  }
}
