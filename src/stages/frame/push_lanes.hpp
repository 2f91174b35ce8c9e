// push_lanes: the forces of relax.hpp, eight particles at a time.
#pragma once

#include <vector>

#include "stages/frame/lane_lists.hpp"

namespace meniscus {

/// Where particles are, in bucket order, with kListLanes - 1 values more than there are particles.
struct Places {
  std::vector<float> x, y, z;
};

/// A force between pairs d apart, (1 - rest d^2) (1 - far d^2)^4 times their distance.
struct PairForce {
  float far, rest;  // 1 / squared distances: where it ends, where it vanishes
  float step;       // how far it moves particles
};

/// One round, counted from 0, for the particles of a block: from where all are to where these go,
/// by the force of those that are near in the lists. Groups of fewer rounds are left out.
using PushLanes = void(const LaneLists::Block& block, const PairForce& force, int round,
                       const Places& from, Places& to);

/// Those that this processor can run, all with the same result, the fastest first.
std::vector<PushLanes*> lane_pushers();

}  // namespace meniscus
