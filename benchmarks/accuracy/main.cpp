// meniscus-accuracy: extracts analytic scenes and real frames and says how good the maps are.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "accuracy/commands.hpp"

namespace meniscus::accuracy {
namespace {

void add_common(CLI::App& app, CommonOptions& options) {
  app.add_option("--method", options.methods,
                 "Methods; beside the library's also splashsurf. paper-best is paper with the "
                 "settings that a search found; METHOD+name=value+... is one with settings of its "
                 "own")
      ->delimiter(',')
      ->capture_default_str();
  app.add_flag("--mesh", options.mesh, "Make the meshes, too, and measure their vertices");
  app.add_option("--splashsurf", options.splashsurf, "The program of method splashsurf")
      ->capture_default_str();
  app.add_option("--set", options.settings,
                 "name=value: any length or number of meniscus extract --help");
  app.add_option("--device", options.device, "OpenCL device: index, part of a name, cpu or gpu");
  app.add_option("--json", options.json, "Write all figures to this file");
  app.add_option("--html", options.html, "Write a page with tables and pictures to this file");
  app.add_option("--markdown", options.markdown, "Write the tables to this file");
  app.add_option("--pictures", options.pictures,
                 "Write previews and error maps to this folder; an error map is white where right, "
                 "red 0.2 s in front, blue 0.2 s behind, green missing, yellow too much");
}

void add_scenes(CLI::App& app, ScenesOptions& options) {
  app.add_option("--scene", options.scenes,
                 "Names of scenes, calm, held-out, violent, violent-tuning or violent-reporting")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--series", options.series,
                 "What is varied: main, noise, lattice, random, spacing, orthographic, wide, "
                 "narrow, jitter or all of them")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--seeds", options.seeds,
                 "Seeds of the particles and the camera's place; a row is the mean over them. "
                 "tuning (1,2,3), reporting (1001,1002,1003) or numbers: 1 to 99 for choosing "
                 "constants, 1001 and above for reporting")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--noise", options.setup.noise, "Standard deviation of the positions, s")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_flag("--ortho", options.setup.orthographic, "Orthographic cameras");
  app.add_flag("--flicker", options.setup.moving,
               "Move the camera by 0.3 pixels three times and measure the change of the error");
  app.add_flag("--motion", options.setup.flowing,
               "Move the water as a whole three times, bend it three times, and measure the change "
               "of the error along its points");
  app.add_option("--flicker-seeds", options.setup.moving_seeds,
                 "Measure these changes with the first so many seeds (default: all)")
      ->check(CLI::PositiveNumber);
}

void add_real(CLI::App& app, RealOptions& options) {
  app.add_option("INPUT", options.inputs,
                 "Frames of particles, and folders that hold the frames of a sequence")
      ->required();
  app.add_option(
      "--camera", options.camera,
      "JSON file (default: the camera.json beside the frame, else one that shows it all)");
  const auto triple = [&](const char* name, std::vector<double>& value, const char* what) {
    app.add_option(name, value, what)->delimiter(',')->expected(3);
  };
  triple("--eye", options.eye, "X,Y,Z of the camera, world units");
  triple("--target", options.target, "X,Y,Z of what it looks at");
  triple("--up", options.up, "Upward direction");
  app.add_option("--fov", options.fov, "Vertical field of view, degrees")->capture_default_str();
  app.add_option("--width", options.width, "Pixels")->capture_default_str();
  app.add_option("--height", options.height, "Pixels")->capture_default_str();
  app.add_option("--particle-radius", options.particle_radius,
                 "World units (default: what the files state)");
  app.add_option("--reference", options.reference,
                 "Mesh to compare with, a binary PLY, or none (default: splashsurf's)");
}

}  // namespace
}  // namespace meniscus::accuracy

int main(int argc, char** argv) {
  using namespace meniscus;
  accuracy::CommonOptions common;
  accuracy::ScenesOptions scenes;
  accuracy::RealOptions real;
  accuracy::ClosedOptions closed;
  common.methods = accuracy::method_names();
  CLI::App app{
      "Extracts analytic scenes and prints how far the maps are from the truth. Lengths are in s, "
      "the particle spacing (two particle radii)."};
  accuracy::add_common(app, common);
  accuracy::add_scenes(app, scenes);
  app.add_flag_callback(
      "--list-methods",
      [] {
        for (const std::string& name : accuracy::method_names()) std::puts(name.c_str());
        throw CLI::Success();
      },
      "Print the names of the library's methods, with paper-best");
  CLI::App& real_command = *app.add_subcommand(
      "real", "Extracts real frames and compares them with a reference; takes the options above");
  real_command.fallthrough();
  accuracy::add_real(real_command, real);
  CLI::App& closed_command = *app.add_subcommand(
      "closed",
      "Measures closed meshes of the scenes; takes --scene, --seeds, --noise and those of --series "
      "that change particles, too: main, noise, lattice, random");
  closed_command.fallthrough();
  closed_command.add_option("--cell", closed.cells, "Sides of cells, particle radii")
      ->delimiter(',');
  closed_command.add_flag("--beside-splashsurf", closed.splashsurf,
                          "Measure what splashsurf makes of the same particles, too");
  closed_command.add_option("--beside-openvdb", closed.openvdb,
                            "Measure what this program, which benchmarks/peers/openvdb.sh builds, "
                            "makes of them, too");
  closed_command.add_option("--meshes", closed.meshes, "Write the meshes to this folder");
  CLI::App& layers_command = *app.add_subcommand(
      "layers",
      "Measures where rays leave the scenes, and how much of them they cross, away from outlines; "
      "takes --scene, --seeds, --noise, --ortho and --series without jitter, too");
  layers_command.fallthrough();
  try {
    app.parse(argc, argv);
    if (closed_command.parsed())
      accuracy::run_closed_scenes(common, scenes, closed);
    else if (layers_command.parsed())
      accuracy::run_layer_scenes(common, scenes);
    else if (real_command.parsed())
      accuracy::run_real(common, real);
    else
      accuracy::run_scenes(common, scenes);
    return 0;
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    return code == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "meniscus-accuracy: error: %s\n", error.what());
    return 1;
  }
}
