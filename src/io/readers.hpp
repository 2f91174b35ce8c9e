// One reader a format. Each takes the whole file, returns its particles, and throws InputError.
// Radii are as the file has them: read_particles checks them.
#pragma once

#include "io/input_file.hpp"
#include "meniscus/types.hpp"

namespace meniscus {

/// Stanford polygon file: ascii and both binary encodings; the element vertex holds the particles.
Particles read_ply(const InputFile& file);

}  // namespace meniscus
