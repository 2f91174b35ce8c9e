// The order of particles that makes every result independent of the order they come in.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "meniscus/parameters.hpp"
#include "meniscus/types.hpp"

namespace meniscus {

/// Indices of the particles with finite coordinates, in an order that depends on the set alone: by
/// position, then by own radius, then by velocity. Particles that agree in all of them are
/// interchangeable. Warns of the others, and of particles at one position; throws InputError when
/// params.strict.
std::vector<std::size_t> canonical_order(const Particles& particles, const Parameters& params,
                                         std::vector<std::string>& warnings);

}  // namespace meniscus
