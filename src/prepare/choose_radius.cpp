#include "prepare/choose_radius.hpp"

#include <algorithm>

#include "base/printed.hpp"
#include "base/team.hpp"
#include "meniscus/error.hpp"
#include "prepare/canonical_order.hpp"
#include "prepare/collect.hpp"
#include "prepare/survey.hpp"

namespace meniscus {
namespace {

// Frames of more particles must say how large they are: an estimate looks at each many times.
constexpr std::int64_t kMostEstimated = std::int64_t{1} << 22;

Notice radii_differ(const RadiusClues& clues) {
  return {.code = Code::other,
          .text = printed("the particles' radii run from %.6g to %.6g, but a surface is made of "
                          "particles of one radius: their median, %.6g, is used for all (give ",
                          clues.least, clues.most, clues.middle) +
                  setting("particle-radius") + " to choose it)",
          .found = clues.middle};
}

RadiusEstimate estimate_of(const ParticleSource& source) {
  if (source.size() >= kMostEstimated)
    throw InputError(
        Notice{.code = Code::radius_needed,
               .text = "no particle radius is given, and with " + std::to_string(source.size()) +
                       " particles it is not estimated (give " + setting("particle-radius") + ")",
               .count = source.size()});
  const Particles all = read_all(source);
  Notices repeated;  // of what is reported elsewhere
  RadiusEstimate estimate;
  if (source.team().leads()) estimate = estimate_radius(all, canonical_order(all, {}, repeated));
  return source.team().from_first(estimate);
}

}  // namespace

bool draws_own_sizes(const Parameters& params, const RadiusClues& clues, double radius) {
  constexpr double kAlike = 1.5;
  return draws_spheres(params.method) ||
         (clues.most <= kAlike * radius && radius <= kAlike * clues.least);
}

double choose_radius(const Parameters& params, const RadiusClues& clues,
                     const std::function<RadiusEstimate()>& estimate, Notices& notices) {
  if (params.particle_radius > 0) return params.particle_radius;
  if (clues.middle > 0) {
    if (!draws_own_sizes(params, clues, clues.middle)) notices.add(radii_differ(clues));
    return clues.middle;
  }
  if (clues.stated > 0) return clues.stated;
  if (!estimate) return 1;
  const RadiusEstimate made = estimate();
  if (!(made.radius > 0)) {
    notices.add({.code = Code::radius_assumed,
                 .text = "no particle radius is given, and none can be estimated: 1 is "
                         "used (give " +
                         setting("particle-radius") + ")",
                 .found = 1});
    return 1;
  }
  constexpr double kSure = 1.1;  // the most over the least
  // Where fluid is compressed, as in splashsurf's dam breaks, estimates are 6 and 8 % too small.
  constexpr double kLeastError = 10;  // %
  const std::string range =
      made.most > kSure * made.least
          ? printed(", which is uncertain, since the fluid is thin or loose: %.3g to %.3g",
                    made.least, made.most)
          : printed(", to within %.0f %%",
                    std::max(kLeastError, 50 * (made.most / made.least - 1)));
  notices.add({.code = Code::radius_estimated,
               .text = "no particle radius is given: estimated " + printed("%.6g", made.radius) +
                       " from the spacing" + range + " (give " + setting("particle-radius") +
                       " to override)",
               .found = made.radius});
  return made.radius;
}

RadiusClues clues_of(const Survey& survey, const ParticleSource& source) {
  return {survey.least_radius, survey.middle_radius, survey.largest_radius,
          source.particle_radius()};
}

double choose_radius(const ParticleSource& source, const Parameters& params, Notices& notices) {
  const Survey& survey = survey_of(source);
  Notices repeated;  // of what is reported elsewhere
  report_dropped(survey.size - survey.finite, survey.size, survey.first_bad, {}, repeated);
  std::function<RadiusEstimate()> estimate;
  if (survey.finite > 0) estimate = [&] { return estimate_of(source); };
  return choose_radius(params, clues_of(survey, source), estimate, notices);
}

}  // namespace meniscus
