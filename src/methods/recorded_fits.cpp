#include "methods/recorded_fits.hpp"

#include "stages/fit/faces.hpp"

namespace meniscus {

RecordedFits record_fits(const ParticleFits& fits, const std::vector<double>& trust,
                         const Parameters& params) {
  const double radius = kBlendReach * params.blend.radius;
  const auto [faces, trust_of_faces] = faces_beside_edges(fits, trust, params.fit.offset);
  RecordedFits made{make_records(fits, trust, params.fit, radius), fits.residual};
  append(made.records, make_records(faces, trust_of_faces, params.fit, radius));
  // Groups' weights are wider than bends are known: outlines would lie outside.
  if (fits.extent.empty()) lift_bends(made.records);
  made.residual.insert(made.residual.end(), faces.residual.begin(), faces.residual.end());
  return made;
}

}  // namespace meniscus
