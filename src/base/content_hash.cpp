#include "base/content_hash.hpp"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <bit>
#include <cstdio>

namespace meniscus {

std::uint64_t content_hash(const Surface& surface) {
  static_assert(std::endian::native == std::endian::little, "hashes are of little-endian bytes");
  XXH3_state_t state;
  XXH3_64bits_reset(&state);
  const auto add = [&](const auto& values) {
    const std::uint64_t size = values.size();  // so that no two arrays run into one another
    XXH3_64bits_update(&state, &size, sizeof size);
    XXH3_64bits_update(&state, values.data(), size * sizeof values[0]);
  };
  static_assert(sizeof(Vec3) == 3 * sizeof(float) && sizeof(Kind) == 1);
  add(std::array{surface.camera.width, surface.camera.height});
  add(surface.depth);
  add(surface.normal);
  add(surface.position);
  add(surface.group);
  add(surface.kind);
  add(surface.residual);
  add(surface.velocity);
  add(surface.forward.pixels);
  add(surface.mesh.position);
  add(surface.mesh.normal);
  add(surface.mesh.velocity);
  add(surface.mesh.triangle);
  for (const auto* attributes : {&surface.attributes, &surface.mesh.attributes})
    for (const Attribute& attribute : *attributes) {
      add(attribute.name);
      add(attribute.values);
    }
  if (surface.layers.most > 0) {
    const Layers& layers = surface.layers;
    add(std::array{layers.most});
    add(layers.count);
    add(layers.thickness);
    add(layers.entry);
    add(layers.exit);
    add(layers.back_normal);
  }
  for (const WhitewaterMaps& maps : surface.whitewater) {
    add(std::array{maps.type});
    add(maps.coverage);
    add(maps.density);
    add(maps.depth);
    add(maps.velocity);
    add(maps.behind);
  }
  return XXH3_64bits_digest(&state);
}

std::uint64_t content_hash(const std::string& text) {
  return content_hash(text.data(), text.size());
}

std::uint64_t content_hash(const void* bytes, std::size_t size) { return XXH3_64bits(bytes, size); }

std::string hex_digits(std::uint64_t number) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(number));
  return text;
}

}  // namespace meniscus
