// meniscus-accuracy: extracts the analytic scenes and prints how far the maps are from the truth.
#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "accuracy/error_map.hpp"
#include "accuracy/study.hpp"
#include "meniscus/device.hpp"
#include "parameter_list.hpp"

namespace meniscus::accuracy {
namespace {

struct Options {
  std::vector<std::string> methods;
  std::vector<std::string> scenes;
  std::vector<std::uint64_t> seeds{1};
  std::vector<std::string> settings;
  Setup setup;
  std::string device, json, pictures;
};

/// One line of the table: the mean over the seeds, or over the scenes.
struct Row {
  std::string scene, method;
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

void print_header() {
  std::printf("%-9s %-7s", "", "");
  for (const FigureField& field : figure_fields())
    std::printf(" %8s", field.name.substr(0, field.name.find('_')).c_str());
  std::printf("\n%-9s %-7s", "scene", "method");
  for (const FigureField& field : figure_fields()) {
    const auto split = field.name.find('_');
    std::printf(" %8s", split == std::string::npos ? "" : field.name.substr(split + 1).c_str());
  }
  std::printf(" %8s\n%-9s %-7s", "time", "", "");
  for (const FigureField& field : figure_fields()) std::printf(" %8s", field.unit.c_str());
  std::printf(" %8s\n", "ms");
}

void print(const Row& row) {
  std::printf("%-9s %-7s", row.scene.c_str(), row.method.c_str());
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
  return {{"scene", row.scene},
          {"method", row.method},
          {"seconds", row.seconds},
          {"figures", std::move(figures)}};
}

void write_json(const Options& options, const std::vector<Row>& rows, const std::string& device) {
  nlohmann::json document{{"version", version()},
                          {"device", device},
                          {"noise", options.setup.noise},
                          {"seeds", options.seeds},
                          {"orthographic", options.setup.orthographic},
                          {"settings", options.settings}};
  for (const Row& row : rows) document["rows"].push_back(to_json(row));
  std::ofstream file(options.json);
  file << document.dump(1) << '\n';
  file.close();
  if (!file) throw OutputError(options.json + ": cannot be written");
}

void write_pictures(const std::string& folder, const Case& scene_case, const std::string& method,
                    const Surface& surface) {
  const std::string stem = (std::filesystem::path(folder) / (scene_case.scene->name + "_" + method +
                                                             "_" + std::to_string(scene_case.seed)))
                               .string();
  write_png(stem + "_lit.png", surface, Preview::lit);
  write_png(stem + "_normal.png", surface, Preview::normal);
  write_png(stem + "_groups.png", surface, Preview::groups);
  write_error_map(stem + "_error.png", scene_case.truths[0], {surface.depth, surface.normal});
}

Row mean_of(const std::vector<Row>& rows, std::string scene, std::string method) {
  Row result{std::move(scene), std::move(method), {}, 0};
  std::vector<Figures> figures;
  for (const Row& row : rows) {
    figures.push_back(row.figures);
    result.seconds += row.seconds / static_cast<double>(rows.size());
  }
  result.figures = mean(figures);
  return result;
}

void run(const Options& options) {
  std::vector<Parameters> methods;
  for (const std::string& name : options.methods) {
    Parameters parameters;
    parameters.method = method_named(name);
    parameters.mesh = false;
    for (const std::string& setting : options.settings) apply(setting, parameters);
    check(parameters);
    methods.push_back(parameters);
  }
  Device device(options.device);
  if (!options.pictures.empty()) std::filesystem::create_directories(options.pictures);
  const std::vector<Case> cases = make_cases(options.scenes, options.seeds, options.setup);

  std::vector<Row> rows;
  print_header();
  for (const Parameters& parameters : methods) {
    const std::string method = to_string(parameters.method);
    std::vector<Row> of_method;
    for (auto c = cases.begin(); c != cases.end();) {
      std::vector<Row> of_scene;
      for (const Scene* scene = c->scene; c != cases.end() && c->scene == scene; ++c) {
        const Measurement m = measure(device, *c, parameters);
        of_scene.push_back({scene->name, method, m.figures, m.seconds});
        if (!options.pictures.empty()) write_pictures(options.pictures, *c, method, m.surface);
      }
      of_method.push_back(mean_of(of_scene, of_scene[0].scene, method));
      print(of_method.back());
    }
    rows.insert(rows.end(), of_method.begin(), of_method.end());
    rows.push_back(mean_of(of_method, "mean", method));
    print(rows.back());
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
  app.add_option("--method", options.methods, "Methods")->delimiter(',')->capture_default_str();
  app.add_option("--scene", options.scenes, "Scenes")->delimiter(',')->capture_default_str();
  app.add_option("--seeds", options.seeds, "Seeds of the particles; a row is the mean over them")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--noise", options.setup.noise, "Standard deviation of the positions, s")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_flag("--ortho", options.setup.orthographic, "Orthographic cameras");
  app.add_flag("--flicker", options.setup.moving,
               "Move the camera by 0.3 pixels three times and measure the change of the error");
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
