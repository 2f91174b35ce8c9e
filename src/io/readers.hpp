// One reader a format. Each takes the whole file, returns its particles, and throws InputError.
// Radii are as the file has them: read_particles checks them.
#pragma once

#include "io/input_file.hpp"
#include "meniscus/types.hpp"

namespace meniscus {

/// read_particles of a file that is in memory: the format follows from its name.
Particles particles_of(const InputFile& file, double particle_radius);

/// read_camera of a file that is in memory.
Camera camera_of(const InputFile& file);

/// Stanford polygon file: ascii and both binary encodings; the element vertex holds the particles.
Particles read_ply(const InputFile& file);

/// Legacy VTK, ASCII and BINARY: the points of POLYDATA, UNSTRUCTURED_GRID or STRUCTURED_GRID with
/// the arrays of POINT_DATA. TIME or TimeValue among the fields of the data set is the time.
Particles read_vtk(const InputFile& file);

/// Classic bgeo (version 5) with its point attributes, also packed by gzip.
Particles read_bgeo(const InputFile& file);

/// Rows of x y z between blanks; six columns are position and velocity, others are left out. The
/// classic form begins with the number of rows and a line of comment, and may label each row.
Particles read_xyz(const InputFile& file);

/// A table with a row of names, or of x, y, z (and vx, vy, vz) without one.
Particles read_csv(const InputFile& file);

}  // namespace meniscus
