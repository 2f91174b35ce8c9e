// Mutations that know a format, so that fuzzing gets past its header: what libFuzzer's own cannot
// keep true, such as counts, checksums and brackets, is made true again, mostly.
#pragma once

#include <cstddef>
#include <random>
#include <string>

namespace meniscus::fuzz {

using Random = std::minstd_rand;

/// A whole number from 0 to n - 1.
inline std::size_t below(Random& random, std::size_t n) { return random() % n; }

/// libFuzzer's own mutation.
std::string any_mutation(std::string bytes, std::size_t most);

/// A PLY file of `most` bytes or less: a new one, or this one with another header whose data fit
/// it, with other data, or with more rows.
std::string mutate_ply(std::string bytes, std::size_t most, Random& random);

/// JSON with another value, key, length or nesting somewhere; each line by itself where `lines`.
std::string mutate_json(const std::string& bytes, std::size_t most, bool lines, Random& random);

/// A PNG whose chunks have right checksums.
std::string mutate_png(const std::string& bytes, std::size_t most);

}  // namespace meniscus::fuzz
