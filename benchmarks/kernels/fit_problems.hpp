// The fits of method fit's first pass, as the native versions take them.
#pragma once

#include <memory>
#include <vector>

#include "kernels/frame.hpp"
#include "kernels/native/native.hpp"
#include "kernels/workers.hpp"
#include "stages/fit.hpp"

namespace meniscus::bench {

struct FitProblems {
  FitBatches batches;
  std::vector<std::int32_t> particle, neighbour;  // as particle_fit.cl has them
  std::vector<float> record, scale;               // [n][8], [lanes]
  std::vector<float> points, quadric, quality;    // [7][slots], [10][lanes], [2][lanes]
  double fits = 0, neighbours = 0;                // neighbours of all fits together
  native::Neighbours weighing{};
  native::Fits fitting{};
};

/// Every fitted particle of the frame with its neighbours, in the order in which fit_particles
/// takes them. The points are not weighed yet.
std::shared_ptr<FitProblems> fit_problems(Frame& frame);

void weigh(const FitProblems& problems, Workers& workers);
void fit(const FitProblems& problems, Workers& workers);

}  // namespace meniscus::bench
