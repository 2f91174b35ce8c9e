// The writers of meniscus/io.hpp into a file that the caller opened, so that several files can be
// published together. They neither finish nor publish it. Each ends with the file's seal: `job` is
// what seal.hpp says; empty: none.
#pragma once

#include "io/output_file.hpp"
#include "meniscus/io.hpp"

namespace meniscus {

void write_exr(OutputFile& file, const Surface& surface, const Parameters& parameters,
               Compression compression, bool half, const std::string& job = "");

/// The ending of the file's path says which: .ply, .vtp, .glb, .obj or .stl.
void write_mesh(OutputFile& file, const Mesh& mesh, const std::string& job = "");

void write_png(OutputFile& file, const Surface& surface, Preview preview,
               const std::string& job = "");

}  // namespace meniscus
