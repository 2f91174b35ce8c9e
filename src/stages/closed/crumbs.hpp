// crumbs: pieces of a closed mesh that are too small to be fluid, or air in it.
#pragma once

#include <cstdint>
#include <vector>

#include "stages/closed/dual_mesh.hpp"

namespace meniscus {

/// Leaves out pieces of the mesh that enclose less fluid, or less air, than so much (particle radii
/// cubed), and the vertices that are theirs. Open pieces stay. Returns which vertices are left,
/// ascending.
std::vector<std::uint32_t> drop_crumbs(DualMesh& mesh, double least_fluid, double least_air);

}  // namespace meniscus
