// Whether single particles and small clusters are there, whole and once.
#pragma once

#include "accuracy/figures/statistics.hpp"
#include "accuracy/map.hpp"
#include "accuracy/truth.hpp"

namespace meniscus::accuracy {

struct Splash {
  double covered = kNone;  // percent of the pieces with half of their pixels at the right depth
  double missing = kNone;  // pieces without a single pixel at the right depth
  double doubled = kNone;  // pieces with more pieces of the map than of the truth around them
  double closed = kNone;   // percent of the pieces that are in one piece and without a hole
};

/// A pixel is at the right depth when it is within s of the truth's. `piece` names the truth's
/// piece of splash at each pixel, -1 where there is none; only pieces of more than 8 visible pixels
/// count.
///
/// Pieces of the map hang together as find_layers has it. One of more than 8 pixels belongs to the
/// piece of splash it has most pixels of, or else to the one within s of it, provided that not half
/// of it lies on other surface of the truth. A piece is closed when its pixels at the right depth
/// are in as many pieces as the truth's, and enclose none that are not.
Splash splash_figures(const Truth& truth, const Map& map);

}  // namespace meniscus::accuracy
