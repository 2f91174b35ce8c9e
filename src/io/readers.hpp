// One reader a format. Some take the whole file and return its particles; others say where the
// values lie (layout.hpp), which a file in memory and one on disk share. All throw InputError.
// Radii are as the file has them: read_particles checks them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "io/bytes.hpp"
#include "io/input_file.hpp"
#include "io/layout.hpp"
#include "meniscus/io.hpp"
#include "meniscus/types.hpp"

namespace meniscus {

/// read_particles of a file that is in memory: the format follows from its name.
Particles particles_of(const InputFile& file, double particle_radius);
Particles particles_of(const InputFile& file, const ReadOptions& options);

/// read_camera of a file that is in memory.
Camera camera_of(const InputFile& file);

/// The ending of a file's name that a reader knows, as it is written there; empty: none.
std::string particle_ending(const std::string& path);
inline bool is_particle_file(const std::string& path) { return !particle_ending(path).empty(); }

/// The layout reader of a format by the file's name, or null where it has none.
using LayoutReader = Layout (*)(const std::shared_ptr<const Bytes>&, const ReadOptions&);
LayoutReader layout_reader_of(const std::string& path);

/// The particles of a layout, checked as read_particles does.
Particles checked_particles(const Bytes& file, const Layout& layout);

/// Stanford polygon file: ascii and both binary encodings; the element vertex holds the particles.
Particles read_ply(const InputFile& file, const ReadOptions& options);

/// Legacy VTK, ASCII and BINARY: the points of POLYDATA, UNSTRUCTURED_GRID or STRUCTURED_GRID with
/// the arrays of POINT_DATA. TIME or TimeValue among the fields of the data set is the time.
Particles read_vtk(const InputFile& file, const ReadOptions& options);

/// Classic bgeo (version 5) with its point attributes, also packed by gzip, and Houdini's binary
/// JSON, also packed by gzip or in the blocks of a .bgeo.sc.
Particles read_bgeo(const InputFile& file, const ReadOptions& options);

/// Rows of x y z between blanks; six columns are position and velocity, others are left out. The
/// classic form begins with the number of rows and a line of comment, and may label each row.
Particles read_xyz(const InputFile& file, const ReadOptions& options);

/// A table with a row of names, or of x, y, z (and vx, vy, vz) without one. Lines before the row of
/// names are left out where they name no x, y and z. Where ; separates the cells, numbers may have
/// a decimal comma.
Particles read_csv(const InputFile& file, const ReadOptions& options);

/// LAMMPS' text dumps: x y z, or scaled (xs), unwrapped (xu) or both (xsu), of one timestep.
Particles read_lammps(const InputFile& file, const ReadOptions& options);

/// VTK's XML files of PolyData and UnstructuredGrid: ascii, base64, appended raw and base64, packed
/// by zlib or not. One piece. TimeValue among the fields of the data set is the time.
Layout vtk_xml_layout(const std::shared_ptr<const Bytes>& file, const ReadOptions& options);

/// NumPy's array of shape (n, 3) or more, either order, or of a structure with named fields.
Layout npy_layout(const std::shared_ptr<const Bytes>& file, const ReadOptions& options);

/// An archive of NumPy's arrays, stored or deflated.
Layout npz_layout(const std::shared_ptr<const Bytes>& file, const ReadOptions& options);

/// HDF5 as h5py and PySPH write it: the group that ReadOptions::dataset names, the only one with
/// positions, or the one called fluid.
Layout hdf5_layout(const std::shared_ptr<const Bytes>& file, const ReadOptions& options);

/// DualSPHysics' Part_0000.bi4: the fluid, without walls and bodies.
Layout bi4_layout(const std::shared_ptr<const Bytes>& file, const ReadOptions& options);

/// FLIP Fluids' fluidparticles000001.ffp3; velocities and attributes from the files beside it.
Layout ffp3_layout(const std::shared_ptr<const Bytes>& file, const ReadOptions& options);

/// OpenVDB: the only grid of points, or the one that ReadOptions::dataset names. Only where
/// MENISCUS_OPENVDB is defined.
Particles read_vdb(const InputFile& file, const ReadOptions& options);

/// A frame of a .pvd.
struct SeriesFrame {
  std::string file;  // as it is written, beside the .pvd where it is relative
  double time = 0;
};
std::vector<SeriesFrame> read_pvd(const InputFile& file);

}  // namespace meniscus
