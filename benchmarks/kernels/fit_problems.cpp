#include "kernels/fit_problems.hpp"

#include "stages/particle_fit.hpp"

namespace meniscus::bench {
std::shared_ptr<FitProblems> fit_problems(Frame& frame) {
  const auto problems = std::make_shared<FitProblems>();
  const Projected& projected = frame.projected();
  const SurfaceParticles& surface = frame.surface();
  const std::vector<std::int32_t>& fitted = frame.rim().index;
  const FitParams& params = frame.params.fit;
  problems->record = particle_records(projected, surface);

  const Cells cells = cells_of(projected, surface.index, params.support);
  const float squared = static_cast<float>(params.support * params.support);
  std::vector<std::vector<std::int32_t>> near(fitted.size());
  std::vector<std::size_t> sizes;
  for (std::size_t k = 0; k < fitted.size(); ++k) {
    const std::size_t i = static_cast<std::size_t>(fitted[k]);
    const float x = projected.x[i], y = projected.y[i], z = projected.z[i];
    visit_near(cells, x, y, z, [&](std::int32_t p) {
      const float dx = cells.x[p] - x, dy = cells.y[p] - y, dz = cells.z[p] - z;
      if (dx * dx + dy * dy + dz * dz < squared) near[k].push_back(cells.item[p]);
      return true;
    });
    sizes.push_back(near[k].size());
    problems->neighbours += static_cast<double>(near[k].size());
  }
  problems->fits = static_cast<double>(fitted.size());

  FitBatches& batches = problems->batches = make_batches(sizes).front();
  const std::vector<std::int32_t> place = places_in(surface.index, fitted);
  problems->particle.assign(batches.lanes, -1);
  problems->neighbour.assign(batches.slots, -1);
  for (std::size_t lane = 0; lane < fitted.size(); ++lane) {
    const std::size_t k = static_cast<std::size_t>(batches.order[lane]);
    problems->particle[lane] = place[k];
    std::size_t slot = batches.first_slot(lane);
    for (const std::int32_t j : near[k]) {
      problems->neighbour[slot] = j;
      slot += 8;
    }
  }
  problems->scale.assign(batches.lanes, static_cast<float>(params.support));
  problems->points.assign(7 * batches.slots, 0.0f);
  problems->quadric.assign(10 * batches.lanes, 0.0f);
  problems->quality.assign(2 * batches.lanes, -1.0f);
  problems->weighing = {problems->record.data(),
                        problems->particle.data(),
                        problems->neighbour.data(),
                        batches.first.data(),
                        batches.length.data(),
                        problems->scale.data(),
                        problems->points.data(),
                        batches.slots,
                        static_cast<float>(2 / (params.normal_sigma * params.normal_sigma)),
                        0.6f,  // h_0 and h_1 of particle_fit.cpp
                        0.075f};
  problems->fitting = {problems->points.data(),
                       batches.first.data(),
                       batches.length.data(),
                       problems->scale.data(),
                       problems->quadric.data(),
                       problems->quality.data(),
                       batches.slots,
                       batches.lanes,
                       static_cast<float>(params.off_surface),
                       static_cast<float>(params.tau),
                       static_cast<float>(params.ridge)};
  return problems;
}

void weigh(const FitProblems& problems, Workers& workers) {
  workers.run(problems.batches.length.size(), 4, [&](std::size_t begin, std::size_t end) {
    native::weigh_neighbours(problems.weighing, begin, end);
  });
}

void fit(const FitProblems& problems, Workers& workers) {
  workers.run(problems.batches.length.size(), 4, [&](std::size_t begin, std::size_t end) {
    native::fit_groups(problems.fitting, begin, end);
  });
}

}  // namespace meniscus::bench
