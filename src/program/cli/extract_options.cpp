#include "program/cli/extract_options.hpp"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <functional>
#include <utility>

#include "api/framing.hpp"
#include "api/parameter_list.hpp"
#include "base/comma_separated.hpp"
#include "base/printed.hpp"
#include "io/output_file.hpp"
#include "program/batch/camera_track.hpp"
#include "program/cli/options.hpp"

namespace meniscus::cli {
namespace {

using Triple = ExtractOptions::Triple;

// Three numbers; of --up also the name of an axis, as in many programs.
Triple parse_triple(const std::string& name, const std::string& text) {
  Triple triple{};
  const bool names_axis = name == "--up";
  if (const std::size_t axis = std::string("xyzXYZ").find(text);
      names_axis && text.size() == 1 && axis != std::string::npos) {
    triple[axis % 3] = 1;
    return triple;
  }
  const char* at = text.data();
  const char* const end = at + text.size();
  for (int k = 0; k < 3; ++k) {
    const auto [next, error] = std::from_chars(at, end, triple[k]);
    const bool last = k == 2;
    if (error != std::errc() || !std::isfinite(triple[k]) ||
        (last ? next != end : next == end || *next != ','))
      throw usage_error(name + " is " + text + ", must be " + (names_axis ? "x, y, z or " : "") +
                        "three numbers, e.g. " + name + (names_axis ? " 0,0,1" : " 1,2.5,3"));
    at = next + 1;
  }
  return triple;
}

template <class T>
using Choices = std::vector<std::pair<std::string, T>>;

/// An option whose value is one of a few words.
template <class T>
CLI::Option* add_choice(CLI::App& command, const std::string& name, T& value,
                        const Choices<T>& choices, const std::string& effect) {
  const auto set = [&value, choices, name](const std::string& text) {
    for (const auto& [word, choice] : choices)
      if (text == word) {
        value = choice;
        return;
      }
    const std::string words =
        comma_separated(choices, [](const auto& entry) { return entry.first; });
    if (name == "--compression" && (text == "dwaa" || text == "dwab"))
      throw usage_error("--compression " + text +
                        " is refused: it takes N.Y and P.Y for luminance and damages them; must "
                        "be one of " +
                        words);
    throw usage_error(name + " is " + text + ", must be one of " + words);
  };
  return command.add_option_function<std::string>(name, set, effect)->type_name("WORD");
}

/// --footprint and all the others of parameter_list.hpp that are wanted, under their headings.
void add_parameters(CLI::App& command, Parameters& parameters,
                    const std::function<bool(const std::string& name)>& wanted) {
  for (const ParameterEntry& entry : parameter_list(parameters)) {
    if (!wanted(entry.name)) continue;
    char value[32];
    std::snprintf(value, sizeof value, "%g", entry.get());
    const std::string unit = entry.unit.empty() ? "" : entry.unit + ", ";
    const std::string description = entry.description() + " (" + unit + "default " + value + ")";
    std::visit(
        [&](auto* number) {
          command.add_option("--" + entry.name, *number, description)
              ->type_name(std::is_same_v<decltype(number), int*> ? "COUNT" : "NUMBER")
              ->group(entry.group);
        },
        entry.value);
  }
}

void add_input_option(CLI::App& command, ExtractOptions& o) {
  command
      .add_option("INPUT", o.input,
                  "particles: .ply, .vtk (legacy), .vtp, .vtu, .npy, .npz, .h5, .bgeo (classic, "
                  "also .gz, and .sc), .bi4, .ffp3, .lammpstrj, .dump, "
#ifdef MENISCUS_OPENVDB
                  ".vdb, "
#endif
                  ".xyz or .csv; a name "
                  "with a place for the frame's number is a sequence: dam.####.ply, dam.%04d.ply, "
                  "dam.$F4.ply or dam.{}.ply, and so are a folder and a .pvd; * stands for the "
                  "parts of one frame: dam.rank*.ply")
      ->required()
      ->type_name("FILE");
}

/// --particle-radius and what else a file is read by.
void add_source_options(CLI::App& command, ExtractOptions& o) {
  add_positive_option(
      command, "-r,--particle-radius", "world units",
      [&o](double radius) { o.particle_radius = radius; },
      "radius of the particles in world units, half their spacing (default: the file's, "
      "else estimated from the spacing)")
      ->type_name("R");
  command
      .add_option("--attribute", o.reading.attributes,
                  "an array of the particles, by its name in the file, that is carried to the EXR "
                  "and to the mesh, weighed as velocities are; give it several times for several")
      ->allow_extra_args(false)
      ->type_name("NAME");
  command
      .add_option("--dataset", o.reading.dataset,
                  "where a file holds several: the group or dataset of an HDF5 file, the array of "
                  "positions of an .npz")
      ->type_name("NAME");
  command
      .add_option("--timestep", o.reading.timestep,
                  "which timestep of a LAMMPS dump that holds several")
      ->check(from_to(0.0, 9e18))
      ->type_name("N");
}

void add_device_options(CLI::App& command, ExtractOptions& o) {
  add_device_option(
      command, o.device,
      " (default: the fastest kind found, see meniscus devices); for sequences also all");
  command.add_flag("--strict", o.parameters.strict,
                   std::string("NaN and infinite coordinates and velocities") +
                       (o.closed ? ", and particles that lie farther out than cells reach," : "") +
                       " are an error instead of being dropped");
}

void add_no_motion_option(CLI::App& command, ExtractOptions& o) {
  command.add_flag_callback(
      "--no-motion", [&o] { o.parameters.motion = false; },
      "leave the particles' velocities alone: no V, no forward, no vx vy vz in the outputs");
}

void add_talk_options(CLI::App& command, ExtractOptions& o) {
  command.add_flag("--timings", o.timings,
                   "print what reading, building kernels, each stage and writing took, counts and "
                   "memory; of a sequence, add the stages to --log and --report");
  CLI::Option* quiet = command.add_flag("-q,--quiet", o.quiet, "print only warnings and errors");
  command.add_flag("-v,--verbose", o.verbose, "print the driver and every parameter, too")
      ->excludes(quiet);
}

void add_sequence_options(CLI::App& command, ExtractOptions& o) {
  const std::string sequence = "Sequences";
  command
      .add_option("--frames", o.frames,
                  "which frames: 1-240, 1-240x2, 1,5,10-20, 10-1x-3 (default: all there are)")
      ->type_name("LIST")
      ->check([](const std::string& text) {
        return text.empty() ? "is empty, must name frames, e.g. 1-240" : std::string();
      })
      ->group(sequence);
  add_choice<bool>(
      command, "--missing", o.skip_missing, {{"fail", false}, {"skip", true}},
      "what to do when frames of --frames, or their cameras, are missing: fail (default) or "
      "skip")
      ->group(sequence);
  command
      .add_option("--shard", o.shard,
                  "do only part k of N of the frames; 1/1: all; slurm: the part of this task of a "
                  "Slurm array (default in such a task, but with --frames say 1/1 or slurm)")
      ->type_name("k/N")
      ->group(sequence);
  command
      .add_flag("--resume", o.resume,
                "skip frames whose outputs are whole and come from the same program, parameters, "
                "camera and inputs")
      ->group(sequence);
  command.add_flag("--fail-fast", o.fail_fast, "stop at the first frame that fails")
      ->group(sequence);
  command
      .add_option("--in-flight", o.in_flight,
                  "frames that are extracted at the same time on each device (default 2)")
      ->check(from_to(1, 64))
      ->type_name("N")
      ->group(sequence);
  command.add_option("--log", o.log, "a file of JSON lines, one a frame; --resume goes on with it")
      ->type_name("FILE")
      ->group(sequence);
  command
      .add_option("--report", o.report,
                  "a page (.html) about the frames, with pictures and plots (see meniscus report)")
      ->type_name("FILE")
      ->group(sequence);
}

void add_method_option(CLI::App& command, ExtractOptions& o) {
  Choices<Method> choices;
  std::string explained;
  for (const MethodEntry& entry : method_list()) {
    choices.emplace_back(entry.name, entry.method);
    explained += (explained.empty() ? "" : "; ") + entry.name + ": " + entry.what +
                 (entry.method == o.parameters.method ? " (default)" : "");
  }
  add_choice<Method>(command, "--method", o.parameters.method, choices, explained);
}

/// Which maps there are, and what is drawn into them.
void add_map_options(CLI::App& command, ExtractOptions& o) {
  command
      .add_option_function<std::string>(
          "--aov",
          [&o](const std::string& list) {
            o.parameters.aovs = as_usage([&] { return aovs_named(list); });
            o.asks_for_velocity = o.parameters.aovs.velocity;
          },
          "maps of the EXR beside Z and A, a list of N, P, id, kind, residual and V, which "
          "forward comes with (default: all); what a PNG shows is made, too")
      ->type_name("LIST");
  command
      .add_option("--layers", o.parameters.layers,
                  "bodies of fluid along each pixel's ray: adds Z.back, N.back, thickness and "
                  "layers to the EXR; up to this many, 1 to 8, are kept in a .deep.exr (default 8)")
      ->check(from_to(1, kMostLayers))
      ->type_name("K");
  command
      .add_option_function<std::vector<std::string>>(
          "--whitewater",
          [&o](const std::vector<std::string>& texts) {
            o.whitewater = as_usage([&] { return parse_whitewater(texts); });
          },
          "particles of foam, spray and bubbles that are drawn with the water: foam=FILE, "
          "spray=FILE, bubble=FILE, all behind one --whitewater or each behind its own; of one "
          "file for all foam=FILE@type=1 takes those whose attribute type is 1")
      ->expected(1, 3)
      ->type_name("TYPE=FILE");
}

void add_camera_options(CLI::App& command, ExtractOptions& o) {
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
      "JSON file with width, height, view and projection (4x4, row-major, OpenGL); of a sequence "
      "also a file for each frame (camera.####.json), or a list of such objects with their "
      "\"frame\"");
  file->type_name("FILE")->group(camera);
  CLI::Option* eye = triple(
      "--eye", [&o](const Triple& t) { o.eye = t; }, "where the camera is");
  CLI::Option* target = triple(
      "--target", [&o](const Triple& t) { o.target = t; }, "what it looks at");
  CLI::Option* up = triple(
      "--up", [&o](const Triple& t) { o.up = t; },
      "what is up: x, y or z, or a direction (default y)");
  CLI::Option* fov = command.add_option("--fov", o.fov, "vertical field of view (default 40)");
  fov->type_name("DEGREES")->group(camera);
  CLI::Option* size = command.add_option_function<std::string>(
      "--size",
      [&o](const std::string& text) {
        if (text.ends_with('%'))
          o.share = parse_share(text);
        else
          o.size = parse_size(text);
      },
      "image size in pixels (default 1024x768), or 50% of the camera's");
  size->type_name("WxH")->group(camera);
  eye->needs(target)->excludes(file);
  target->needs(eye);
  for (CLI::Option* option : {up, fov}) option->excludes(file);
  command
      .add_option("--write-camera", o.written_camera,
                  "a file for the camera that was chosen, to be given by --camera")
      ->type_name("FILE")
      ->group(camera)
      ->excludes(file);
}

void add_writing_options(CLI::App& command, ExtractOptions& o) {
  add_choice<Compression>(command, "--compression", o.writing.compression,
                          {{"none", Compression::none},
                           {"rle", Compression::rle},
                           {"zips", Compression::zips},
                           {"zip", Compression::zip},
                           {"piz", Compression::piz},
                           {"pxr24", Compression::pxr24}},
                          "of the EXR: none, rle, zips, zip (default), piz, or pxr24, which rounds "
                          "floats to 24 bits");
  command.add_flag("--half", o.writing.half,
                   "N, residual, V and forward of the EXR as 16-bit floats: half the file; Z and P "
                   "keep 32 bits");
  add_choice<Preview>(command, "--preview", o.writing.preview,
                      {{"lit", Preview::lit},
                       {"normal", Preview::normal},
                       {"depth", Preview::depth},
                       {"groups", Preview::groups},
                       {"glass", Preview::glass}},
                      "what the PNG shows: lit (default), normal, depth, groups or glass (what "
                      "lies behind, refracted twice)");
}

}  // namespace

ReadOptions reading_of(const ExtractOptions& options) {
  ReadOptions reading = options.reading;
  reading.particle_radius = options.particle_radius.value_or(0);
  return reading;
}

ChosenCamera aimed_camera(const ExtractOptions& options,
                          const std::vector<const ParticleSource*>& particles) {
  constexpr std::array kUsual{1024, 768};
  Camera of_size;
  const std::array sides = options.size.value_or(kUsual);
  of_size.width = sides[0];
  of_size.height = sides[1];
  of_size = resized(of_size, options.share);
  return as_usage([&, w = of_size.width, h = of_size.height]() -> ChosenCamera {
    if (options.eye)
      return {look_at(*options.eye, options.target, options.up, options.fov, w, h),
              "from --eye to --target"};
    return {frame_sources(particles, {options.up, options.fov, w, h}),
            "framed around the particles"};
  });
}

void check_aim(const ExtractOptions& options) {
  if (options.camera_file.empty()) return check(aimed_camera(options, {}).camera);
  if (options.size)
    throw usage_error(
        "--camera and --size are both given, must be one of them (the camera's file has the size; "
        "--size 50% takes a share of it)");
}

void keep_camera(const ExtractOptions& options, const Camera& camera) {
  if (options.written_camera.empty()) return;
  const auto matrix = [](const std::array<double, 16>& values) {
    std::string rows;
    for (std::size_t k = 0; k < values.size(); ++k)
      rows += printed(k == 0 ? "[[%.17g" : k % 4 == 0 ? "],\n    [%.17g" : ", %.17g", values[k]);
    return rows + "]]";
  };
  OutputFile file(options.written_camera);
  file.write(printed("{\"width\": %d, \"height\": %d,\n", camera.width, camera.height) +
             " \"view\": " + matrix(camera.view) +
             ",\n \"projection\": " + matrix(camera.projection) + "}\n");
  file.commit();
}

std::string sequence_option(const ExtractOptions& options) {
  return !options.frames.empty()   ? "--frames"
         : !options.shard.empty()  ? "--shard"
         : options.skip_missing    ? "--missing"
         : options.resume          ? "--resume"
         : options.fail_fast       ? "--fail-fast"
         : !options.log.empty()    ? "--log"
         : !options.report.empty() ? "--report"
         : options.device == "all" ? "--device all"
                                   : "";
}

void add_extract_options(CLI::App& command, ExtractOptions& o) {
  command.set_help_all_flag("--help-all", "print this help with all options");
  add_input_option(command, o);
  command
      .add_option("-o,--output", o.outputs,
                  "what to write, by its ending: .exr (maps), .deep.exr (layers), .ply, .vtp, "
                  ".glb, .obj or .stl "
                  "(mesh), .png (picture); give it several times for several files; of a sequence "
                  "with a place "
                  "for the number, e.g. -o out.####.exr")
      ->required()
      ->allow_extra_args(false)
      ->type_name("FILE");
  add_source_options(command, o);
  add_method_option(command, o);
  add_device_options(command, o);
  add_positive_option(
      command, "--fps", "frames per second", [&o](double rate) { o.frames_per_second = rate; },
      "frames per second of the simulation's files, for motion on the screen (default 24)")
      ->type_name("RATE");
  add_map_options(command, o);
  add_no_motion_option(command, o);
  add_threads_option(command, o.threads);
  add_memory_option(command, o.memory);
  add_talk_options(command, o);
  add_sequence_options(command, o);

  add_camera_options(command, o);
  add_writing_options(command, o);
  add_parameters(command, o.parameters, [](const std::string&) { return true; });
}

void add_mesh_options(CLI::App& command, ExtractOptions& o) {
  ClosedParams& closed = o.closed.emplace();
  add_input_option(command, o);
  command
      .add_option("-o,--output", o.outputs,
                  "what to write, by its ending: .ply, .vtp, .glb, .obj or .stl; give it several "
                  "times for several files; of a sequence with a place for the number, e.g. "
                  "-o out.####.ply")
      ->required()
      ->allow_extra_args(false)
      ->type_name("FILE");
  command
      .add_option(
          "--cell", closed.cell,
          printed("side of the cells that the mesh is made of, particle radii (default %g): "
                  "half of it makes four times as many triangles",
                  closed.cell))
      ->type_name("NUMBER");
  command
      .add_option("--adaptive", closed.adaptive,
                  printed("fewer triangles where the mesh is flat; the number, which may be left "
                          "out, is how far vertices of the full mesh may be from it, particle "
                          "radii, up to 1 (%g where it is left out; without the option 0, the "
                          "full mesh)",
                          kAdaptive))
      ->type_name("[NUMBER]");
  add_memory_option(command, closed.memory,
                    "memory that a frame may take beside its mesh, about; more is made in parts");
  add_source_options(command, o);
  add_device_options(command, o);
  add_no_motion_option(command, o);
  add_threads_option(command, o.threads);
  add_talk_options(command, o);
  add_parameters(command, o.parameters, [](const std::string& name) { return name == "disorder"; });
  add_sequence_options(command, o);
}

void fill_in_numbers(std::vector<std::string>& typed) {
  for (std::size_t k = 0; k < typed.size() && typed[k] != "--"; ++k) {
    if (typed[k] != "--adaptive") continue;
    double number = 0;
    const std::string next = k + 1 < typed.size() ? typed[k + 1] : "";
    const auto [end, error] = std::from_chars(next.data(), next.data() + next.size(), number);
    if (next.empty() || error != std::errc{} || end != next.data() + next.size())
      typed.insert(typed.begin() + static_cast<std::ptrdiff_t>(k) + 1, printed("%g", kAdaptive));
  }
}

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

std::string disorder_line(const ExtractOptions& options, double used) {
  const char* origin = options.parameters.disorder < 0 ? "found" : "given";
  return printed("%.2f of 2, %s: particles are evened out", used, origin);
}

}  // namespace meniscus::cli
