#include <cmath>

#include "base/comma_separated.hpp"
#include "io/input_file.hpp"
#include "io/readers.hpp"
#include "meniscus/io.hpp"

namespace meniscus {
namespace {

struct Format {
  const char* ending;
  Particles (*read)(const InputFile&, const ReadOptions&);  // null: one with a layout
  LayoutReader layout;
  const char* item;  // what the format calls a particle
};

constexpr Format kFormats[] = {
    {".ply", read_ply, nullptr, "vertex"},       {".vtk", read_vtk, nullptr, "point"},
    {".vtp", nullptr, vtk_xml_layout, "point"},  {".vtu", nullptr, vtk_xml_layout, "point"},
    {".npy", nullptr, npy_layout, "particle"},   {".npz", nullptr, npz_layout, "particle"},
    {".h5", nullptr, hdf5_layout, "particle"},   {".hdf5", nullptr, hdf5_layout, "particle"},
    {".bgeo", read_bgeo, nullptr, "point"},      {".bgeo.gz", read_bgeo, nullptr, "point"},
    {".bgeo.sc", read_bgeo, nullptr, "point"},   {".bi4", nullptr, bi4_layout, "particle"},
    {".ffp3", nullptr, ffp3_layout, "particle"}, {".lammpstrj", read_lammps, nullptr, "atom"},
    {".dump", read_lammps, nullptr, "atom"},     {".xyz", read_xyz, nullptr, "particle"},
    {".csv", read_csv, nullptr, "particle"},
#ifdef MENISCUS_OPENVDB
    {".vdb", read_vdb, nullptr, "point"},
#endif
};

// What people have particles in that is not read, and what they can do.
struct Unread {
  const char* ending;
  const char* what;
  const char* instead;
};

constexpr const char* kOpen =
    "write its points as .bgeo.sc or .ply in a program that opens it, such as Houdini";
constexpr const char* kMaker =
    "let the program that made it write its particles in one of these, such as .ply or .csv";
constexpr const char* kMesh = "a mesh has no particles: write the points that it was made of";
constexpr const char* kScan = "convert it to .ply, e.g. by PDAL";
constexpr const char* kGrid = "write particles as .vtp or .vtu: a grid has none";
constexpr const char* kPieces = "give its pieces instead, with a * for what differs in their names";
constexpr const char* kTable =
    "where it is a table, call it .csv with a row of names, or .xyz without one";
constexpr const char* kUnpack = "unpack it first";

constexpr Unread kUnread[] = {
    {".abc", "Alembic", kOpen},
    {".usd", "USD", kOpen},
    {".usda", "USD", kOpen},
    {".usdc", "USD", kOpen},
    {".usdz", "USD", kOpen},
    {".fbx", "FBX", kOpen},
    {".geo", "Houdini's text", "write it as .bgeo or .bgeo.sc"},
    {".prt", "Krakatoa's PRT", kMaker},
    {".bin", "a program's own file", kMaker},
    {".sim", "a program's own file", kMaker},
    {".obj", "OBJ", kMesh},
    {".stl", "STL", kMesh},
    {".glb", "glTF", kMesh},
    {".gltf", "glTF", kMesh},
    {".las", "LAS", kScan},
    {".laz", "LAS", kScan},
    {".e57", "E57", kScan},
    {".pcd", "PCD", kScan},
    {".vti", "a grid of VTK", kGrid},
    {".vtr", "a grid of VTK", kGrid},
    {".vts", "a grid of VTK", kGrid},
    {".pvtp", "a list of pieces", kPieces},
    {".pvtu", "a list of pieces", kPieces},
    {".txt", "plain text", kTable},
    {".dat", "plain text", kTable},
    {".tsv", "plain text", kTable},
    {".gz", "a packed file", kUnpack},
    {".zst", "a packed file", kUnpack},
    {".zip", "a packed file", kUnpack},
    {".tar", "a packed file", kUnpack},
};

const Format& format_of(const std::string& path) {
  const std::string name = lower_case(path);
  if (name == "-")
    throw InputError(
        "-: particles are not read from standard input, because large files are read several times "
        "(write them to a file, e.g. frame.ply)");
  for (const Format& format : kFormats)
    if (name.ends_with(format.ending)) return format;
  if (name.ends_with(".vdb"))
    throw InputError(path +
                     ": this build reads no OpenVDB (build Meniscus with -DMENISCUS_OPENVDB=ON, or "
                     "write the points as .bgeo, .ply or .npy)");
  const std::string wanted =
      ", the name must end in one of " + comma_separated(kFormats, &Format::ending);
  for (const Unread& unread : kUnread)
    if (name.ends_with(unread.ending))
      throw InputError(path + ": " + unread.what + " is not read" + wanted + " (" + unread.instead +
                       ")");
  throw InputError(path + ": unknown format" + wanted);
}

// The same of a file on disk: that there is none, or no file, matters more than how its name ends.
const Format& format_of_file(const std::string& path) {
  try {
    return format_of(path);
  } catch (const InputError&) {
    if (path != "-") open_input(path);
    throw;
  }
}

void check_values(const std::string& file, const char* item, const Particles& particles) {
  const std::string wanted =
      ", must be > 0 and finite (give " + setting("particle-radius") + " to override)";
  for (std::size_t i = 0; i < particles.radius.size(); ++i) {
    const float radius = particles.radius[i];
    if (!(radius > 0) || !std::isfinite(radius))
      throw InputError(file + ": " + item + " " + std::to_string(i) + ": radius is " +
                       shown(radius) + wanted);
  }
  const double stated = particles.particle_radius;
  if (stated != 0 && (!(stated > 0) || !std::isfinite(stated)))
    throw InputError(file + ": header: particle_radius is " + shown(stated) + wanted);
  if (!std::isfinite(particles.time))
    throw InputError(file + ": header: time is " + shown(particles.time) + ", must be finite");
}

}  // namespace

std::string particle_ending(const std::string& path) {
  const std::string name = lower_case(path);
  for (const Format& format : kFormats)
    if (name.ends_with(format.ending))
      return path.substr(path.size() - std::string_view(format.ending).size());
  return "";
}

LayoutReader layout_reader_of(const std::string& path) { return format_of_file(path).layout; }

Particles checked_particles(const Bytes& file, const Layout& layout) {
  Particles particles = read_layout(file, layout);
  check_values(file.name(), format_of(file.name()).item, particles);
  return particles;
}

Particles particles_of(const InputFile& file, const ReadOptions& options) {
  const Format& format = format_of(file.name);
  if (format.layout) {
    const auto bytes = memory_bytes(file);
    return checked_particles(*bytes, format.layout(bytes, options));
  }
  Particles particles = format.read(file, options);
  if (options.particle_radius > 0) {
    particles.radius.clear();
    particles.particle_radius = options.particle_radius;
  }
  check_values(file.name, format.item, particles);
  return particles;
}

Particles particles_of(const InputFile& file, double particle_radius) {
  return particles_of(file, ReadOptions{.particle_radius = particle_radius});
}

Particles read_particles(const std::string& path, const ReadOptions& options) {
  require(options.particle_radius >= 0, "read_particles: particle_radius is " +
                                            shown(options.particle_radius) +
                                            ", must be > 0, or 0 for what the file states");
  const Format& format = format_of_file(path);  // before a file of an unknown format is read
  if (!format.layout) return particles_of(read_file(path), options);
  const auto bytes = bytes_of_file(path);
  if (bytes->size() == 0) throw InputError(path + ": is empty (0 bytes)");
  return checked_particles(*bytes, format.layout(bytes, options));
}

Particles read_particles(const std::string& path, double particle_radius) {
  return read_particles(path, ReadOptions{.particle_radius = particle_radius});
}

}  // namespace meniscus
