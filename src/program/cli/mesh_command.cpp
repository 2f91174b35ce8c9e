#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "base/elapsed.hpp"
#include "device/device.hpp"
#include "io/parts.hpp"
#include "methods/programs.hpp"
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

void mesh_one(const ExtractOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  as_usage([&] { check_outputs({{options.input}, {}}, options.outputs); });
  // Under mpirun all processes do all that follows, and the first one alone writes and speaks.
  Team& team = launched_team();
  if (team.leads()) probe_files(options);
  FrameDevice opened(options, closed_programs, team);
  Working& working = opened.working;

  const Talk say(options.quiet || !team.leads());
  working.phase("reading " + options.input);
  const auto source = open_parts(options.input, reading_of(options), team);
  std::vector<StageTime> stages{{kReading, milliseconds_since(start), 0, {}}};
  working.phase("");
  say_particles(say, options, *source);
  if (team.leads()) say_device(say, options, opened);
  working.phase("meshing " + options.input);
  const Surface surface = naming(options.input, [&] {
    return extract_closed(opened.device, *source, *options.closed, options.parameters, &stages);
  });
  working.built();
  working.phase("");
  const std::vector<RankReport> ranks = reports_of(options, team, opened.device.state(), stages);
  if (!team.leads()) return;
  say_surface(say, options, *source, surface);
  say("found", counts_line(surface.counts));
  say("mesh", counted(surface.mesh.position.size(), "vert",
                      surface.mesh.position.size() == 1 ? "ex" : "ices") +
                  ", " + counted(surface.mesh.triangle.size(), "triangle"));

  write_frame(options, surface, working, say, stages);
  say("total", printed("%.0f ms", milliseconds_since(start)));
  if (options.timings) print_run(stages, surface.counts, opened.device.state(), ranks);
}

int run_mesh(ExtractOptions options, const CLI::App& command) {
  if (options.particle_radius) options.parameters.particle_radius = *options.particle_radius;
  options.parameters.image = false;
  as_usage([&] {
    check(*options.closed);
    check(options.parameters);
    for (const std::string& path : options.outputs)
      if (path != "-" && !is_mesh(path)) {
        refuse_scene(path);
        throw usage_error("output " + path +
                          ": a closed mesh is written as .ply, .vtp, .glb, .obj or .stl "
                          "(meniscus extract makes maps and pictures)");
      }
  });
  use_threads(options.threads);
  options.input = sequence_in_folder(options.input);
  const auto pattern = FramePattern::in(options.input);
  const std::vector<std::string> warnings =
      as_usage([&] { return without_effect(command, options, pattern.has_value()); });
  if (launch().rank == 0)
    for (const std::string& warning : warnings) warn(warning);
  if (pattern) return run_sequence(options, *pattern);
  check_one_frame(options);
  mesh_one(options);
  return 0;
}

}  // namespace

void add_mesh_command(CLI::App& program, int& exit_code) {
  CLI::App& command =
      *program.add_subcommand("mesh", "Make a closed mesh of all of the fluid, without a camera");
  const auto options = std::make_shared<ExtractOptions>();
  add_mesh_options(command, *options);
  command.callback([options, &exit_code, &command] { exit_code = run_mesh(*options, command); });
}

}  // namespace meniscus::cli
