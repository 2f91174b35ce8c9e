#include "kernels/fit_problems.hpp"

#include <algorithm>

namespace meniscus::bench {

std::shared_ptr<FitProblems> fit_problems(Frame& frame) {
  const auto problems = std::make_shared<FitProblems>();
  const SurfaceParticles& surface = frame.surface();
  const std::vector<std::int32_t>& fitted = frame.rim().index;
  const FitParams& params = frame.params.fit;
  const FitSurface on_device = upload_surface(frame.device, frame.projected(), surface);
  problems->place = download(frame.device, on_device.place);
  problems->turned = problems->normal = download(frame.device, on_device.normal);
  const NeighbourLists& lists = problems->lists =
      list_neighbours(frame.projected(), fitted, surface.index, fit_reach(params),
                      std::size_t{1} << 28)
          .front();
  const cl_int nobody = static_cast<cl_int>(surface.index.size());
  problems->fits = static_cast<double>(fitted.size());
  problems->neighbours = static_cast<double>(
      lists.neighbour.size() -
      static_cast<std::size_t>(std::count(lists.neighbour.begin(), lists.neighbour.end(), nobody)));
  const std::size_t lanes = lists.fit.size();
  problems->support.assign(lanes, static_cast<float>(params.support));
  problems->quadric.assign(10 * lanes, 0.0f);
  problems->residual.assign(lanes, -1.0f);
  problems->weight.assign(lists.neighbour.size(), 0.0f);
  problems->input = {
      problems->place.data(),
      problems->normal.data(),
      lists.particle.data(),
      lists.neighbour.data(),
      lists.first.data(),
      lists.length.data(),
      problems->support.data(),
      problems->quadric.data(),
      problems->residual.data(),
      problems->weight.data(),
      problems->turned.data(),
      lanes,
      nobody,
      2.0f / (static_cast<float>(params.normal_sigma) * static_cast<float>(params.normal_sigma)),
      0.6f,  // h_0 and h_1 of particle_fit.cpp
      0.075f,
      static_cast<float>(params.off_surface),
      static_cast<float>(params.ridge)};
  return problems;
}

void fit(const FitProblems& problems, Workers& workers) {
  workers.run(problems.lists.length.size(), 4, [&](std::size_t begin, std::size_t end) {
    native::fit_particles(problems.input, begin, end);
  });
}

}  // namespace meniscus::bench
