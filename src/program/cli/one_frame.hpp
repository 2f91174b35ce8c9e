// What the commands that make the surface of one frame share: what they refuse, say and write.
#pragma once

#include <string>
#include <vector>

#include "meniscus/device.hpp"
#include "meniscus/meniscus.hpp"
#include "program/cli/extract_options.hpp"
#include "program/cli/progress.hpp"
#include "program/cli/report.hpp"

namespace meniscus::cli {

void warn(const std::string& what);

/// Throws where `options.input`, which is one frame, is not there, or where options or outputs are
/// those of a sequence.
void check_one_frame(const ExtractOptions& options);

/// How many particles there are, and in how many files.
void say_particles(const Talk& say, const ExtractOptions& options, const ParticleSource& particles);

/// The device and why it was chosen; with --verbose more of it, and all parameters.
void say_device(const Talk& say, const ExtractOptions& options, const DeviceInfo& info,
                const std::string& why);

/// Writes all outputs, and adds a row for it to `stages`.
void write_frame(const ExtractOptions& options, const Surface& surface, Working& working,
                 const Talk& say, std::vector<StageTime>& stages);

}  // namespace meniscus::cli
