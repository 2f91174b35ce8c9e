// What `extract` and `mesh` are asked to do.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "meniscus/closed.hpp"
#include "meniscus/extract.hpp"
#include "program/batch/outputs.hpp"
#include "program/batch/whitewater.hpp"

namespace meniscus::cli {

struct ExtractOptions {
  using Triple = std::array<double, 3>;

  std::string input;
  std::vector<std::string> outputs;
  std::string camera_file, written_camera;
  std::optional<Triple> eye;
  Triple target{}, up{0, 1, 0};
  double fov = 40;                         // degrees
  std::optional<std::array<int, 2>> size;  // pixels
  double share = 1;                       // of the size that is given there or by the camera's file
  std::optional<double> particle_radius;  // world units
  ReadOptions reading;                    // of the input, but for the radius
  double frames_per_second = 24;
  Parameters parameters;
  bool asks_for_velocity = false;  // by --aov
  std::vector<WhitewaterInput> whitewater;
  std::optional<ClosedParams> closed;  // of `mesh`; else a camera's surface is wanted
  std::string device;
  WriteOptions writing;
  int threads = 0;  // 0: all
  std::size_t memory = kStreamMemory;
  bool timings = false, quiet = false, verbose = false;

  // Of sequences.
  std::string frames;  // empty: all
  std::string shard;   // empty: by the environment
  bool skip_missing = false, resume = false, fail_fast = false;
  int in_flight = 2;  // frames on each device at once
  std::string log, report;
};

/// How the input is read, with the radius.
ReadOptions reading_of(const ExtractOptions& options);

struct ChosenCamera {
  Camera camera;
  std::string origin;  // in words
};

/// The one of --eye, else one that frames the particles of all sources. --camera is not looked at.
ChosenCamera aimed_camera(const ExtractOptions& options,
                          const std::vector<const ParticleSource*>& particles);

/// Throws usage_error where --eye, --up, --fov or --size are of no camera, or --size is another one
/// than that of --camera, before anything is read.
void check_aim(const ExtractOptions& options);

/// Writes the camera as the JSON that --camera takes, where --write-camera names a file.
void keep_camera(const ExtractOptions& options, const Camera& camera);

/// The first option that is set though it has a meaning for sequences alone, else empty.
std::string sequence_option(const ExtractOptions& options);

/// Adds all options of `extract`; they are parsed into `options`.
void add_extract_options(CLI::App& command, ExtractOptions& options);

/// Adds all options of `mesh`; they are parsed into `options`, whose `closed` is set.
void add_mesh_options(CLI::App& command, ExtractOptions& options);

/// Adds the numbers of --adaptive that were left out to what was typed behind `meniscus mesh`;
/// CLI11 would take INPUT for them.
void fill_in_numbers(std::vector<std::string>& typed);

/// The radius that was used and where it is from, in the order in which extract() chooses.
std::string radius_line(const ExtractOptions& options, const ParticleSource& particles,
                        double used);

/// How irregularly particles lay, where that is above 0, and who said so.
std::string disorder_line(const ExtractOptions& options, double used);

}  // namespace meniscus::cli
