// What a perfect extraction of a scene would give.
#pragma once

#include <cstdint>
#include <vector>

#include "accuracy/map.hpp"
#include "accuracy/scene.hpp"

namespace meniscus::accuracy {

enum class PixelClass : std::uint8_t {
  none,        // no surface
  interior,    // all else
  crease,      // within 1.5 s of a crease: neighbours whose normals' dot product is below 0.95;
               // violent scenes are round and have none
  silhouette,  // within 1.5 s of an outline: the end of the surface, or a depth jump over s
  splash,      // a lone particle or a small cluster in the air, up to its outline
};

struct Truth {
  Lens lens;
  std::vector<double> depth;         // [height*width] s; +infinity where there is no surface
  std::vector<Vec3d> normal;         // [height*width] unit, outward, world axes; zero where none
  std::vector<PixelClass> class_of;  // [height*width]
  std::vector<int> piece;            // [height*width] which piece of splash; -1: bulk or nothing
  int splash_pieces = 0;             // of the scene, whether the camera sees them or not

  bool covered(std::size_t pixel) const { return class_of[pixel] != PixelClass::none; }
  /// Mean over the covered pixels of what one s spans, pixels; 0: nothing is covered.
  double mean_scale() const;
};

/// The truth's own map.
Map map_of(const Truth& truth);

/// Traces the scene at the pixel centres; depths are good to 1e-6 s but for grazing rays.
Truth trace(const Scene& scene, const Lens& lens);

/// Distance of each pixel to the nearest pixel of `set`, pixels; +infinity when `set` is empty.
std::vector<double> distance_to(const std::vector<bool>& set, int width, int height);

}  // namespace meniscus::accuracy
