// average_on_sheets: two sheets at a right angle, with fits that count for nothing among them.
#include "verify/stage_cases/sheet.hpp"

#include "verify/reference/sheet.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/inputs.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {

ReferenceErrors sheet_case(Device& device, int size) {
  const auto n = static_cast<std::size_t>(size);
  Random random(7);
  const auto rounded = [](const Vec3d& v) { return Vec3d(Vec3(v)); };
  std::vector<Vec3d> position, normal;
  std::vector<float> share;
  std::vector<std::vector<float>> values(3);
  for (std::size_t i = 0; i < n; ++i) {
    position.push_back(rounded({random(-9, 9), random(-9, 9), random(-31, -29)}));
    normal.push_back(
        rounded(normalized({i % 2 ? 1.0 : 0.0, random(-0.3, 0.3), i % 2 ? 0.0 : 1.0})));
    share.push_back(i % 5 == 4 ? 0 : static_cast<float>(random(0.1, 1)));
    for (std::vector<float>& value : values) value.push_back(static_cast<float>(random(0.5, 2)));
  }
  if (n > 2) {  // two alone, all but as far from each other as one reaches
    position[0] = {-100, 0, -30};
    position[1] = position[0] + Vec3d{5 - 0x1p-16, 0, 0};
    normal[1] = normal[0];
    share[0] = share[1] = 1;
  }
  std::vector<Worst> means;
  for (const char* of : {"first mean", "second mean", "third mean"})
    means.emplace_back("average_on_sheets", of);
  Worst alone("average_on_sheets", "mean of one value");
  // As trust takes them (docs/method.md), and a narrow one.
  for (const SheetWeights weights : {SheetWeights{5, 0.4f, 0.6f}, SheetWeights{2.5f, 0.8f, 0.9f}}) {
    const auto found = average_on_sheets(device, position, normal, share, values, weights);
    const auto of_one = average_on_sheets(device, position, normal, share, {values[0]}, weights);
    for (std::size_t k = 0; k < n; ++k)
      for (std::size_t v = 0; v < values.size(); ++v) {
        const auto expected = reference::sheet_mean(position, normal, share, values[v], k, weights);
        // Next to nothing may be nothing in floats.
        if (expected.weight > 0 && expected.weight < 1e-3) continue;
        means[v].see(found[v][k], expected.mean, expected.error, 1);
        if (v == 0) alone.see(of_one[0][k], expected.mean, expected.error, 1);
      }
  }
  return {means[0].error(), means[1].error(), means[2].error(), alone.error()};
}

}  // namespace meniscus::verify
