// The program's three commands, and what they share.
#pragma once

#include <string>
#include <vector>

#include "accuracy/contenders.hpp"
#include "accuracy/report.hpp"
#include "accuracy/study.hpp"

namespace meniscus::accuracy {

struct CommonOptions {
  std::vector<std::string> methods;
  std::vector<std::string> settings;        // name=value
  bool mesh = false;                        // make the meshes, too
  std::string splashsurf = "pysplashsurf";  // program
  std::string device;
  std::string json, html, markdown, pictures;  // what to write; empty: nothing
};

struct ScenesOptions {
  std::vector<std::string> scenes{"calm"};
  std::vector<std::string> series{"main"};
  std::vector<std::string> seeds{"1"};
  Setup setup;
};

struct RealOptions {
  std::vector<std::string> inputs;                        // frames, or folders that hold a sequence
  std::string camera;                                     // file
  std::vector<double> eye, target{0, 0, 0}, up{0, 1, 0};  // world units; eye empty: none
  double fov = 40;                                        // degrees
  int width = 1024, height = 768;                         // pixels
  double particle_radius = 0;                             // world units; 0: the file's
  std::string reference;                                  // mesh file; empty: splashsurf's
};

struct ClosedOptions {
  std::vector<double> cells{1};  // particle radii
  bool splashsurf = false;       // beside it
  std::string openvdb;           // the program of OpenVDB's mesh, beside it; empty: not
  std::string meshes;            // folder for the meshes; empty: they are not kept
};

/// Measures closed meshes of the analytic scenes: for each setting a row for each scene and seed,
/// then the means (of volumes those of the absolute values; counts are sums).
void run_closed_scenes(const CommonOptions& common, const ScenesOptions& scenes,
                       const ClosedOptions& options);

/// Measures layers along rays: for each setting a row for each scene and seed, then the means
/// (pixels are sums).
void run_layer_scenes(const CommonOptions& common, const ScenesOptions& scenes);

/// Measures the analytic scenes.
void run_scenes(const CommonOptions& common, const ScenesOptions& options);

/// Measures real frames and sequences.
void run_real(const CommonOptions& common, const RealOptions& options);

/// The names of what is measured unless others are asked for: the library's methods, and
/// paper-best, method paper with the settings that a search on the tuning seeds found best
/// (docs/rivals.md).
std::vector<std::string> method_names();

/// The methods in their order. Throws InvalidArgument for an unknown name or setting.
std::vector<Contender> contenders_of(const CommonOptions& options, Device& device);

/// A picture of the surface for people, as PNG.
Bytes picture_of(const Surface& surface, Preview preview);

/// Writes JSON, HTML and Markdown where they are wanted.
void write_results(const CommonOptions& options, const std::string& json, const Report& report);

}  // namespace meniscus::accuracy
