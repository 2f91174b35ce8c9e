// What feeds the readers of particles: each takes the bytes of a file.
#pragma once

#include <string>

namespace meniscus::fuzz {

/// Ends the program with a message unless `good`.
void want(bool good, const char* what);

/// Reads `bytes` as the file `name`, also with attributes. The arrays must fit each other, and
/// where the format has a layout, a source must give the same values. Throws InputError.
void particles(const char* name, const std::string& bytes);

/// A .pvd.
void series(const std::string& bytes);

}  // namespace meniscus::fuzz
