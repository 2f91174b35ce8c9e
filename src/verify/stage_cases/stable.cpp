// own_triangles and blend_particles: hand-made fits at the particles of hills and of a roof.
#include "stages/other_methods/stable.hpp"

#include "verify/reference/stable.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/mesh_by_hand.hpp"
#include "verify/stage_cases/worst.hpp"

namespace meniscus::verify {

ReferenceErrors stable_case(Device& device, int size) {
  return stable_errors(device, {size, size, 8, 24.0f / static_cast<float>(size)});
}

ReferenceErrors stable_errors(Device& device, const SampleGrid& grid) {
  Parameters params;
  params.stable.capsule = 0;
  params.stable.closing = 0;
  Worst depths("own_triangles", "depth"), owners("own_triangles", "owner"),
      blended("blend_particles", "depth"), normals("blend_particles", "normal");
  std::size_t covered = 0;
  for (const auto& surface : {hills, roof}) {
    const Projected particles = field(12, 13, surface);
    const Triangulation mesh = triangulated(particles);
    const ParticleFits fits = made_by_hand(mesh, surface, 0.02, 14);
    const GroupRecords records = stable_records(fits, params.fit, params.blend.radius);
    const auto device_records = upload(device, records.values);
    const StableRegion region = draw_stable_region(
        device, plain_view(), mesh, all_visible(particles), fits, device_records, grid, params);
    const SurfaceMap map =
        download(device, blend_particles(device, plain_view(), region, device_records,
                                         list_tiles(plain_view(), records, grid), params.blend));
    const auto depth = download(device, region.reference);
    const auto owner = download(device, region.owner);
    for (std::size_t s = 0; s < grid.size(); ++s) {
      const double u = u_of(grid, s), v = v_of(grid, s);
      // Barycentric coordinates are products of differences below 6, over an area of 1 or more: 40
      // roundings of 36 are safe; three depths of 33 at most, whose coordinates have that error
      // each.
      constexpr double kCorner = 40 * 36 * kEpsilon;
      const auto owned = reference::owned_at(plain_view(), mesh, fits, u, v);
      if (owned.margin >= kCorner) {
        owners.see(owner[s], owned.owner, 0);
        depths.see(depth[s], owned.depth, 33 * 3 * kCorner);
      }
      if (!std::isfinite(depth[s])) continue;
      ++covered;
      const auto expected = reference::blend_at(plain_view(), fits, u, v, depth[s], params.blend);
      if (expected.margin < 1e-2 || !std::isfinite(expected.depth)) continue;
      // A root is good to 20 roundings of its terms, at most 40, over the slope along the ray, 0.4
      // or more. A weight moves by 2.1 / 5 of that (Wendland's steepest slope), which moves the
      // mean of hits within 2 of each other; sigma moves by 7.5 times the gradient's error, bend
      // times the root's; and as much again for what the rounds of mean shift hand on.
      constexpr double kRoot = 20 * 40 * kEpsilon / 0.4;
      blended.see(map.depth[s], expected.depth, 4 * kRoot);
      normals.see(length(Vec3d(map.normal[s]) - expected.normal), 0, 4 * kRoot, 1);
    }
  }
  require_decided(owners.seen() >= 2 * grid.size() * 9 / 10 && blended.seen() >= covered * 8 / 10);
  return {owners.error(), depths.error(), blended.error(), normals.error()};
}

}  // namespace meniscus::verify
