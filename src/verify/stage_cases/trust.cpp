// measure_edges: what is measured around the fits of a surface, given the fits themselves.
#include "stages/fit/trust.hpp"

#include "verify/reference/trust.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/mesh_by_hand.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {

ReferenceErrors trust_case(Device& device, int size) {
  Worst dense("measure_edges", "density at feet"), deep("measure_edges", "density behind them"),
      apart("measure_edges", "spread");
  for (const auto& surface : {hills, roof}) {
    const FittedSurface scene = fitted_surface(field(size, 2, surface));
    const Projected& p = scene.projected;
    const FitNeighbours neighbours =
        find_neighbours(device, p, scene.seen, scene.around.index, fit_reach({}));
    DeviceFits made = make_fits(device, upload_surface(device, p, scene.around), p, scene.seen,
                                scene.around, neighbours, {});
    measure_surroundings(device, upload_cells(device, make_cells(p.x, p.y, p.z, kDensitySupport)),
                         made);
    const ParticleFits fits = download(device, std::move(made));
    const auto expected = reference::surroundings_of(p, fits);
    for (std::size_t k = 0; k < fits.size(); ++k) {
      if (expected[k].dense.weight < 1e-3) continue;  // next to nothing may be nothing in floats
      dense.see(fits.dense[k], expected[k].dense.mean, expected[k].dense.error, 1);
      deep.see(fits.deep[k], expected[k].deep.mean, expected[k].deep.error, 1);
      apart.see(fits.apart[k], expected[k].apart.mean, expected[k].apart.error, 1);
    }
  }
  return {dense.error(), deep.error(), apart.error()};
}

}  // namespace meniscus::verify
