// Houdini's geometry since version 12: binary JSON, alone or in blocks that blosc packs (.bgeo.sc).
#pragma once

#include "io/input_file.hpp"
#include "meniscus/io.hpp"
#include "meniscus/types.hpp"

namespace meniscus {

/// Whether bytes begin as binary JSON of Houdini's.
bool is_bgeo_json(const std::string& bytes);

/// The points of binary JSON. Throws InputError.
Particles read_bgeo_json(const InputFile& file, const ReadOptions& options);

/// What the blocks of a .bgeo.sc unpack to. Throws InputError.
InputFile unpacked_sc(const InputFile& file);

}  // namespace meniscus
