#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/commands.hpp"
#include "cli/options.hpp"
#include "cli/report.hpp"
#include "device/device.hpp"
#include "frame/process.hpp"
#include "io/output_file.hpp"
#include "io/writers.hpp"
#include "meniscus/device.hpp"
#include "meniscus/meniscus.hpp"
#include "parameter_list.hpp"

namespace meniscus::cli {
namespace {

namespace fs = std::filesystem;
using Triple = std::array<double, 3>;

struct ExtractOptions {
  std::string input;
  std::vector<std::string> outputs;
  std::string camera_file;
  std::optional<Triple> eye;
  Triple target{}, up{0, 1, 0};
  double fov = 40;                        // degrees
  std::array<int, 2> size{1024, 768};     // pixels
  std::optional<double> particle_radius;  // world units
  Parameters parameters;
  std::string device;
  Compression compression = Compression::zip;
  Preview preview = Preview::lit;
  int threads = 0;  // 0: all
  std::size_t memory = kStreamMemory;
  bool timings = false, quiet = false, verbose = false;
};

// --- the command line ---------------------------------------------------------------------------

Triple parse_triple(const std::string& name, const std::string& text) {
  Triple triple{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (int k = 0; k < 3; ++k) {
    const auto [next, error] = std::from_chars(at, end, triple[k]);
    const bool last = k == 2;
    if (error != std::errc() || !std::isfinite(triple[k]) ||
        (last ? next != end : next == end || *next != ','))
      throw usage_error(name + " is " + text + ", must be three numbers, e.g. " + name +
                        " 1,2.5,3");
    at = next + 1;
  }
  return triple;
}

template <class T>
using Choices = std::vector<std::pair<std::string, T>>;

/// An option whose value is one of a few words.
template <class T>
void add_choice(CLI::App& command, const std::string& name, T& value, const Choices<T>& choices,
                const std::string& effect) {
  const auto set = [&value, choices, name](const std::string& text) {
    std::string words;
    for (const auto& [word, choice] : choices) {
      if (text == word) {
        value = choice;
        return;
      }
      words += (words.empty() ? "" : ", ") + word;
    }
    if (name == "--compression" && (text == "dwaa" || text == "dwab"))
      throw usage_error("--compression " + text +
                        " is refused: it takes N.Y and P.Y for luminance and damages them; must "
                        "be one of " +
                        words);
    throw usage_error(name + " is " + text + ", must be one of " + words);
  };
  command.add_option_function<std::string>(name, set, effect)->type_name("WORD");
}

/// --footprint and all the others of parameter_list.hpp, under their headings.
void add_parameters(CLI::App& command, Parameters& parameters) {
  for (const ParameterEntry& entry : parameter_list(parameters)) {
    char value[32];
    std::snprintf(value, sizeof value, "%g", entry.get());
    const std::string unit = entry.unit.empty() ? "" : entry.unit + ", ";
    const std::string description = entry.effect + " (" + unit + "default " + value + ")";
    std::visit(
        [&](auto* number) {
          command.add_option("--" + entry.name, *number, description)
              ->type_name(std::is_same_v<decltype(number), int*> ? "COUNT" : "NUMBER")
              ->group(entry.group);
        },
        entry.value);
  }
}

// --- outputs
// --------------------------------------------------------------------------------------

enum class OutputKind { exr, mesh, png };

OutputKind kind_of(const std::string& path) {
  std::string ending = fs::path(path).extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (ending == ".exr") return OutputKind::exr;
  if (ending == ".ply" || ending == ".obj") return OutputKind::mesh;
  if (ending == ".png") return OutputKind::png;
  throw usage_error("output " + path +
                    ": its ending says nothing, must be .exr (maps), .ply or .obj (mesh) or .png "
                    "(picture)");
}

/// Refuses endings that nobody knows, an output that is named twice, and one that is the input.
void check_names(const ExtractOptions& options) {
  const auto same_file = [](const std::string& a, const std::string& b) {
    std::error_code error;
    return fs::weakly_canonical(fs::absolute(a), error) ==
           fs::weakly_canonical(fs::absolute(b), error);
  };
  for (std::size_t i = 0; i < options.outputs.size(); ++i) {
    const std::string& path = options.outputs[i];
    kind_of(path);
    if (same_file(path, options.input))
      throw usage_error("output " + path + ": is the input, give another name");
    for (std::size_t k = 0; k < i; ++k)
      if (same_file(path, options.outputs[k]))
        throw usage_error("output " + path + ": is named twice, give each output its own name");
  }
}

/// All or nothing: no file appears under its name before all are complete.
void write_outputs(const ExtractOptions& options, const Surface& surface) {
  std::vector<std::unique_ptr<OutputFile>> files;
  for (const std::string& path : options.outputs) {
    OutputFile& file = *files.emplace_back(std::make_unique<OutputFile>(path));
    switch (kind_of(path)) {
      case OutputKind::exr:
        write_exr(file, surface, options.parameters, options.compression);
        break;
      case OutputKind::mesh:
        write_mesh(file, surface.mesh);
        break;
      case OutputKind::png:
        write_png(file, surface, options.preview);
        break;
    }
    file.finish();
  }
  for (const auto& file : files) file->publish();
}

// --- the work
// -------------------------------------------------------------------------------------

struct ChosenCamera {
  Camera camera;
  std::string origin;  // in words
};

ChosenCamera choose_camera(const ExtractOptions& options, const ParticleSource& particles) {
  if (!options.camera_file.empty()) {
    const Camera camera = read_camera(options.camera_file);
    try {
      check(camera);
    } catch (const InvalidArgument& error) {
      throw InputError(options.camera_file + ": " + error.what());
    }
    return {camera, options.camera_file};
  }
  const auto [width, height] = options.size;
  if (options.eye) try {
      return {look_at(*options.eye, options.target, options.up, options.fov, width, height),
              "from --eye to --target"};
    } catch (const InvalidArgument& error) {
      throw usage_error(error.what());
    }
  return {frame_particles(particles, width, height), "framed around the particles"};
}

// In the order in which extract() chooses.
std::string radius_line(const ExtractOptions& options, const ParticleSource& particles,
                        double used) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", used);
  const char* origin = options.particle_radius           ? "given"
                       : particles.has_radius()          ? "the middle of the file's radii"
                       : particles.particle_radius() > 0 ? "from the file"
                                                         : "see the warning";
  return std::string(text) + ", " + origin;
}

/// extract(), with the file's name before what it finds wrong with the particles.
Surface extract_from(const ExtractOptions& options, Device& device, const ParticleSource& particles,
                     const Camera& camera, std::vector<StageTime>& stages) {
  try {
    return extract(device, particles, camera, options.parameters, &stages, options.memory);
  } catch (const InputError& error) {
    throw InputError(options.input + ": " + error.what());
  }
}

/// Lines of "what   text" on standard error; silent with -q.
class Talk {
 public:
  explicit Talk(bool quiet) : quiet_(quiet) {}
  void operator()(const char* what, const std::string& text) const {
    if (!quiet_) std::fprintf(stderr, "%-10s %s\n", what, text.c_str());
  }

 private:
  bool quiet_;
};

void run_extract(ExtractOptions options) {
  const auto start = std::chrono::steady_clock::now();
  if (options.particle_radius) options.parameters.particle_radius = *options.particle_radius;
  try {
    check(options.parameters);
  } catch (const InvalidArgument& error) {
    throw usage_error(error.what());
  }
  check_names(options);
  for (const std::string& path : options.outputs) OutputFile probe(path);  // better now than later
  use_threads(options.threads);
  options.parameters.image = options.parameters.mesh = false;
  for (const std::string& path : options.outputs)
    (kind_of(path) == OutputKind::mesh ? options.parameters.mesh : options.parameters.image) = true;

  const Talk say(options.quiet);
  const auto source = open_particles(options.input, options.particle_radius.value_or(0));
  const ParticleSource& particles = *source;
  say("particles", options.input + ": " + grouped(particles.size()));
  const auto [camera, origin] = choose_camera(options, particles);
  say("camera", origin + ", " + std::to_string(camera.width) + "x" + std::to_string(camera.height));
  std::string why;
  const DeviceInfo info = select_device(options.device, &why);
  say("device", info.name + ": " + why);
  if (options.verbose) {
    say("", info.platform + ", driver " + info.driver + ", " + info.version);
    say("parameters", "");
    std::fputs(describe(options.parameters).c_str(), stderr);
  }
  Device device(info);

  std::vector<StageTime> stages;
  const Surface surface = extract_from(options, device, particles, camera, stages);
  for (const std::string& warning : surface.warnings)
    std::fprintf(stderr, "meniscus: warning: %s: %s\n", options.input.c_str(), warning.c_str());
  say("radius", radius_line(options, particles, surface.particle_radius));
  say("method", to_string(options.parameters.method));
  say("found", counts_line(surface.counts));

  write_outputs(options, surface);
  for (const std::string& path : options.outputs) say("wrote", path);
  const std::chrono::duration<double, std::milli> total = std::chrono::steady_clock::now() - start;
  char milliseconds[32];
  std::snprintf(milliseconds, sizeof milliseconds, "%.0f ms", total.count());
  say("total", milliseconds);
  if (options.timings) {
    print_timings(stages, surface.counts);
    print_memory(device.state().memory->peak(), peak_memory());
  }
}

}  // namespace

void add_extract_command(CLI::App& program) {
  CLI::App& command = *program.add_subcommand(
      "extract", "Extract the surface that a camera sees from a frame of particles");
  const auto options = std::make_shared<ExtractOptions>();
  ExtractOptions& o = *options;

  command
      .add_option("INPUT", o.input,
                  "particles: .ply, .vtk (legacy), .bgeo (classic, also .gz), .xyz or .csv")
      ->required()
      ->type_name("FILE");
  command
      .add_option("-o,--output", o.outputs,
                  "what to write, by its ending: .exr (maps), .ply or .obj (mesh), .png "
                  "(picture); give it several times for several files")
      ->required()
      ->allow_extra_args(false)
      ->type_name("FILE");
  command
      .add_option_function<double>(
          "--particle-radius",
          [&o](double radius) {
            if (!(radius > 0) || !std::isfinite(radius))
              throw usage_error("--particle-radius must be a number > 0, in world units");
            o.particle_radius = radius;
          },
          "radius of the particles in world units, half their spacing (default: the file's, "
          "else estimated from the spacing)")
      ->type_name("R");
  Choices<Method> choices;
  std::string explained;
  for (const MethodEntry& entry : method_list()) {
    choices.emplace_back(entry.name, entry.method);
    explained += (explained.empty() ? "" : "; ") + entry.name + ": " + entry.what +
                 (entry.method == o.parameters.method ? " (default)" : "");
  }
  add_choice<Method>(command, "--method", o.parameters.method, choices, explained);
  command
      .add_option("--device", o.device,
                  "OpenCL device: a number, a part of a name, cpu or gpu (default: the fastest "
                  "kind found, see meniscus devices)")
      ->type_name("D");
  command.add_flag("--strict", o.parameters.strict,
                   "NaN and infinite coordinates are an error instead of being dropped");
  add_threads_option(command, o.threads);
  add_memory_option(command, o.memory);
  command.add_flag("--timings", o.timings, "print what each stage took, counts and memory");
  CLI::Option* quiet = command.add_flag("-q,--quiet", o.quiet, "print only warnings and errors");
  command.add_flag("-v,--verbose", o.verbose, "print more")->excludes(quiet);

  const std::string camera = "Camera (default: one that frames the particles)";
  const auto triple = [&command, &camera](const std::string& name, auto set,
                                          const std::string& effect) {
    return command
        .add_option_function<std::string>(
            name, [name, set](const std::string& text) { set(parse_triple(name, text)); }, effect)
        ->type_name("X,Y,Z")
        ->group(camera);
  };
  CLI::Option* file = command.add_option(
      "--camera", o.camera_file,
      "JSON file with width, height, view and projection (4x4, row-major, OpenGL)");
  file->type_name("FILE")->group(camera);
  CLI::Option* eye = triple(
      "--eye", [&o](const Triple& t) { o.eye = t; }, "where the camera is");
  CLI::Option* target = triple(
      "--target", [&o](const Triple& t) { o.target = t; }, "what it looks at");
  CLI::Option* up = triple(
      "--up", [&o](const Triple& t) { o.up = t; }, "what is up (default 0,1,0)");
  CLI::Option* fov = command.add_option("--fov", o.fov, "vertical field of view (default 40)");
  fov->type_name("DEGREES")->group(camera);
  CLI::Option* size = command.add_option_function<std::string>(
      "--size", [&o](const std::string& text) { o.size = parse_size(text); },
      "image size in pixels (default 1024x768)");
  size->type_name("WxH")->group(camera);
  eye->needs(target)->excludes(file);
  for (CLI::Option* option : {target, up, fov}) option->needs(eye);
  size->excludes(file);

  add_choice<Compression>(command, "--compression", o.compression,
                          {{"none", Compression::none},
                           {"rle", Compression::rle},
                           {"zips", Compression::zips},
                           {"zip", Compression::zip},
                           {"piz", Compression::piz},
                           {"pxr24", Compression::pxr24}},
                          "of the EXR: none, rle, zips, zip (default), piz, or pxr24, which rounds "
                          "floats to 24 bits");
  add_choice<Preview>(command, "--preview", o.preview,
                      {{"lit", Preview::lit},
                       {"normal", Preview::normal},
                       {"depth", Preview::depth},
                       {"groups", Preview::groups}},
                      "what the PNG shows: lit (default), normal, depth or groups");
  add_parameters(command, o.parameters);
  command.callback([options] { run_extract(*options); });
}

}  // namespace meniscus::cli
