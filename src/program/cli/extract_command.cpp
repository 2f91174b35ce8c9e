#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "api/extract_sparingly.hpp"
#include "api/parameter_list.hpp"
#include "base/elapsed.hpp"
#include "base/enumerated.hpp"
#include "base/grouped.hpp"
#include "device/device.hpp"
#include "io/parts.hpp"
#include "methods/programs.hpp"
#include "program/batch/camera_track.hpp"
#include "program/batch/room.hpp"
#include "program/cli/commands.hpp"
#include "program/cli/extract_options.hpp"
#include "program/cli/extract_warnings.hpp"
#include "program/cli/one_frame.hpp"
#include "program/cli/options.hpp"
#include "program/cli/report.hpp"
#include "program/cli/sequence.hpp"
#include "program/cli/terminal.hpp"
#include "program/mpi/launch.hpp"

namespace meniscus::cli {
namespace {

// extract(); after the device had no memory, with as little as can be.
Surface extract_from(const ExtractOptions& options, Device& device, const ParticleSource& particles,
                     const Camera& camera, std::vector<StageTime>& stages) {
  return naming(options.input, [&] {
    try {
      return extract(device, particles, camera, options.parameters, &stages, options.memory);
    } catch (const OutOfDeviceMemory& error) {
      if (launched_team().size() > 1) throw;  // the others go on without this process
      return extract_sparingly(device, particles, camera, options.parameters, &stages,
                               options.memory, error);
    }
  });
}

// All files of particles that are read.
std::vector<std::string> inputs_of(const ExtractOptions& options) {
  std::vector<std::string> inputs{options.input};
  for (const WhitewaterInput& one : options.whitewater) inputs.push_back(one.path);
  return inputs;
}

// The one of --camera; none: it is to be aimed at the particles.
std::optional<Camera> given_camera(const ExtractOptions& options, bool warns) {
  check_aim(options);
  if (options.camera_file.empty()) return std::nullopt;
  const Camera camera =
      resized(reading_camera([&] { return read_camera(options.camera_file); }), options.share);
  if (warns)
    for (const std::string& warning : warnings_of(camera, options.camera_file)) warn(warning);
  return camera;
}

void run_frame(const ExtractOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  as_usage([&] {
    check_outputs({inputs_of(options), {options.camera_file}}, options.outputs,
                  {options.written_camera});
  });
  // Under mpirun all processes do all that follows, and the first one alone writes and speaks.
  Team& team = launched_team();
  if (team.leads()) probe_files(options);

  // Camera and device before the particles, which may take long to read.
  const std::optional<Camera> given = given_camera(options, team.leads());
  FrameDevice opened(options, programs_of, team);
  Working& working = opened.working;
  Device& device = opened.device;

  const Talk say(options.quiet || !team.leads());
  working.phase("reading " + options.input);
  const auto source = open_parts(options.input, reading_of(options), team);
  const ParticleSource& particles = *source;
  Whitewater whitewater;
  if (options.parameters.image && team.leads())
    whitewater = Whitewater(options.whitewater, options.parameters.whitewater.radius);
  const double read_ms = milliseconds_since(start);
  working.phase("");
  say_particles(say, options, particles);
  if (options.asks_for_velocity && team.leads() && !particles.has_velocity())
    warn(options.input + ": --aov V: the particles carry no velocities");
  for (const WhitewaterSource& source : whitewater.sources())
    say(to_string(source.type).c_str(), source.name + ": " + grouped(source.particles->size()));
  const auto [camera, origin] =
      given ? ChosenCamera{*given, options.camera_file} : aimed_camera(options, {&particles});
  say("camera", origin + ", " + std::to_string(camera.width) + "x" + std::to_string(camera.height));
  if (team.size() == 1)
    require_room_for_frame(static_cast<std::size_t>(camera.width) *
                           static_cast<std::size_t>(camera.height));
  if (team.leads()) keep_camera(options, camera);
  if (team.leads()) say_device(say, options, opened);

  std::vector<StageTime> stages{{kReading, read_ms, 0, {}}};
  working.phase("extracting " + options.input);
  Surface surface = extract_from(options, device, particles, camera, stages);
  if (!whitewater.empty())
    draw_whitewater(device, whitewater.sources(), options.parameters, surface, &stages,
                    options.memory);
  working.built();
  working.phase("");
  const std::vector<RankReport> ranks = reports_of(options, team, device.state(), stages);
  if (!team.leads()) return;
  if (!surface.velocity.empty())
    surface.forward = screen_motion(surface, camera, options.frames_per_second);
  say_surface(say, options, particles, surface);
  say("method", to_string(options.parameters.method));
  say("found", counts_line(surface.counts));

  write_frame(options, surface, working, say, stages);
  if (!options.written_camera.empty()) say("wrote", options.written_camera);
  say("total", printed("%.0f ms", milliseconds_since(start)));
  if (options.timings) print_run(stages, surface.counts, device.state(), ranks);
}

int run_extract(ExtractOptions options, const CLI::App& command) {
  if (options.particle_radius) options.parameters.particle_radius = *options.particle_radius;
  options.parameters.image = options.parameters.mesh = false;
  bool maps = false;  // are written
  as_usage([&] {
    check(options.parameters);
    int layers = 0;       // that the outputs want
    std::string layered;  // the one that wants them
    for (const std::string& path : options.outputs) {
      const OutputKind kind = kind_of(path);
      const bool glass = kind == OutputKind::png && options.writing.preview == Preview::glass;
      if (kind == OutputKind::deep) layers = kMostLayers;
      if (glass) layers = std::max(layers, 1);
      if (kind == OutputKind::deep || glass) layered = glass ? "--preview glass" : path;
      (kind == OutputKind::mesh ? options.parameters.mesh : options.parameters.image) = true;
      maps |= kind == OutputKind::exr;
      if (kind != OutputKind::png) continue;
      Aovs& aovs = options.parameters.aovs;
      aovs.normal = true;
      if (options.writing.preview == Preview::groups) aovs.group = aovs.kind = true;
    }
    if (options.parameters.layers == 0 || (!maps && layers == 0))
      options.parameters.layers = layers;
    options.asks_for_velocity = options.asks_for_velocity && maps;
    const Method method = options.parameters.method;
    if (!layered.empty() && !has_layers(method))
      throw usage_error(layered + " needs layers, which method " + to_string(method) +
                        " has not: use --method " + enumerated(methods_with_layers(), "or"));
    check(options.parameters);  // the method may have the front alone
  });
  use_threads(options.threads);
  options.input = sequence_in_folder(options.input);
  const bool is_sequence = FramePattern::in(options.input).has_value();
  if (launch().rank == 0)
    for (const std::string& warning : without_effect(command, options, is_sequence)) warn(warning);
  if (const auto pattern = FramePattern::in(options.input)) return run_sequence(options, *pattern);
  check_one_frame(options);
  // A picture alone needs no more maps than it shows. (Those of a sequence have figures in its
  // log.)
  Aovs& aovs = options.parameters.aovs;
  if (!maps && !options.parameters.mesh) {
    const bool groups = options.writing.preview == Preview::groups;
    aovs = {
        .position = false, .group = groups, .kind = groups, .residual = false, .velocity = false};
  }
  run_frame(options);
  return 0;
}

}  // namespace

void add_extract_command(CLI::App& program, int& exit_code) {
  CLI::App& command = *program.add_subcommand(
      "extract", "Extract the surface that a camera sees, from a frame or a sequence");
  const auto options = std::make_shared<ExtractOptions>();
  add_extract_options(command, *options);
  command.callback([options, &exit_code, &command] { exit_code = run_extract(*options, command); });
}

}  // namespace meniscus::cli
