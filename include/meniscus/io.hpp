// Reading particles and cameras, writing surfaces and reading them back. Every writer writes to a
// temporary name beside the target and renames when the file is complete and on disk.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "meniscus/export.hpp"
#include "meniscus/parameters.hpp"
#include "meniscus/types.hpp"

namespace meniscus MENISCUS_API {

/// What is wanted of a file of particles.
struct ReadOptions {
  double particle_radius = 0;  // > 0, world units: replaces every radius that the file states

  /// Names of arrays, in any case, that become Particles::attributes. A vector gives an attribute
  /// for each component: NAME.X, NAME.Y, NAME.Z where there are three, else NAME.0, NAME.1 ...
  std::vector<std::string> attributes{};

  /// Where a file holds several: the HDF5 group or dataset with the particles, or the array of
  /// positions of an .npz, or OpenVDB's grid. Empty: what is found.
  std::string dataset{};

  /// The TIMESTEP of a LAMMPS dump that holds several; below 0: the only one.
  std::int64_t timestep = -1;
};

/// Reads one frame of particles. The format follows from the ending (docs/formats.md): .ply, .vtk,
/// .vtp, .vtu, .npy, .npz, .h5 and .hdf5, .bgeo, .bgeo.gz and .bgeo.sc, .bi4, .ffp3, .lammpstrj and
/// .dump, .xyz, .csv, .vdb (option). NaN and infinite coordinates are kept: `extract` drops them.
///
///   particle_radius  > 0, world units: replaces every radius that the file states; 0: the file's
///
/// Throws InputError: file, place in it, what was found, what was wanted. Particles are counted
/// from 0 in messages, lines from 1. Throws InvalidArgument for a radius below 0.
Particles read_particles(const std::string& path, double particle_radius = 0);
Particles read_particles(const std::string& path, const ReadOptions& options);

/// Reads {"width", "height", "view": 4x4, "projection": 4x4} (row-major JSON). Throws InputError.
Camera read_camera(const std::string& path);

/// Frames are numbered from 0 to this: a number of 18 digits, so that differences and sums of two
/// always fit.
inline constexpr std::int64_t kLastFrame = 999'999'999'999'999'999;

/// Under this key a file with one camera, for every frame.
inline constexpr std::int64_t kEveryFrame = -1;

/// Reads a list of such objects, each with its "frame", or one camera. Throws InputError.
std::map<std::int64_t, Camera> read_cameras(const std::string& path);

/// How a surface is written.
enum class Compression { none, rle, zips, zip, piz, pxr24 };
enum class Preview { lit, normal, depth, groups, glass };

/// Writes Z, A, N.X N.Y N.Z, P.X P.Y P.Z, id, kind and residual as scan lines, row 0 on top; V.X
/// V.Y V.Z and forward.u forward.v where the surface has them; of its layers Z.back (the first
/// exit), N.back.X N.back.Y N.back.Z there, thickness, and layers (their number); of each type of
/// its whitewater, e.g. foam, foam.coverage, foam.density, foam.Z and foam.V.X foam.V.Y foam.V.Z
/// where it moves, of bubbles bubble.behind (WhitewaterMaps has their units); attributes by their
/// names. Maps that are empty are left out, but for Z. `half`: N, residual, V and forward as 16-bit
/// floats, which keep 11 bits, fewer below 6e-5; but for a map with values beyond their range,
/// 65,504. Throws OutputError, InvalidArgument for maps that are not of the camera's size.
void write_exr(const std::string& path, const Surface& surface, const Parameters& parameters,
               Compression compression = Compression::zip, bool half = false);

/// Writes the layers as a deep image: a sample for each interval that is kept, with Z where the ray
/// enters, ZBack where it leaves, and A = 1; nearest first, none over another. Compressed line by
/// line (ZIPS). Throws OutputError, InvalidArgument for a surface without layers.
void write_deep_exr(const std::string& path, const Surface& surface, const Parameters& parameters);

/// Reads what write_exr wrote, in either width: every map and the camera; the mesh, counts and
/// warnings stay empty. Channels that it does not know are left out. `attributes`: gets the
/// header's texts by name, such as "meniscus.parameters". Throws InputError when the file is
/// missing, cut off, damaged or not by write_exr.
Surface read_exr(const std::string& path, std::map<std::string, std::string>* attributes = nullptr);

/// Writes the mesh with normals, by the ending: .ply (binary little endian), .vtp (appended raw)
/// and .glb also with velocities and attributes where it has them, .obj, or .stl (binary, normals
/// of the triangles). Throws OutputError, InvalidArgument for arrays that do not fit each other.
void write_mesh(const std::string& path, const Mesh& mesh);

/// Writes a picture of the surface for people. Throws OutputError, InvalidArgument where the
/// preview needs a map that the surface does not have.
void write_png(const std::string& path, const Surface& surface, Preview preview = Preview::lit);

}  // namespace MENISCUS_API
