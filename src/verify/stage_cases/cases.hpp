// The cases of stage_cases.hpp, one function a stage.
#pragma once

#include "stages/frame/relax.hpp"
#include "stages/other_methods/ssm.hpp"
#include "stages/sample/samples.hpp"
#include "stages/view.hpp"
#include "verify/stage_cases.hpp"

namespace meniscus::verify {

class Worst;
using ReferenceErrors = std::vector<ReferenceError>;

ReferenceErrors bins_case(Device& device, int size);
ReferenceErrors visible_case(Device& device, int size);
/// The same of discs with such a footprint and bulge, drawn on a grid.
void see_splats(Device& device, const Projected& discs, const SampleGrid& grid, double footprint,
                double bulge, Worst& worst);
ReferenceErrors minima_case(Device& device, int size);
ReferenceErrors density_case(Device& device, int size);
/// The same of `n` particles, and of so many points beside them.
ReferenceErrors density_errors(Device& device, std::size_t n, std::size_t points);
ReferenceErrors motion_case(Device& device, int size);
/// The same of `n` particles, of so many points beside them and of a camera's samples.
ReferenceErrors motion_errors(Device& device, std::size_t n, std::size_t points,
                              const Camera& camera);
ReferenceErrors particle_fit_case(Device& device, int size);
ReferenceErrors roundness_case(Device& device, int size);
ReferenceErrors trust_case(Device& device, int size);
ReferenceErrors blend_case(Device& device, int size);
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
/// The same of a map, for cells of so many pixels.
ReferenceErrors ssm_errors(Device& device, const View& view, const SampleGrid& grid,
                           const std::vector<float>& depth, const SsmParams& params, double cell);
ReferenceErrors spheres_case(Device& device, int size);
ReferenceErrors filter_case(Device& device, int size);
/// The same of the bilateral and the narrow-range filter on a grid; sigma in particle radii.
ReferenceErrors filter_errors(Device& device, const View& view, const SampleGrid& grid,
                              double sigma);
ReferenceErrors whitewater_case(Device& device, int size);

}  // namespace meniscus::verify
