// What the commands that make the surface of one frame share: what they refuse, say and write.
#pragma once

#include <string>
#include <vector>

#include "base/team.hpp"
#include "device/building.hpp"
#include "device/device.hpp"
#include "meniscus/extract.hpp"
#include "program/cli/extract_options.hpp"
#include "program/cli/progress.hpp"
#include "program/cli/report.hpp"

namespace meniscus::cli {

/// The device of one frame. While particles are read its programs are built ahead, and a line on
/// the terminal says how far the work is. The first process of the team warns of what is noticed,
/// as soon as it is.
struct FrameDevice {
  using ProgramsOf = std::vector<ProgramName>(const Parameters& params,
                                              const Device::State& device);
  FrameDevice(const FrameDevice&) = delete;  // the callbacks know where it is
  FrameDevice& operator=(const FrameDevice&) = delete;
  FrameDevice(const ExtractOptions& options, ProgramsOf& programs_of, Team& team);

  std::string why;  // it was chosen
  DeviceInfo info;
  Device device;
  std::vector<ProgramName> programs;
  Working working;
  BuildAhead ahead;
};

/// Throws where `options.input`, which is one frame, is not there, or where options or outputs are
/// those of a sequence.
void check_one_frame(const ExtractOptions& options);

/// Throws where an output cannot be made, before there is work to lose; warns of an input that may
/// be another than it was taken for.
void probe_files(const ExtractOptions& options);

/// How many particles there are, and in how many files.
void say_particles(const Talk& say, const ExtractOptions& options, const ParticleSource& particles);

/// The device and why it was chosen; with --verbose more of it, and all parameters.
void say_device(const Talk& say, const ExtractOptions& options, const FrameDevice& device);

/// The radius and how irregularly the particles lay.
void say_surface(const Talk& say, const ExtractOptions& options, const ParticleSource& particles,
                 const Surface& surface);

/// Writes all outputs, and adds a row for it to `stages`.
void write_frame(const ExtractOptions& options, const Surface& surface, Working& working,
                 const Talk& say, std::vector<StageTime>& stages);

/// With --timings what each process of the team took, in the first one; else nothing.
std::vector<RankReport> reports_of(const ExtractOptions& options, Team& team,
                                   const Device::State& device,
                                   const std::vector<StageTime>& stages);

/// What --timings shows: times, counts, memory, and the processes where there are several.
void print_run(const std::vector<StageTime>& stages, const Counts& counts,
               const Device::State& device, const std::vector<RankReport>& ranks);

}  // namespace meniscus::cli
