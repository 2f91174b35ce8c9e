// The channels of a surface's maps in an EXR file: one list, for writing and for reading.
#pragma once

#include <ImfPixelType.h>

#include <string>

#include "meniscus/types.hpp"
#include "meniscus/whitewater.hpp"

namespace meniscus {

/// The channel of an attribute: its name, or "particle." and its name where a map of the surface
/// has that one.
inline std::string channel_of(const std::string& attribute) {
  const std::string layer = attribute.substr(0, attribute.find('.'));
  for (const char* map : {"Z", "A", "N", "P", "V", "id", "kind", "residual", "forward", "thickness",
                          "layers", "foam", "spray", "bubble", "R", "G", "B", "X", "Y"})
    if (layer == map) return "particle." + attribute;
  return attribute;
}

/// Calls visit(name, type, first value, bytes to the next) for every map that the surface has, but
/// for A, which follows from depth. `kind` stands for surface.kind, which has other numbers in
/// memory than in the file.
template <class Map, class Kinds, class Visit>
void for_each_channel(Map& surface, Kinds& kind, const Visit& visit) {
  const auto scalars = [&](const char* name, Imf::PixelType type, auto& values) {
    if (!values.empty()) visit(name, type, values.data(), sizeof values[0]);
  };
  const auto vectors = [&](const char* const(&names)[3], auto& values) {
    if (values.empty()) return;
    visit(names[0], Imf::FLOAT, &values[0].x, sizeof(Vec3));
    visit(names[1], Imf::FLOAT, &values[0].y, sizeof(Vec3));
    visit(names[2], Imf::FLOAT, &values[0].z, sizeof(Vec3));
  };
  scalars("Z", Imf::FLOAT, surface.depth);
  vectors({"N.X", "N.Y", "N.Z"}, surface.normal);
  vectors({"P.X", "P.Y", "P.Z"}, surface.position);
  scalars("id", Imf::UINT, surface.group);
  scalars("kind", Imf::UINT, kind);
  scalars("residual", Imf::FLOAT, surface.residual);
  vectors({"V.X", "V.Y", "V.Z"}, surface.velocity);
  for (auto& attribute : surface.attributes)
    if (!attribute.values.empty())
      visit(channel_of(attribute.name).c_str(), Imf::FLOAT, attribute.values.data(), sizeof(float));
  if (auto& forward = surface.forward.pixels; !forward.empty()) {
    visit("forward.u", Imf::FLOAT, &forward[0][0], sizeof forward[0]);
    visit("forward.v", Imf::FLOAT, &forward[0][1], sizeof forward[0]);
  }
  if (auto& layers = surface.layers; layers.most > 0) {
    scalars("Z.back", Imf::FLOAT, layers.exit);  // those of the first layer
    vectors({"N.back.X", "N.back.Y", "N.back.Z"}, layers.back_normal);
    scalars("thickness", Imf::FLOAT, layers.thickness);
    scalars("layers", Imf::UINT, layers.count);
  }
  for (auto& maps : surface.whitewater) {
    const auto name = [&](const char* map) { return to_string(maps.type) + map; };
    scalars(name(".coverage").c_str(), Imf::FLOAT, maps.coverage);
    scalars(name(".density").c_str(), Imf::FLOAT, maps.density);
    scalars(name(".Z").c_str(), Imf::FLOAT, maps.depth);
    scalars(name(".behind").c_str(), Imf::FLOAT, maps.behind);
    if (maps.velocity.empty()) continue;
    visit(name(".V.X").c_str(), Imf::FLOAT, &maps.velocity[0].x, sizeof(Vec3));
    visit(name(".V.Y").c_str(), Imf::FLOAT, &maps.velocity[0].y, sizeof(Vec3));
    visit(name(".V.Z").c_str(), Imf::FLOAT, &maps.velocity[0].z, sizeof(Vec3));
  }
}

}  // namespace meniscus
