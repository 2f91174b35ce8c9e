// The fits of method fit's first pass, as the native version takes them.
#pragma once

#include <memory>
#include <vector>

#include "kernels/frame.hpp"
#include "kernels/native/native.hpp"
#include "kernels/workers.hpp"
#include "stages/fit/particle_fit.hpp"

namespace meniscus::bench {

struct FitProblems {
  std::vector<float> place, normal;  // [n + 1][4] as in FitSurface
  NeighbourLists lists;
  std::vector<float> support, quadric, residual;  // [lanes], [10][lanes], [lanes]
  std::vector<float> weight, turned;              // [slots], [n + 1][4]
  double fits = 0, neighbours = 0;                // neighbours of all fits together
  native::Fits input{};
};

/// Every fitted particle of the frame with its neighbours. Nothing is fitted yet.
std::shared_ptr<FitProblems> fit_problems(Frame& frame);

void fit(const FitProblems& problems, Workers& workers);

}  // namespace meniscus::bench
