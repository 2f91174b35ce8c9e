#include "program/cli/extract_warnings.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "api/parameter_list.hpp"
#include "base/printed.hpp"
#include "io/input_file.hpp"
#include "io/parts.hpp"
#include "io/rows.hpp"
#include "meniscus/camera.hpp"
#include "program/batch/outputs.hpp"

namespace meniscus::cli {
namespace {

// `methods` as in "fit, groups and stable".
bool is_of(std::string methods, const std::string& method) {
  std::replace(methods.begin(), methods.end(), ',', ' ');
  return (" " + methods + " ").find(" " + method + " ") != std::string::npos;
}

bool ends_in(const std::string& path, std::initializer_list<const char*> endings) {
  const std::string name = lower_case(path);
  return std::any_of(endings.begin(), endings.end(),
                     [&](const char* ending) { return name.ends_with(ending); });
}

bool is_one(const std::string& methods) { return methods.find(' ') == std::string::npos; }

}  // namespace

bool has_carried_values(const std::vector<std::string>& outputs) {
  return std::any_of(outputs.begin(), outputs.end(), [](const std::string& path) {
    return ends_in(path, {".exr", ".ply", ".vtp", ".glb"}) && kind_of(path) != OutputKind::deep;
  });
}

std::vector<std::string> without_effect(const CLI::App& command, const ExtractOptions& options,
                                        bool is_sequence) {
  bool exr = false, deep = false, mesh = false, png = false;
  for (const std::string& path : options.outputs) {
    const OutputKind kind = kind_of(path);
    exr |= kind == OutputKind::exr;
    deep |= kind == OutputKind::deep;
    mesh |= kind == OutputKind::mesh;
    png |= kind == OutputKind::png;
  }
  std::vector<std::string> warnings;
  const auto tell = [&](const std::string& name, bool has_effect, const std::string& why) {
    const CLI::Option* const option = command.get_option_no_throw("--" + name);
    if (option && option->count() > 0 && !has_effect)
      warnings.push_back("--" + name + " has no effect: " + why);
  };
  for (const char* name : {"half", "compression", "aov", "fps"})
    tell(name, exr, "no output is an .exr");
  tell("layers", exr || deep || (png && options.writing.preview == Preview::glass),
       "no output is an .exr, a .deep.exr or a .png of --preview glass");
  tell("preview", png, "no output is a .png");
  tell("whitewater", exr || png, "no output is an .exr or a .png");
  for (const char* name : {"whitewater-radius", "whitewater-tolerance"})
    tell(name, !options.whitewater.empty(), "no --whitewater is given");
  tell("attribute", has_carried_values(options.outputs),
       "no output is an .exr, .ply, .vtp or .glb");
  tell("dataset", ends_in(options.input, {".h5", ".hdf5", ".npy", ".npz", ".vdb"}),
       "the input is no HDF5 file, .npy, .npz or .vdb");
  tell("timestep", ends_in(options.input, {".lammpstrj", ".dump"}), "the input is no LAMMPS dump");
  tell("in-flight", is_sequence, "the input is one frame");
  Parameters parameters = options.parameters;
  const std::string method = to_string(parameters.method);
  for (const ParameterEntry& entry : parameter_list(parameters)) {
    tell(entry.name, entry.methods.empty() || is_of(entry.methods, method),
         "it is of method" + std::string(is_one(entry.methods) ? " " : "s ") + entry.methods +
             ", and this is " + method);
    tell(entry.name, mesh || !entry.group.starts_with("Mesh"), "no output is a mesh");
  }
  return warnings;
}

std::vector<std::string> warnings_of(const Camera& camera, const std::string& origin) {
  std::vector<std::string> warnings;
  const auto& p = camera.projection;
  if (pixel_aspect_ratio(camera) != 1)
    warnings.push_back(
        printed("%s: the projection is of an image %.3g times as wide as high, but width and "
                "height are %d and %d: pixels are not square",
                origin.c_str(), std::hypot(p[4], p[5]) / std::hypot(p[0], p[1]), camera.width,
                camera.height));
  if (p[0] * p[5] - p[1] * p[4] < 0)
    warnings.push_back(origin + ": the projection mirrors the image" +
                       (p[5] < 0
                            ? ": it is upside down (a projection for Vulkan? negate its second row)"
                            : " (negate the first row of the projection if it should not)"));
  return warnings;
}

std::vector<std::string> warnings_of_input(const std::string& input) {
  if (has_faces(input))
    return {input + ": has faces: a mesh, not particles; its vertices are taken for particles"};
  const std::size_t star = input.find('*');
  if (star == std::string::npos || input.find('*', star + 1) != std::string::npos) return {};
  const std::vector<std::string> parts = part_files(input);
  const std::size_t around = input.size() - 1;
  std::size_t least = std::string::npos, most = 0;
  for (const std::string& part : parts) {
    if (part.size() <= around || !part.starts_with(input.substr(0, star))) return {};
    const std::string number = part.substr(star, part.size() - around);
    if (!std::all_of(number.begin(), number.end(),
                     [](unsigned char c) { return std::isdigit(c) != 0; }))
      return {};
    least = std::min(least, number.size());
    most = std::max(most, number.size());
  }
  if (parts.size() < 2 || (star > 0 && std::isalpha(static_cast<unsigned char>(input[star - 1]))))
    return {};  // dam.rank*.ply
  const std::string place = least == most ? std::string(least, '#') : "{}";
  return {"* stands for the parts of one frame, here " + std::to_string(parts.size()) +
          " numbered files; did you mean the sequence " +
          std::string(input).replace(star, 1, place) + "?"};
}

}  // namespace meniscus::cli
