// What this program is, for those who must know whether another made a file.
#pragma once

#include <string>

namespace meniscus {

/// The version, and a hash of the kernels and of the file that runs: two programs that may compute
/// something else have different ones, whatever they call themselves.
const std::string& program_identity();

}  // namespace meniscus
