#include "prepare/sampled_disorder.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/team.hpp"
#include "prepare/canonical_order.hpp"
#include "prepare/crowds.hpp"
#include "prepare/fill.hpp"
#include "prepare/survey.hpp"
#include "stages/frame/cells.hpp"
#include "stages/frame/project.hpp"

namespace meniscus {
namespace {

using Place = std::array<float, 3>;  // world units

// Evening out makes a large frame take half as long again (docs/mesh.md). Less disorder than this
// is not worth that: Gaussian noise of .1 s has .18, FLIP and MPM 1 and more.
constexpr double kWorthwhile = 0.3;

// Some places of the sample, sorted and spread over all: four times as many as of a frame at hand,
// where the amount grows fast with the variations.
std::vector<Place> spread_over(std::vector<Place> sample) {
  constexpr std::size_t kPlaces = 4 * kOrderSample;
  std::sort(sample.begin(), sample.end());
  sample.erase(std::unique(sample.begin(), sample.end()), sample.end());
  std::vector<Place> some;
  for (std::size_t i = 0; i < sample.size(); i += 1 + sample.size() / kPlaces)
    some.push_back(sample[i]);
  return some;
}

// The cells of side kRelaxReach around some places. They hold all that these see, and whole cubes
// of those in which crowds are counted.
class CellsAround {
 public:
  CellsAround(const std::vector<Place>& places, double radius)
      : inverse_(static_cast<float>(1 / (kRelaxReach * radius))), near_(kMask + 1) {
    for (const auto& [x, y, z] : places)
      for (int i = -1; i <= 1; ++i)
        for (int j = -1; j <= 1; ++j)
          for (int k = -1; k <= 1; ++k) near_[bucket_at(x, y, z, {i, j, k})] = true;
  }

  /// Also true for a few cells that share a bucket with one of them.
  bool holds(float x, float y, float z) const { return near_[bucket_at(x, y, z, {0, 0, 0})]; }

 private:
  static constexpr std::uint32_t kMask = (1u << 20) - 1;
  std::uint32_t bucket_at(float x, float y, float z, const std::array<int, 3>& away) const {
    return bucket_of(cell_of(x, inverse_) + away[0], cell_of(y, inverse_) + away[1],
                     cell_of(z, inverse_) + away[2], kMask);
  }
  float inverse_;
  std::vector<bool> near_;  // [buckets]
};

}  // namespace

Disorder find_disorder(const ParticleSource& source, const View& view, const Parameters& params) {
  if (params.disorder >= 0) return {.amount = params.disorder};
  const std::vector<Place> places = spread_over(survey_of(source).sample);
  const CellsAround around(places, view.radius);
  const Particles found =
      positions_where(source, [&](float x, float y, float z) { return around.holds(x, y, z); });
  Notices of_some;  // what is wrong with all of them is told elsewhere
  const std::vector<std::size_t> order =
      without_crowds(found, canonical_order(found, {}, of_some), view.radius, of_some);
  const WorldParticles world = particles_in_order(found, order, view.radius, false);
  std::vector<std::int32_t> sampled;
  for (std::size_t k = 0; k < order.size(); ++k)
    if (std::binary_search(places.begin(), places.end(), Place{world.x[k], world.y[k], world.z[k]}))
      sampled.push_back(static_cast<std::int32_t>(k));
  const Projected placed = place_particles(view, world);
  const Cells cells = make_cells(placed.x, placed.y, placed.z, static_cast<float>(kRelaxReach));
  const ParticleOrder measured = measure_order(placed, sampled, cells);
  const double amount = disorder_of(measured);
  return source.team().from_first(amount < kWorthwhile ? Disorder{}
                                                       : Disorder{amount, measured.spacing});
}

}  // namespace meniscus
