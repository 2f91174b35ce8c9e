// Whether results are the same to the last bit, NaN and the sign of zero included.
#pragma once

#include <cstring>
#include <vector>

#include "meniscus/types.hpp"

namespace meniscus {

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

inline bool same_bits(const Mesh& a, const Mesh& b) {
  return same_bits(a.position, b.position) && same_bits(a.normal, b.normal) &&
         same_bits(a.velocity, b.velocity) && same_bits(a.triangle, b.triangle);
}

inline bool same_bits(const WhitewaterMaps& a, const WhitewaterMaps& b) {
  return a.type == b.type && same_bits(a.coverage, b.coverage) && same_bits(a.density, b.density) &&
         same_bits(a.depth, b.depth) && same_bits(a.velocity, b.velocity) &&
         same_bits(a.behind, b.behind);
}

/// Their maps and meshes.
inline bool same_bits(const Surface& a, const Surface& b) {
  return same_bits(a.depth, b.depth) && same_bits(a.normal, b.normal) &&
         same_bits(a.position, b.position) && same_bits(a.group, b.group) &&
         same_bits(a.kind, b.kind) && same_bits(a.residual, b.residual) &&
         same_bits(a.velocity, b.velocity) && same_bits(a.mesh, b.mesh);
}

}  // namespace meniscus
