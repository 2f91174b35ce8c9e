// close_specks and apply_closed: two layers with holes, specks, pits, splash and normals that stand
// alone.
#include "stages/sample/specks.hpp"

#include "verify/reference/specks.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/inputs.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {
namespace {

SurfaceMap flawed(int nx, int ny) {
  SurfaceMap map;
  map.grid = {nx, ny, 0.5f, 1};
  Random random(static_cast<unsigned>(nx));
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      const double patch = std::sin(0.3 * i + 0.2 * j) + std::cos(0.27 * j - 0.1 * i);
      const double chance = random(0, 1);
      // Whole in the middle of patches, torn where they end: holes of all sizes, and specks.
      const bool gap = chance < (std::abs(patch) < 0.5 ? 0.35 : 0.06) || patch < -1.2;
      const bool speck = chance > 0.97;
      const bool pit = j % 7 == 3 && i % 11 / 2 == 2;  // two samples of what lies behind
      const double deep = patch < 0.2 ? 30 : 20;
      const bool odd = !speck && chance > 0.94;             // a normal that stands alone
      const double rough = 0.3 + 0.2 * std::sin(0.23 * i);  // neighbours agree more or less
      const Vec3d normal = normalized(odd ? Vec3d{random(-1, 1), random(-1, 1), 0.4}
                                          : Vec3d{random(-rough, rough), random(-rough, rough), 1});
      const double nearer = !gap && speck ? random(2, 9) : 0, off = gap ? 0 : random(-0.4, 0.4);
      map.depth.push_back(
          gap ? kNoSurface
              : static_cast<float>(deep + (pit ? 12 : -nearer) + 0.11 * i - 0.07 * j + off));
      map.normal.push_back(gap ? Vec3{} : static_cast<Vec3>(normal));
      map.group.push_back(gap ? -1 : (j * nx + i) % 97);
      map.kind.push_back(gap                             ? Kind::none
                         : chance > 0.9 && chance < 0.92 ? Kind::splash
                                                         : Kind::surface);
    }
  return map;
}

struct Found {
  Worst depths{"close_specks", "depth"}, normals{"close_specks", "normal"},
      groups{"close_specks", "group"}, kinds{"close_specks", "kind"};

  void compare(Device& device, const SurfaceMap& map, double large_until) {
    const SurfaceBuffers surface = upload(device, map);
    close_specks(device, surface, blocks_of(device, map.grid, true), large_until);
    const SurfaceMap found = download(device, surface);
    // docs/method.md: samples hang together up to 3 radii apart, on one beside them up to the
    // spacing; four rounds, for holes of a few; pinholes alone where particles are small.
    constexpr double kFarthest = 57;
    reference::Closing expected = reference::closing_of(map);
    for (int round = 0; round < 4; ++round)
      expected = reference::close_once(expected, 3, 2, large_until, kFarthest);
    for (std::size_t s = 0; s < expected.depth.size(); ++s) {
      if (expected.in_doubt[s]) continue;
      // Eight sums and a division, of means that were made so before: four rounds.
      depths.see(found.depth[s], expected.depth[s], 4 * 9 * kEpsilon * kFarthest);
      if (!(found.depth[s] < kNoSurface)) continue;
      normals.see(length(Vec3d(found.normal[s]) - expected.normal[s]), 0, 4 * 16 * kEpsilon, 1);
      groups.see(found.group[s], expected.group[s], 0);
      kinds.see(static_cast<int>(found.kind[s]), static_cast<int>(expected.kind[s]), 0);
    }
  }
};

}  // namespace

ReferenceErrors specks_case(Device& device, int size) {
  const SurfaceMap map = flawed(size, (2 * size + 2) / 3);
  Found found;
  // Nowhere, up to between the two layers, and everywhere.
  for (const double large_until : {0.0, 25.0, 1e9}) found.compare(device, map, large_until);
  return {found.depths.error(), found.normals.error(), found.groups.error(), found.kinds.error()};
}

}  // namespace meniscus::verify
