// The program's subcommands.
#pragma once

#include <CLI/CLI.hpp>

namespace meniscus::cli {

/// Adds `extract`: particles in, surface out. Errors leave CLI11's parse() as exceptions:
/// CLI::ParseError for bad usage, meniscus::Error for the rest. A sequence that did not come to its
/// end as a whole sets the exit code (sequence.hpp).
void add_extract_command(CLI::App& program, int& exit_code);

/// Adds `mesh`: particles in, all of their surface out, closed. As `extract` else.
void add_mesh_command(CLI::App& program, int& exit_code);

/// Adds `devices`: what OpenCL devices there are, and which one is the default and why.
void add_devices_command(CLI::App& program);

/// Adds `generate`: writes a breaking dam of any number of particles.
void add_generate_command(CLI::App& program);

/// Adds `tune`: how a device's kernels are launched fastest.
void add_tune_command(CLI::App& program);

/// Adds `report`: the logs of a batch as one page.
void add_report_command(CLI::App& program);

/// Adds `bench`: how fast each kernel is, and how near to what the device can do. Sets the exit
/// code.
void add_bench_command(CLI::App& program, int& exit_code);

/// Adds `frame` to `bench`: whole frames of all methods.
void add_bench_frame_command(CLI::App& bench);

/// Adds `verify`: whether devices compute what they should. Sets the exit code.
void add_verify_command(CLI::App& program, int& exit_code);

}  // namespace meniscus::cli
