// Meshes as VTK's XML (.vtp), binary glTF (.glb) and binary STL. The mesh fits itself; each file
// has a place for its seal (seal.hpp), which is written afterwards.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

#include "io/output_file.hpp"
#include "meniscus/types.hpp"

namespace meniscus {

/// What an attribute is called in a file where `taken` names have a meaning of their own: these get
/// "particle." before them.
std::string free_name(const std::string& attribute, std::initializer_list<std::string_view> taken);

/// PolyData with appended raw arrays: Normals, velocity and each attribute at the points.
void write_vtp(OutputFile& file, const Mesh& mesh, const std::string& job);

/// glTF 2.0 in one file: POSITION, NORMAL, _velocity and _NAME for each attribute. Coordinates are
/// the particles': glTF's convention of y up and metres is not forced on them.
void write_glb(OutputFile& file, const Mesh& mesh, const std::string& job);

/// Triangles with their own normals. There is no room for normals at vertices, velocities and
/// attributes, nor for more than a hash of the job.
void write_stl(OutputFile& file, const Mesh& mesh, const std::string& job);

}  // namespace meniscus
