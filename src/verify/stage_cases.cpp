#include "verify/stage_cases.hpp"

#include <cmath>

#include "base/printed.hpp"
#include "verify/stage_cases/cases.hpp"

namespace meniscus::verify {

const std::vector<StageCase>& stage_cases() {
  static const std::vector<StageCase> cases{
      {"bins", {3, 61}, bins_case},
      {"visible", {1, 63, 130}, visible_case},
      {"minima", {1, 63, 130}, minima_case},
      {"density", {0, 1, 65, 700}, density_case},
      {"motion", {0, 1, 65, 900}, motion_case},
      {"particle_fit", {4, 11}, particle_fit_case},
      {"roundness", {4, 11}, roundness_case},
      {"trust", {4, 11}, trust_case},
      {"blend", {9, 37}, blend_case},
      {"implicit", {1, 65, 600}, implicit_case},
      {"interpolate", {5, 67}, interpolate_case},
      {"choose_groups", {9, 61}, choose_groups_case},
      {"sheet", {1, 63, 400}, sheet_case},
      {"region", {5, 13}, region_case},
      {"behind", {40, 300}, behind_case},
      {"settle", {13, 37}, settle_case},
      {"specks", {3, 21, 71}, specks_case},
      {"fairing", {3, 21, 71}, fairing_case},
      {"paper", {3, 7, 8, 40}, paper_case},
      {"paper blend", {9, 53}, printed_case},
      {"ssm", {1, 21, 53}, ssm_case},
      {"spheres", {1, 21, 67}, spheres_case},
      {"filter", {1, 17, 37}, filter_case},
      {"whitewater", {1, 65, 700}, whitewater_case},
  };
  return cases;
}

std::string error_in_words(double ulp) {
  return std::isfinite(ulp) ? three_digits(ulp) + " ulp" : "infinitely many ulp";
}

}  // namespace meniscus::verify
