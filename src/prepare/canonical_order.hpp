// The order of particles that makes every result independent of the order they come in.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/notices.hpp"
#include "meniscus/borrowed.hpp"
#include "meniscus/parameters.hpp"

namespace meniscus {

/// Indices of the particles with finite coordinates, in an order that depends on the set alone: by
/// position, then by own radius, then by velocity. Particles that agree in all of them are
/// interchangeable. Warns of the others (see report_dropped), and of particles at one position.
std::vector<std::size_t> canonical_order(const BorrowedParticles& particles,
                                         const Parameters& params, Notices& notices);

/// That `bad` of `size` particles, the first of them number `first`, have no finite coordinates.
Notice not_finite(std::int64_t bad, std::int64_t size, std::int64_t first);

/// Warns that `bad` of `size` particles, the first of them number `first`, have no finite
/// coordinates and were dropped. Throws InputError when params.strict, and where none is left:
/// that is no empty frame but a damaged one.
void report_dropped(std::int64_t bad, std::int64_t size, std::int64_t first,
                    const Parameters& params, Notices& notices);

/// Warns that notice.count of notice.of particles were dropped; its text says why, and `dropped`
/// ends it. Throws InputError as above.
void report_dropped(Notice notice, const char* dropped, const Parameters& params, Notices& notices);

/// The warning that so many of `size` particles lie where another one does.
Notice coinciding(std::size_t copies, std::size_t size);

/// Whether two particles have one position; those that do follow each other in the order.
inline bool at_one_position(const BorrowedParticles& p, std::size_t a, std::size_t b) {
  return p.x[a] == p.x[b] && p.y[a] == p.y[b] && p.z[a] == p.z[b];
}

}  // namespace meniscus
