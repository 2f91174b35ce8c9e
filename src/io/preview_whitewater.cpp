// Foam, spray and bubbles over a picture of the water: white, as many small bubbles and drops look.
#include <cmath>

#include "io/picture.hpp"
#include "io/studio.hpp"

namespace meniscus {
namespace {

constexpr Color kWhite = {0.93f, 0.95f, 0.96f}, kInWater = {0.55f, 0.80f, 0.86f};
constexpr float kSeen = 24;  // particle radii of water that dim a bubble by 1/e

}  // namespace

Picture draw_whitewater_over(const Scene& scene, Picture picture) {
  const float per_length = 1 / (kSeen * static_cast<float>(scene.view.radius));
  for (const WhitewaterMaps& maps : scene.surface.whitewater)  // bubbles below all others
    if (maps.type == WhitewaterType::bubble)
      parallel_pixels(scene, [&](int, int, std::size_t k) {
        picture[k] = mix(picture[k], kInWater,
                         0.75f * maps.coverage[k] * std::exp(-maps.behind[k] * per_length));
      });
  for (const WhitewaterMaps& maps : scene.surface.whitewater)
    if (maps.type != WhitewaterType::bubble)
      parallel_pixels(scene, [&](int, int, std::size_t k) {
        const bool lies_on = maps.type == WhitewaterType::foam && scene.covered(k);
        const float light = lies_on ? 0.8f + 0.2f * dot(scene.normal[k], kKey) : 1;
        picture[k] = mix(picture[k], kWhite * light, maps.coverage[k]);
      });
  return picture;
}

}  // namespace meniscus
