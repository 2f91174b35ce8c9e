// How straight the lines of a map are: its silhouettes and its creases, against the truth's.
//
// A line point is a pixel next to a true line. There a field is +1/2 on one side of the true line
// and -1/2 on the other:
//
//   silhouette  whether the pixel's depth is nearer than a threshold: infinity at the end of the
//               surface, half-way between the two layers at a depth jump over s
//   crease      n.(n1 - n2) / |n1 - n2|^2, with n1 and n2 the normals of the two true faces and n
//               the map's own normal (or, without, that of its slope)
//
// Both fields, the truth's and the map's, are blurred by a Gaussian of 0.7 pixels, which gives
// their zeros a place between pixels, and both are crossed along the true line's normal. The
// deviation is the distance from the truth's crossing to the nearest one of the map in the same
// sense, at most 1.5 s away, in s.
//
// Its smooth part is the line fitted by least squares to the deviations within 2 s along the true
// line; jaggedness is the RMS of what is left. Waves along the line of up to 4 s count whole, of
// 8 s by a third, longer ones hardly; a line that is displaced or tilted has no jaggedness.
#pragma once

#include "accuracy/figures/statistics.hpp"
#include "accuracy/map.hpp"
#include "accuracy/truth.hpp"

namespace meniscus::accuracy {

struct Straightness {
  double jag = kNone;   // s; NaN: no lines
  double lost = kNone;  // percent of the line points without a crossing of the map
};

/// Splash has too short an outline to be straight, and is left out.
Straightness outline_straightness(const Truth& truth, const Map& map);

/// Creases are where the true normal jumps; not those within 1.5 s of an outline.
Straightness crease_straightness(const Truth& truth, const Map& map);

}  // namespace meniscus::accuracy
