#include "program/cli/one_frame.hpp"

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "base/comma_separated.hpp"
#include "base/edit_distance.hpp"
#include "base/elapsed.hpp"
#include "base/grouped.hpp"
#include "frame/process.hpp"
#include "io/output_file.hpp"
#include "io/parts.hpp"
#include "io/readers.hpp"
#include "program/batch/outputs.hpp"
#include "program/batch/pattern.hpp"
#include "program/cli/extract_warnings.hpp"
#include "program/cli/options.hpp"
#include "program/cli/terminal.hpp"
#include "program/wording.hpp"

namespace meniscus::cli {
namespace {

namespace fs = std::filesystem;

// The file of particles beside a missing one that is probably meant: whose ending was left out, or
// a letter or two of whose name; empty: none.
std::string meant_by(const std::string& missing) {
  constexpr std::size_t kSlips = 2;
  const std::string folder = missing.substr(0, missing.rfind('/') + 1),
                    name = missing.substr(folder.size());
  std::string nearest;
  std::size_t least = std::min(kSlips, name.size() / 3) + 1;
  std::error_code ignored;
  for (fs::directory_iterator entry(folder.empty() ? "." : folder, ignored), end; entry != end;
       entry.increment(ignored)) {
    const std::string other = entry->path().filename().string();
    if (!is_particle_file(other)) continue;
    const std::size_t slips = other.starts_with(name + ".") ? 0 : edit_distance(name, other);
    if (slips > least || (slips == least && (nearest.empty() || nearest < other))) continue;
    least = slips;
    nearest = other;
  }
  return nearest.empty() ? "" : folder + nearest;
}

}  // namespace

FrameDevice::FrameDevice(const ExtractOptions& options, ProgramsOf& programs_of, Team& team)
    : info(select_device(options.device, &why)),
      device(info),
      programs(programs_of(options.parameters, device.state())),
      working(programs.size(), options.quiet || !team.leads()),
      ahead(device, programs) {
  device.state().on_building = [this](int begun) { working.building(begun); };
  if (team.leads())
    device.on_notice([this, input = options.input](const Notice& notice) {
      working.past([&] { warn(input + ": " + words_of(notice)); });
    });
}

void check_one_frame(const ExtractOptions& options) {
  std::error_code ignored;
  if (options.input.find('*') == std::string::npos && !fs::exists(options.input, ignored)) {
    const bool is_glob = options.input.find_first_of("?[{@<") != std::string::npos;
    const std::string meant = is_glob ? "" : meant_by(options.input);
    throw InputError(options.input +
                     (options.input == "-" ? ": standard input is not read, wanted a file or folder"
                                           : ": no such file or folder") +
                     (meant.empty() ? "" : ", did you mean " + meant + "?") +
                     (!is_glob
                          ? ""
                          : " (a sequence is written as dam.####.ply, the parts of one frame as "
                            "dam.rank*.ply)"));
  }
  if (const std::string option = sequence_option(options); !option.empty())
    throw usage_error(option + " is for sequences, but " + options.input +
                      " has no place for the frame's number, e.g. name.####.ply");
  for (const WhitewaterInput& one : options.whitewater)
    if (FramePattern::in(sequence_in_folder(one.path)))
      throw usage_error("--whitewater " + to_string(one.type) + "=" + one.path +
                        " is a sequence, but " + options.input + " is one frame");
  for (const std::string& path : options.outputs)
    if (FramePattern::is_in_name(path))
      throw usage_error(
          "--output " + path + " has a place for the frame's number, but " + options.input +
          " is one frame" +
          (options.input.find('*') == std::string::npos ? "" : " (* stands for its parts)") +
          "; the name of a sequence has a place, too, e.g. name.####.ply");
}

void probe_files(const ExtractOptions& options) {
  for (const std::string& path : options.outputs) OutputFile probe(path);
  for (const std::string& warning : warnings_of_input(options.input)) warn(warning);
}

void say_particles(const Talk& say, const ExtractOptions& options,
                   const ParticleSource& particles) {
  const std::size_t parts = part_files(options.input).size();
  say("particles",
      options.input + ": " + grouped(particles.size()) +
          (parts > 1 ? " in " + std::to_string(parts) + " files, the parts of one frame" : ""));
}

void say_surface(const Talk& say, const ExtractOptions& options, const ParticleSource& particles,
                 const Surface& surface) {
  if (particles.size() > 0) say("radius", radius_line(options, particles, surface.particle_radius));
  if (surface.disorder > 0) say("disorder", disorder_line(options, surface.disorder));
}

void say_device(const Talk& say, const ExtractOptions& options, const FrameDevice& device) {
  const DeviceInfo& info = device.info;
  say("device", info.name + ": " + device.why);
  if (!options.verbose) return;
  say("", info.platform + ", driver " + info.driver + ", " + info.version);
  say("parameters", "");
  print_lines(stderr, describe(options.parameters));
}

void write_frame(const ExtractOptions& options, const Surface& surface, Working& working,
                 const Talk& say, std::vector<StageTime>& stages) {
  const auto start = std::chrono::steady_clock::now();
  working.phase("writing " + comma_separated(options.outputs));
  WriteOptions how = options.writing;
  how.reached = [&](double share) { working.reached(share); };
  write_outputs(options.outputs, surface, options.parameters, how);
  working.phase("");
  stages.push_back({kWriting, milliseconds_since(start), 0, {}});
  for (const std::string& path : options.outputs) say("wrote", path);
}

std::vector<RankReport> reports_of(const ExtractOptions& options, Team& team,
                                   const Device::State& device,
                                   const std::vector<StageTime>& stages) {
  if (!options.timings) return {};
  return team.joined<RankReport>({report_of(stages, team.waited_ms(), device.memory->peak())});
}

void print_run(const std::vector<StageTime>& stages, const Counts& counts,
               const Device::State& device, const std::vector<RankReport>& ranks) {
  print_timings(stages, counts);
  print_memory(device.memory->peak(), peak_memory());
  if (ranks.size() > 1) print_ranks(ranks);
}

}  // namespace meniscus::cli
