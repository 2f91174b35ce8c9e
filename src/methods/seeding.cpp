#include "methods/seeding.hpp"

#include <algorithm>
#include <utility>

#include "stages/fit/particle_fit.hpp"
#include "stages/sheet/merge.hpp"

namespace meniscus {
namespace {

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
      return find_neighbours(frame.device, fluid.particles, shell.rim, shell.found.index,
                             fit_reach(frame.params.fit));
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
      FitNeighbours neighbours = find_neighbours(frame.device, fluid.particles, seen, around.index,
                                                 fit_reach(frame.params.fit));
      return Seeds{std::move(seen), std::move(neighbours), {}};
    }};

const Seeding kMergedGroups{
    &Counts::groups,
    kRimReachGroups,
    true,
    [](const Parameters& params) { return std::max(kTrialReach, merge_reach(params.merge)); },
    look_later,
    [](const FitFrame& frame, const Fluid& fluid, Shell& shell, const SurfaceParticles& around) {
      const auto& [device, view, params, clock] = frame;
      clock.start("merge");
      MergedGroups groups =
          merge_particles(view, fluid.particles, shell.rim, around, shell.near, params.merge);
      clock.start("fit");
      FitNeighbours neighbours = find_neighbours(device, fluid.particles, groups.seed, around.index,
                                                 fit_reach(params.fit));
      return Seeds{std::move(groups.seed), std::move(neighbours), std::move(groups.extent)};
    }};

}  // namespace meniscus
