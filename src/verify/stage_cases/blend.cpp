// blend_groups: a crowd of fits of three sheets, more than a ray keeps, and others that face away;
// and the outline of a ball, which rays enter, graze and pass by.
#include "stages/sample/blend.hpp"

#include "verify/reference/blend.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/fits_by_hand.hpp"
#include "verify/stage_cases/into_new.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {
namespace {

struct SeenBlend {
  Worst depths{"blend_groups", "depth"}, normals{"blend_groups", "normal"},
      trusts{"blend_groups", "trust"};
};

void see_blend(Device& device, const GivenFits& scene, const View& view, const SampleGrid& grid,
               SeenBlend* seen) {
  const FitParams fit;
  const BlendParams params;
  Random random(11);
  std::vector<ParticleFits> others;
  for (int k = 0; k < 6; ++k) others.push_back(rounded(scene, random).fits);
  std::vector<float> reference(grid.size());
  for (float& t : reference) t = static_cast<float>(random(19, 21));
  for (std::size_t s = 8; s < reference.size(); s += 9) reference[s] = kNoSurface;

  const BlendRecords records =
      make_records(scene.fits, scene.trust, fit, kBlendReach * params.radius);
  const SurfaceBuffers surface = empty_surface(device, grid);
  const Buffer<float> depth = upload(device, reference);
  blend_groups(device, view, list_gaps(device, grid, depth, 0).lists,
               upload_records(device, records), list_fits(device, view, records, grid), depth,
               surface, params);
  const SurfaceMap map = download(device, surface);
  const std::vector<float> trust = download(device, surface.trust);

  for (std::size_t s = 0; s < grid.size(); ++s) {
    if (!(reference[s] < kNoSurface)) {
      seen->depths.see(map.depth[s], kNoSurface, 0);
      continue;
    }
    const auto bounded =
        reference::bounded_blend(scene.fits, scene.trust, others, view, u_of(grid, s),
                                 v_of(grid, s), reference[s], fit, params);
    if (!bounded.sure) continue;
    const reference::Blended& expected = bounded.expected;
    seen->depths.see(map.depth[s], expected.depth, bounded.depth_error);
    if (expected.hits == 0) continue;
    const Vec3d off = Vec3d(map.normal[s]) - expected.normal;
    seen->normals.see(length(off), 0, bounded.normal_error, 1);
    // 2 is added on an edge, 4 where a face has ended, 8 where the ray passes by.
    const double added = expected.passed ? 8 : expected.ended ? 4 : expected.on_edge ? 2 : 0;
    seen->trusts.see(trust[s], added + expected.trust, bounded.trust_error, 1);
  }
}

}  // namespace

ReferenceErrors blend_case(Device& device, int size) {
  SeenBlend seen;
  const SampleGrid grid{size, (size + 1) / 2, 0.5f, 1};
  see_blend(device, crowd(1), frontal_view(grid.nx, grid.ny), grid, &seen);
  // A fortieth of a pixel apart, around the ball's right end.
  see_blend(device, ball_of_fits(2), frontal_view(16, 16), {size, (size + 1) / 2, 8.25f, 0.025f},
            &seen);
  see_blend(device, ball_of_fits(3, 0.6), frontal_view(16, 16),
            {size, (size + 1) / 2, 8.25f, 0.025f}, &seen);
  return {seen.depths.error(), seen.normals.error(), seen.trusts.error()};
}

}  // namespace meniscus::verify
