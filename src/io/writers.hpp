// The writers of meniscus/io.hpp into a file that the caller opened, so that several files can be
// published together. They neither finish nor publish it. Each ends with the file's seal: `job` is
// what seal.hpp says; empty: none.
#pragma once

#include <functional>
#include <string_view>

#include "io/output_file.hpp"
#include "meniscus/io.hpp"

namespace meniscus {

void write_exr(OutputFile& file, const Surface& surface, const Parameters& parameters,
               Compression compression, bool half, const std::string& job = "");

void write_deep_exr(OutputFile& file, const Surface& surface, const Parameters& parameters,
                    const std::string& job = "");

/// Whether write_mesh() knows an ending, such as ".ply"; in lower case.
bool is_mesh_ending(std::string_view ending);

/// The ending of the file's path says which: .ply, .vtp, .glb, .obj or .stl.
void write_mesh(OutputFile& file, const Mesh& mesh, const std::string& job = "");

/// Calls reached(share) with the share that is done, 0 to 1, now and then.
void write_png(
    OutputFile& file, const Surface& surface, Preview preview, const std::string& job = "",
    const std::function<void(double)>& reached = [](double) {});

}  // namespace meniscus
