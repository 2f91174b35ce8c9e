// The channels of a surface's maps in an EXR file: one list, for writing and for reading.
#pragma once

#include <ImfPixelType.h>

#include <cstdint>
#include <vector>

#include "meniscus/types.hpp"

namespace meniscus {

/// Calls visit(name, type, first value, bytes to the next) for every map that the surface has, but
/// for A, which follows from them. The maps have at least one pixel; `kind` stands for
/// surface.kind, which has other numbers in memory than in the file.
template <class Map, class Kinds, class Visit>
void for_each_channel(Map& surface, Kinds& kind, const Visit& visit) {
  const auto vectors = [&](const char* const(&names)[3], auto& values) {
    visit(names[0], Imf::FLOAT, &values[0].x, sizeof(Vec3));
    visit(names[1], Imf::FLOAT, &values[0].y, sizeof(Vec3));
    visit(names[2], Imf::FLOAT, &values[0].z, sizeof(Vec3));
  };
  visit("Z", Imf::FLOAT, surface.depth.data(), sizeof(float));
  vectors({"N.X", "N.Y", "N.Z"}, surface.normal);
  vectors({"P.X", "P.Y", "P.Z"}, surface.position);
  visit("id", Imf::UINT, surface.group.data(), sizeof(std::uint32_t));
  visit("kind", Imf::UINT, kind.data(), sizeof(std::uint32_t));
  visit("residual", Imf::FLOAT, surface.residual.data(), sizeof(float));
  if (!surface.velocity.empty()) vectors({"V.X", "V.Y", "V.Z"}, surface.velocity);
  if (auto& forward = surface.forward.pixels; !forward.empty()) {
    visit("forward.u", Imf::FLOAT, &forward[0][0], sizeof forward[0]);
    visit("forward.v", Imf::FLOAT, &forward[0][1], sizeof forward[0]);
  }
}

}  // namespace meniscus
