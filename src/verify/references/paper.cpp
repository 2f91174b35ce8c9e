// fit_heights: a height field over one group, against its normal equations.
#include "stages/paper.hpp"

#include "verify/reference/paper.hpp"
#include "verify/references/cases.hpp"
#include "verify/references/mesh_by_hand.hpp"
#include "verify/references/worst.hpp"

namespace meniscus::verify {

ReferenceErrors paper_case(Device& device, int size) {
  const FitParams params;
  const Triangulation mesh = bumps(static_cast<std::size_t>(size), static_cast<unsigned>(size));
  const Groups groups = one_group(mesh);
  const Quadrics quadrics = fit_heights(device, mesh, groups, params);
  const auto left = reference::height_residuals(mesh.position, groups.centre[0], groups.radius[0],
                                                quadrics.coefficient[0], params);
  Worst equation("fit_heights", "normal equations"), residual("fit_heights", "residual");
  for (int k = 0; k < left.terms; ++k) equation.see(left.error[k], 0, left.bound[k], left.size[k]);
  residual.see(quadrics.residual[0], left.rms, left.rms_bound, groups.radius[0]);
  return {equation.error(), residual.error()};
}

}  // namespace meniscus::verify
