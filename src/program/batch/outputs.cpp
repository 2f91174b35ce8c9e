#include "program/batch/outputs.hpp"

#include <filesystem>
#include <map>
#include <memory>

#include "io/input_file.hpp"
#include "io/output_file.hpp"
#include "io/parts.hpp"
#include "io/writers.hpp"
#include "meniscus/error.hpp"

namespace meniscus {

namespace fs = std::filesystem;

namespace {

bool has_known_ending(const std::string& path) {
  const std::string ending = lower_case(fs::path(path).extension().string());
  return ending == ".exr" || ending == ".png" || is_mesh_ending(ending);
}

// Refuses "a.png,b.exr", which nobody wants as the name of one file.
void refuse_list(const std::string& path) {
  std::string each;
  std::size_t names = 0;
  for (std::size_t from = 0, to = 0; to != std::string::npos; from = to + 1, ++names) {
    to = path.find(',', from);
    const std::string name = path.substr(from, to == std::string::npos ? to : to - from);
    if (!has_known_ending(name)) return;
    each += (each.empty() ? "-o " : " -o ") + name;
  }
  if (names > 1)
    throw InvalidArgument("output " + path +
                          ": is a list, give each file an -o of its own: " + each);
}

// A file's one name, whether it is there or not.
fs::path canonical(const std::string& path) {
  std::error_code error;
  return fs::weakly_canonical(fs::absolute(path), error);
}

}  // namespace

bool is_mesh(const std::string& path) {
  return is_mesh_ending(lower_case(fs::path(path).extension().string()));
}

void refuse_scene(const std::string& path) {
  const std::string ending = lower_case(fs::path(path).extension().string());
  const std::string ply = " (name it " + fs::path(path).replace_extension(".ply").string();
  if (ending.starts_with(".usd"))
    throw InvalidArgument("output " + path + ": USD is not written" + ply +
                          "; scripts/usd_sequence.py makes one USD file of such meshes)");
  if (ending == ".abc" || ending == ".fbx" || ending == ".gltf")
    throw InvalidArgument("output " + path + ": this is a scene, and only meshes are written" +
                          ply + ", or .glb)");
}

OutputKind kind_of(const std::string& path) {
  refuse_list(path);
  const fs::path lower = lower_case(path);
  const std::string ending = lower.extension().string();
  if (ending == ".exr")
    return lower.stem().extension() == ".deep" ? OutputKind::deep : OutputKind::exr;
  if (is_mesh(path)) return OutputKind::mesh;
  if (ending == ".png") return OutputKind::png;
  if (path == "-")
    throw InvalidArgument(
        "output -: standard output takes no files: a file gets its name when it is whole (give a "
        "name, e.g. surface.exr)");
  for (const char* picture : {".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp"})
    if (ending == picture)
      throw InvalidArgument("output " + path + ": pictures are written as .png (name it " +
                            fs::path(path).replace_extension(".png").string() + "), maps as .exr");
  refuse_scene(path);
  if (std::error_code ignored; path.ends_with('/') || fs::is_directory(path, ignored))
    throw InvalidArgument("output " + path + ": is a folder, wanted a file in it, e.g. " +
                          (fs::path(path) / "surface.exr").string() + ", or of a sequence " +
                          (fs::path(path) / "surface.####.exr").string());
  throw InvalidArgument(
      "output " + path +
      ": unknown file ending, must be .exr (maps), .deep.exr (layers), .ply, .vtp, .glb, "
      ".obj or .stl (mesh) or .png (picture)");
}

void check_outputs(const InputNames& read, const std::vector<std::string>& outputs,
                   const std::vector<std::string>& others) {
  for (const std::string& path : outputs) {
    kind_of(path);
    if (path.find('*') != std::string::npos)
      throw InvalidArgument(
          "output " + path +
          ": has a *, which stands for the parts of one frame, in inputs alone; of "
          "a sequence write #### in both, e.g. name.####" +
          fs::path(path).extension().string());
  }
  std::map<fs::path, std::string> taken;  // and what by
  for (const std::string& input : read.inputs) {
    if (input.empty()) continue;
    for (const std::string& part : part_files(input))
      taken[canonical(part)] =
          "is the input" + (part == input ? "" : " " + input + ", too") + ", give another name";
  }
  for (const std::string& camera : read.cameras)
    if (!camera.empty()) taken[canonical(camera)] = "is the camera's file, give another name";
  for (const auto* paths : {&outputs, &others})
    for (const std::string& path : *paths) {
      if (path.empty()) continue;
      const auto [at, is_new] =
          taken.try_emplace(canonical(path), "is named twice, give each output its own name");
      if (!is_new) throw InvalidArgument("output " + path + ": " + at->second);
    }
}

std::uint64_t write_outputs(const std::vector<std::string>& paths, const Surface& surface,
                            const Parameters& parameters, const WriteOptions& options) {
  std::vector<std::unique_ptr<OutputFile>> files;
  std::uint64_t bytes = 0;
  for (const std::string& path : paths) {
    const auto reached = [&, before = static_cast<double>(files.size())](double share) {
      if (options.reached) options.reached((before + share) / static_cast<double>(paths.size()));
    };
    OutputFile& file = *files.emplace_back(std::make_unique<OutputFile>(path));
    switch (kind_of(path)) {
      case OutputKind::exr:
        write_exr(file, surface, parameters, options.compression, options.half, options.job);
        break;
      case OutputKind::deep:
        write_deep_exr(file, surface, parameters, options.job);
        break;
      case OutputKind::mesh:
        write_mesh(file, surface.mesh, options.job);
        break;
      case OutputKind::png:
        write_png(file, surface, options.preview, options.job, reached);
        break;
    }
    file.finish();
    reached(1);
  }
  for (const auto& file : files) {
    file->publish();
    // Where someone else has taken it away since, its frame is done all the same.
    std::error_code gone;
    const std::uintmax_t size = fs::file_size(file->path(), gone);
    if (!gone) bytes += size;
  }
  return bytes;
}

}  // namespace meniscus
