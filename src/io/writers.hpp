// The writers of meniscus/io.hpp into a file that the caller opened, so that several files can be
// published together. They neither finish nor publish it.
#pragma once

#include "io/output_file.hpp"
#include "meniscus/io.hpp"

namespace meniscus {

void write_exr(OutputFile& file, const Surface& surface, const Parameters& parameters,
               Compression compression);

/// The ending of the file's path says whether it is .ply or .obj.
void write_mesh(OutputFile& file, const Mesh& mesh);

void write_png(OutputFile& file, const Surface& surface, Preview preview);

}  // namespace meniscus
