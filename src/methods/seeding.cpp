#include "methods/seeding.hpp"

#include <algorithm>
#include <utility>

#include "stages/fit/particle_fit.hpp"
#include "stages/sheet/merge.hpp"

namespace meniscus {
namespace {

FitNeighbours neighbours_of(const FitFrame& frame, const Fluid& fluid, const Visible& places,
                            const std::vector<std::int32_t>& around) {
  return find_neighbours(frame.device, fluid.particles, places, around,
                         fit_reach(frame.params.fit));
}

double trial_reach(const Parameters&) { return kTrialReach; }

// Of places that come from the rim when its roundness is known: nothing is looked for before.
FitNeighbours look_later(const FitFrame&, const Fluid&, const Shell&) { return {}; }

}  // namespace

const Seeding kEveryParticle{
    &Counts::fits,
    kRimReach,
    false,
    trial_reach,
    [](const FitFrame& frame, const Fluid& fluid, const Shell& shell) {
      return neighbours_of(frame, fluid, shell.rim, shell.found.index);
    },
    [](const FitFrame&, const Fluid&, Shell& shell, const SurfaceParticles&) {
      return Seeds{shell.rim, std::move(shell.fitted), {}};
    },
};

const Seeding kSeenParticles{
    &Counts::fits,
    kRimReach,
    false,
    trial_reach,
    look_later,
    [](const FitFrame& frame, const Fluid& fluid, Shell& shell, const SurfaceParticles& around) {
      Visible seen = more_visible(shell.rim, kLeastFitted);
      FitNeighbours neighbours = neighbours_of(frame, fluid, seen, around.index);
      return Seeds{std::move(seen), std::move(neighbours), {}};
    }};

const Seeding kMergedGroups{
    &Counts::groups,
    kRimReachGroups,
    true,
    [](const Parameters& params) { return std::max(kTrialReach, merge_reach(params.merge)); },
    look_later,
    [](const FitFrame& frame, const Fluid& fluid, Shell& shell, const SurfaceParticles& around) {
      frame.clock.start("merge");
      MergedGroups groups = merge_particles(frame.view, fluid.particles, shell.rim, around,
                                            shell.near, frame.params.merge);
      frame.clock.start("fit");
      FitNeighbours neighbours = neighbours_of(frame, fluid, groups.seed, around.index);
      return Seeds{std::move(groups.seed), std::move(neighbours), std::move(groups.extent)};
    }};

}  // namespace meniscus
