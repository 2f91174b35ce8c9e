// measure_density and measure_gradients: scattered particles, and points among and beside them.
#include "stages/frame/density.hpp"

#include "verify/reference/settle.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/inputs.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {

ReferenceErrors density_case(Device& device, int size) {
  const auto n = static_cast<std::size_t>(size);
  return density_errors(device, n, n / 2 + 3);
}

ReferenceErrors density_errors(Device& device, std::size_t n, std::size_t beside) {
  const Projected p = scattered(n, 8, static_cast<unsigned>(n));
  const Cells cells = make_cells(p.x, p.y, p.z, kDensitySupport);
  const DeviceCells on_device = upload_cells(device, cells);

  std::vector<Vec3d> points;
  Random random(2);
  for (std::size_t k = 0; k < beside; ++k)
    points.push_back(
        Vec3d(Vec3{static_cast<float>(random(-10, 10)), static_cast<float>(random(-10, 10)),
                   static_cast<float>(random(-30, -10))}));
  for (std::size_t i = 0; i < n; ++i) points.push_back(p.eye(i));
  const std::vector<float> densities = measure_density(device, on_device, points);
  Worst density("measure_density", "density");
  // A share near the end of its reach is the small difference of numbers up to 1.
  for (std::size_t k = 0; k < points.size(); ++k) {
    const double expected = reference::density(p, points[k]);
    density.see(densities[k], expected, reference::density_error(p, points[k], expected), 1);
  }

  const std::vector<float> found = download(device, measure_gradients(device, on_device));
  const reference::Field field{p, std::vector<double>(n, 1)};
  Worst gradient("measure_gradients", "gradient"), own("measure_gradients", "density");
  for (std::size_t k = 0; k < n; ++k) {
    const Vec3d at = p.eye(static_cast<std::size_t>(cells.item[k])), expected = field.gradient(at);
    const double bound = reference::gradient_error(p, at);
    gradient.see(found[k], expected.x, bound, 1);
    gradient.see(found[n + k], expected.y, bound, 1);
    gradient.see(found[2 * n + k], expected.z, bound, 1);
    const double exact = reference::density(p, at);
    own.see(found[3 * n + k], exact, reference::density_error(p, at, exact), 1);
  }
  return {density.error(), gradient.error(), own.error()};
}

}  // namespace meniscus::verify
