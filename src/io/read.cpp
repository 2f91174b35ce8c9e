#include <cmath>

#include "io/input_file.hpp"
#include "io/readers.hpp"
#include "meniscus/io.hpp"

namespace meniscus {
namespace {

struct Format {
  const char* ending;
  Particles (*read)(const InputFile&);
  const char* item;  // what the format calls a particle
};

constexpr Format kFormats[] = {
    {".ply", read_ply, "vertex"},   {".vtk", read_vtk, "point"},
    {".bgeo", read_bgeo, "point"},  {".bgeo.gz", read_bgeo, "point"},
    {".xyz", read_xyz, "particle"}, {".csv", read_csv, "particle"},
};

const Format& format_of(const std::string& path) {
  const std::string name = lower_case(path);
  if (name == "-")
    throw InputError(
        "-: particles are not read from standard input, because large files are read several times "
        "(write them to a file, e.g. frame.ply)");
  std::string known;
  for (const Format& format : kFormats) {
    if (name.ends_with(format.ending)) return format;
    known += std::string(known.empty() ? "" : ", ") + format.ending;
  }
  throw InputError(path + ": unknown format, the name must end in one of " + known);
}

void check_radii(const InputFile& file, const char* item, const Particles& particles) {
  const std::string wanted = ", must be > 0 and finite (give --particle-radius to override)";
  for (std::size_t i = 0; i < particles.radius.size(); ++i) {
    const float radius = particles.radius[i];
    if (!(radius > 0) || !std::isfinite(radius))
      fail(file, std::string(item) + " " + std::to_string(i),
           "radius is " + shown(radius) + wanted);
  }
  const double stated = particles.particle_radius;
  if (stated != 0 && (!(stated > 0) || !std::isfinite(stated)))
    fail(file, "header", "particle_radius is " + shown(stated) + wanted);
}

}  // namespace

Particles particles_of(const InputFile& file, double particle_radius) {
  const Format& format = format_of(file.name);
  Particles particles = format.read(file);
  if (particle_radius > 0) {
    particles.radius.clear();
    particles.particle_radius = particle_radius;
  }
  check_radii(file, format.item, particles);
  if (!std::isfinite(particles.time))
    fail(file, "header", "time is " + shown(particles.time) + ", must be finite");
  return particles;
}

Particles read_particles(const std::string& path, double particle_radius) {
  require(particle_radius >= 0, "read_particles: particle_radius is " + shown(particle_radius) +
                                    ", must be > 0, or 0 for what the file states");
  format_of(path);  // before a file of an unknown format is read
  return particles_of(read_file(path), particle_radius);
}

}  // namespace meniscus
