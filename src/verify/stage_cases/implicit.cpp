// measure_implicit: a crowd of fits of three sheets above particles at random.
#include "stages/closed/implicit.hpp"

#include "stages/frame/relax.hpp"
#include "verify/reference/implicit.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/fits_by_hand.hpp"
#include "verify/stage_cases/into_new.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {
namespace {

// Particles among and below the crowd's feet, and their levelled field.
reference::Fluid fluid_below(unsigned seed) {
  Random random(seed);
  reference::Fluid fluid;
  for (int k = 0; k < 260; ++k)
    add_position(fluid.levelled.particles, {random(-9, 9), random(-7, 7), random(-27, -19)});
  return fluid;
}

// The fluid as if its coordinates had been rounded eight times.
reference::Fluid rounded(const reference::Fluid& fluid, Random& random) {
  reference::Fluid moved = fluid;
  for (std::vector<float>* axis :
       {&moved.levelled.particles.x, &moved.levelled.particles.y, &moved.levelled.particles.z})
    for (float& v : *axis) v += static_cast<float>(8 * kEpsilon * 20 * random(-1, 1));
  return moved;
}

}  // namespace

ReferenceErrors implicit_errors(Device& device, int size, const Disorder& disorder) {
  Parameters params;
  params.disorder = disorder.amount;
  const GivenFits scene = crowd(2);
  reference::Fluid fluid = fluid_below(3);
  fluid.mass = disorder.mass();
  fluid.disorder = disorder.within_cubes();
  const Projected& particles = fluid.levelled.particles;
  const Cells cells = make_cells(particles.x, particles.y, particles.z, kDensitySupport);
  const DeviceCells on_device = upload_cells(device, cells, disorder.mass());
  const DeviceCells levelled = level_cells(device, on_device, params.region);
  fluid.levelled.weight = by_particle(cells, download(device, levelled.weight));

  Random random(13);
  std::vector<ParticleFits> other_fits;
  std::vector<reference::Fluid> other_fluids;
  for (int k = 0; k < 6; ++k) {
    other_fits.push_back(meniscus::rounded(scene, random).fits);
    other_fluids.push_back(rounded(fluid, random));
  }
  const BlendRecords records =
      make_records(scene.fits, scene.trust, params.fit, kBlendReach * params.blend.radius);
  Points points;
  for (int k = 0; k < size; ++k) points.add({random(-10, 10), random(-8, 8), random(-26, -15)});
  const Levels found =
      measure_implicit(device, make_implicit(device, records, levelled, params), points);

  Worst values("measure_implicit", "value"), gradients("measure_implicit", "gradient");
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Vec3d at(points.x[k], points.y[k], points.z[k]);
    const reference::Implicit expected =
        reference::implicit(scene.fits, scene.trust, fluid, at, params);
    // The function's own roundings are those of its inputs over again, see bounded_blend.
    double value_off = 0, gradient_off = 0;
    bool sure = true;
    for (std::size_t o = 0; o < other_fits.size(); ++o) {
      const reference::Implicit other =
          reference::implicit(other_fits[o], scene.trust, other_fluids[o], at, params);
      sure &= other.decisions == expected.decisions;
      value_off = std::max(value_off, std::abs(other.value - expected.value));
      gradient_off = std::max(gradient_off, length(other.gradient - expected.gradient));
    }
    // Sums round once a fit and a particle, a hundred of them at most.
    const double value_error = 4 * value_off + 100 * kEpsilon * 4,
                 gradient_error = 4 * gradient_off + 100 * kEpsilon * 4;
    if (!sure || expected.margin < value_error) continue;
    values.see(found.value[k], expected.value, value_error, 1);
    gradients.see(length(Vec3d(found.gradient[k]) - expected.gradient), 0, gradient_error, 1);
  }
  return {values.error(), gradients.error()};
}

ReferenceErrors implicit_case(Device& device, int size) {
  return implicit_errors(device, size, {});
}

}  // namespace meniscus::verify
