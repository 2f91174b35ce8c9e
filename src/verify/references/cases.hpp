// The cases of references.hpp, one function a stage.
#pragma once

#include "stages/relax.hpp"
#include "verify/references.hpp"

namespace meniscus::verify {

using ReferenceErrors = std::vector<ReferenceError>;

ReferenceErrors bins_case(Device& device, int size);
ReferenceErrors visible_case(Device& device, int size);
ReferenceErrors minima_case(Device& device, int size);
ReferenceErrors density_case(Device& device, int size);
ReferenceErrors motion_case(Device& device, int size);
ReferenceErrors particle_fit_case(Device& device, int size);
ReferenceErrors roundness_case(Device& device, int size);
ReferenceErrors trust_case(Device& device, int size);
ReferenceErrors blend_case(Device& device, int size);
ReferenceErrors stable_case(Device& device, int size);
ReferenceErrors choose_groups_case(Device& device, int size);
ReferenceErrors implicit_case(Device& device, int size);
/// The same of particles of this disorder.
ReferenceErrors implicit_errors(Device& device, int size, const Disorder& disorder);
ReferenceErrors interpolate_case(Device& device, int size);
ReferenceErrors behind_case(Device& device, int size);
ReferenceErrors region_case(Device& device, int size);
ReferenceErrors sheet_case(Device& device, int size);
ReferenceErrors settle_case(Device& device, int size);
/// The weights of the levelled field, of particles of this disorder.
ReferenceErrors weight_errors(Device& device, int size, const Disorder& disorder);
ReferenceErrors specks_case(Device& device, int size);
ReferenceErrors paper_case(Device& device, int size);
ReferenceErrors printed_case(Device& device, int size);
ReferenceErrors fairing_case(Device& device, int size);
ReferenceErrors ssm_case(Device& device, int size);
ReferenceErrors spheres_case(Device& device, int size);
ReferenceErrors filter_case(Device& device, int size);
ReferenceErrors whitewater_case(Device& device, int size);

}  // namespace meniscus::verify
