// choose_groups: samples between those of lattices, among a crowd of fits.
#include <map>
#include <set>

#include "stages/sample/blend.hpp"
#include "verify/reference/hits.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/fits_by_hand.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {
namespace {

constexpr cl_int kOfCorner = records::OF_CORNER;

// At the lattice's samples from the one before those that begin the 16 x 8 samples around (i, j),
// to the one after them.
std::set<int> groups_around(int i, int j, const SampleGrid& grid, const std::vector<float>& depth,
                            const std::vector<cl_int>& found, int every) {
  std::set<int> groups;
  for (int y = 0; y < grid.ny; y += every)
    for (int x = 0; x < grid.nx; x += every) {
      const int left = i / 16 * 16, top = j / 8 * 8;
      const std::size_t s = static_cast<std::size_t>(y) * grid.nx + x;
      if (x < (left / every - 1) * every || x >= left + 16 + every ||
          y < (top / every - 1) * every || y >= top + 8 + every)
        continue;
      if (depth[s] < kNoSurface && found[s] >= 0) groups.insert(found[s] & ~kOfCorner);
    }
  return groups;
}

}  // namespace

ReferenceErrors choose_groups_case(Device& device, int size) {
  // The crowd fills the middle third of the view; the grid is higher than wide.
  const SampleGrid grid{size - size / 4, size, 7, 7.0f / static_cast<float>(size)};
  const View view = frontal_view(21, 21);
  const FitParams fit;
  const BlendParams params;
  const GivenFits scene = crowd(2);
  const DeviceRecords records = upload_records(
      device, make_records(scene.fits, scene.trust, fit, kBlendReach * params.radius));
  Worst chosen("choose_groups", "group");
  for (const int every : {2, 4, 16}) {
    Random random(static_cast<unsigned>(every));
    const auto any_fit = [&] {  // that rays may meet
      for (;;) {
        const auto k = static_cast<std::size_t>(random(0, static_cast<double>(scene.fits.size())));
        if (reference::counts(scene.fits, scene.trust, k) && scene.fits.visible[k] > 2e-3)
          return static_cast<cl_int>(k);
      }
    };
    std::vector<float> depth;
    std::vector<cl_int> found;
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        const bool lattice = i % every == 0 && j % every == 0,
                   gone = random(0, 1) < (lattice ? 0.02 : 0.1);
        depth.push_back(gone ? kNoSurface : static_cast<float>(random(18.5, 21.5)));
        const cl_int group = random(0, 1) < (lattice ? 0.02 : 0.1) ? -1 : any_fit();
        found.push_back(group < 0 || lattice || random(0, 1) < 0.2 ? group : group | kOfCorner);
      }
    const SurfaceBuffers surface{grid, upload(device, depth), {}, upload(device, found), {}, {}};
    const std::vector<cl_int> group =
        download(device, choose_groups(device, view, surface, records, every, params));
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        const std::size_t s = static_cast<std::size_t>(j) * grid.nx + i;
        if (!(depth[s] < kNoSurface) || found[s] < kOfCorner) {
          chosen.see(group[s], depth[s] < kNoSurface ? found[s] : -1, 0);
          continue;
        }
        const auto ray = reference::fits_on_ray(scene.fits, scene.trust, view, u_of(grid, s),
                                                v_of(grid, s), depth[s], fit, params);
        std::map<double, int> by_weight;
        for (const int k : groups_around(i, j, grid, depth, found, every)) {
          const auto hit = reference::meet(ray, static_cast<std::size_t>(k));
          if (hit.weight > 0) by_weight[hit.weight] = k;
        }
        // Weights are at most 1 and good to some thousand epsilon: a root is good to 20 roundings
        // of terms up to 60, over a slope that is seldom below 1/4; a weight's slope is below 1.
        constexpr double kSure = 4 * 20 * 60 * kEpsilon;
        const auto best = by_weight.rbegin();
        if (by_weight.empty()) {
          chosen.see(group[s], found[s] & ~kOfCorner, 0);
        } else if (best->first > kSure &&
                   (by_weight.size() == 1 || best->first - std::next(best)->first > kSure)) {
          chosen.see(group[s], best->second, 0);
        }
      }
  }
  return {chosen.error()};
}

}  // namespace meniscus::verify
