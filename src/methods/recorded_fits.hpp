// What a surface is computed from: the fits and the faces that stand in for bevels.
#pragma once

#include <vector>

#include "meniscus/parameters.hpp"
#include "stages/fit/particle_fit.hpp"
#include "stages/sample/blend.hpp"

namespace meniscus {

/// The records of fits and, behind them, of the faces beside their bevels (faces.hpp).
struct RecordedFits {
  BlendRecords records;
  std::vector<float> residual;  // [records] particle radii; negative: no fit
};

///   trust  [fits] 0 .. 1
RecordedFits record_fits(const ParticleFits& fits, const std::vector<double>& trust,
                         const Parameters& params);

}  // namespace meniscus
