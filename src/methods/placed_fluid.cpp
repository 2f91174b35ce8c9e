#include "methods/placed_fluid.hpp"

#include <utility>

#include "stages/closed/voids.hpp"
#include "stages/frame/density.hpp"

namespace meniscus {
namespace {

static_assert(kRelaxReach == kDensitySupport);  // the same cells serve both

Cells cells_of(const Projected& particles) {
  return make_cells(particles.x, particles.y, particles.z, kDensitySupport);
}

void even_out(PlacedFluid& fluid) {
  if (fluid.disorder.amount == 0) return;
  fluid.host_cells = {};  // which take room, and are made anew
  even_out(fluid.particles, fluid.disorder);
  fluid.host_cells = cells_of(fluid.particles);
  if (const bool on_screen = !fluid.particles.u.empty(); on_screen)
    project_again(fluid.view, fluid.particles);
}

}  // namespace

PlacedFluid place_fluid(const View& view, const Parameters& params, StageClock& clock,
                        const std::function<Projected(const View& view)>& place) {
  PlacedFluid fluid;
  const auto place_in = [&](const View& in) {
    fluid.view = in;
    clock.start("project");
    fluid.particles = place(in);
    clock.start("split");
    fluid.host_cells = cells_of(fluid.particles);
    clock.start("relax");
  };
  place_in(view);
  fluid.disorder = find_disorder(fluid.particles, fluid.host_cells, params);
  if (fluid.disorder.unit() > 1) place_in(coarser(view, fluid.disorder.unit()));
  even_out(fluid);
  return fluid;
}

PlacedFluid evened_fluid(const View& view, const Disorder& disorder, Projected particles) {
  Cells cells = cells_of(particles);
  return {view, disorder, std::move(particles), std::move(cells)};
}

std::optional<PlacedFluid> with_voids(const PlacedFluid& fluid) {
  if (fluid.disorder.anywhere() == 0) return {};
  const std::vector<Vec3d> voids = find_voids(fluid.host_cells, fluid.disorder);
  if (voids.empty()) return {};
  PlacedFluid filled{fluid.view, fluid.disorder, fluid.particles, {}};
  Projected& particles = filled.particles;
  for (const Vec3d& at : voids) {
    particles.index.push_back(static_cast<std::uint32_t>(particles.size()));
    particles.scale.push_back(1);
    add_position(particles, at);
  }
  filled.host_cells = cells_of(particles);
  return filled;
}

double filling_influence(const Disorder& disorder) {
  return disorder.anywhere() == 0 ? 0 : void_influence(disorder);
}

}  // namespace meniscus
