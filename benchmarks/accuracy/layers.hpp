// How right the layers along rays are: where they leave the fluid, how much of it they cross.
#pragma once

#include <cstdint>
#include <vector>

#include "accuracy/scene.hpp"
#include "meniscus/types.hpp"

namespace meniscus::accuracy {

/// Where a ray is in the solid: depths, s.
struct TrueInterval {
  double entry, exit;
};

/// All rays of a camera through a solid.
struct TrueLayers {
  Lens lens;
  std::vector<std::vector<TrueInterval>> intervals;  // [height*width] nearest first
  std::vector<Vec3d> back_normal;                    // [height*width] at the first exit; 0
  /// Within 1.5 s of a pixel beside which the number of intervals changes, or one of their ends by
  /// more than one s.
  std::vector<bool> outline;
  /// Within 1.5 s of a pixel beside which the normal at the first exit turns by more than 18
  /// degrees.
  std::vector<bool> crease;
};

/// Follows every ray in steps of at most a quarter s, and no more than the distance from the
/// surface; ends are good to 1e-6 s. Of a scene without splash.
TrueLayers trace_layers_of(const Scene& scene, const Lens& lens);

/// Over the pixels that the truth and the surface cover; lengths in s.
struct LayerFigures {
  std::int64_t pixels = 0;   // covered by both
  std::int64_t inner = 0;    // of these, away from outlines
  double thickness_rms = 0;  // over inner pixels, along rays
  double thickness_999 = 0;  // 99.9th percentile of the same errors
  double front_rms = 0;  // of the first entry, which is the front, along rays, over inner pixels
  double back_rms = 0;   // of the first exit along its normal, over inner pixels
  double normal_median = 0;  // of the first exit, degrees, over inner pixels without creases
  double normal_95 = 0;
  double second_right = 0;        // share of all pixels whose second body is as in truth: none, or
                                  // one whose ends both lie within half an s along rays
  double second_right_inner = 0;  // the same over inner pixels
  double number_right = 0;        // share of all pixels with the right number of bodies
  double films = 0;               // share of all pixels whose first body is thinner than .02 s
};

/// Throws InvalidArgument for a surface with fewer than two layers a pixel.
LayerFigures measure_layers(const TrueLayers& truth, const Surface& surface);

}  // namespace meniscus::accuracy
