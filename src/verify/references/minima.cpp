// What draws by atomic minima: the nearest front of scattered discs in double precision, and all
// else to the bit as it is drawn bin by bin.
#include "stages/minima.hpp"

#include <numeric>

#include "stages/behind.hpp"
#include "stages/region.hpp"
#include "stages/spheres.hpp"
#include "stages/visible.hpp"
#include "verify/reference/visible.hpp"
#include "verify/references/cases.hpp"
#include "verify/references/inputs.hpp"
#include "verify/references/mesh_by_hand.hpp"
#include "verify/references/worst.hpp"
#include "verify/with_discs.hpp"

namespace meniscus::verify {
namespace {

constexpr int kWidth = 61, kHeight = 47;

// Runs `draw` both ways and sees that each value is the same, where `counts` says so.
template <class Draw, class Counts>
void see_both(Device& device, Worst& worst, const Draw& draw, const Counts& counts) {
  const auto drawn = [&](DiscForm form) {
    const WithDiscs with(device, form);
    return draw();
  };
  const auto bins = drawn(DiscForm::bins), minima = drawn(DiscForm::minima);
  for (std::size_t k = 0; k < bins.size(); ++k)
    if (counts(k)) worst.see(static_cast<double>(minima[k]), static_cast<double>(bins[k]), 0);
}

const auto everywhere = [](std::size_t) { return true; };

// How many nodes each of `number` discs owns; nobody's are the last one's.
std::vector<cl_int> counted(const std::vector<cl_int>& owners, std::size_t number) {
  std::vector<cl_int> counts(number + 1, 0);
  for (const cl_int owner : owners) ++counts[std::min(static_cast<std::size_t>(owner), number)];
  return counts;
}

// Counts of owners against those that are counted in the map of owners. Every particle twice: of
// two that are the same the first one owns all.
void see_counts(Device& device, const Projected& p, std::vector<std::int32_t> particles,
                ReferenceErrors& errors) {
  particles.insert(particles.end(), particles.begin(), particles.end());
  const std::size_t n = particles.size();
  const SplatParticles splats = upload_splats(device, p, particles);
  const auto see = [](Worst& worst, const std::vector<cl_int>& found,
                      const std::vector<cl_int>& expected) {
    for (std::size_t k = 0; k < found.size(); ++k)
      worst.see(static_cast<double>(found[k]), static_cast<double>(expected[k]), 0);
  };

  Worst counts("count_discs", "owned");
  const VisibleParams params;
  for (const DiscForm form : {DiscForm::bins, DiscForm::minima}) {
    const WithDiscs with(device, form);
    const auto owned = filled<cl_int>(device, n, 7);
    const SampleGrid grid = count_owned(device, plain_view(), p, particles, splats, params, owned);
    see(counts, download(device, owned),
        counted(download(device, splat_owner(device, splats, grid, params.footprint)), n));
  }
  errors.push_back(counts.error());

  // From one that owns all nodes at first each takes its own.
  Worst taken("count_discs", "taken");
  const WithDiscs with(device, DiscForm::minima);
  const SampleGrid grid{kWidth, kHeight, 0.5f, 1};
  const Discs discs = outline_discs(device, splats, grid, {{1.8f, 1}}, Drawn::every);
  std::vector<cl_int> before(n + 1, 0);
  before[n] = static_cast<cl_int>(grid.size());
  const auto depth = splat_depth(device, splats, grid, 1.8);
  const auto owner = filled<cl_int>(device, grid.size(), static_cast<cl_int>(n)),
             owned = upload(device, before);
  draw_minima(device, kernels::count_discs, discs.records, discs.outlines, no_bound(device, grid),
              grid, std::tie(depth, owner, owned), lattice_of(grid));
  see(taken, download(device, owned),
      counted(download(device, splat_owner(device, splats, grid, 1.8)), n));
  errors.push_back(taken.error());
}

// Discs against double precision, and owners, extents and what lies behind.
void see_discs(Device& device, int size, ReferenceErrors& errors) {
  const SampleGrid grid{kWidth, kHeight, 0.5f, 1};
  const Projected p = discs(static_cast<std::size_t>(size), 5, kWidth, kHeight);
  std::vector<std::int32_t> all(p.size());
  std::iota(all.begin(), all.end(), 0);
  const SplatParticles splats = upload_splats(device, p, all);

  Worst depths("lower_discs", "depth");
  std::vector<float> fronts;
  {
    const WithDiscs with(device, DiscForm::minima);
    const auto bounds = reference::splat_depth(p, all, grid, 1.8, 0.45, kEpsilon);
    fronts = download(device, splat_depth(device, splats, grid, 1.8, 0.45));
    for (std::size_t k = 0; k < fronts.size(); ++k)
      depths.see_within(fronts[k], bounds.low[k], bounds.high[k]);
  }
  errors.push_back(depths.error());

  Worst owners("own_discs", "owner");
  see_both(
      device, owners, [&] { return download(device, splat_owner(device, splats, grid, 1.8)); },
      everywhere);
  errors.push_back(owners.error());

  see_counts(device, p, all, errors);

  Worst nearest("lower_fronts_and_extents", "depth"),
      covered("lower_fronts_and_extents", "occupied by fronts");
  const auto front = [&](auto part) {
    return download(device, splat_fronts(device, splats, grid, 1.8, 0.45).*part);
  };
  see_both(
      device, covered, [&] { return front(&Fronts::occupied); }, everywhere);
  see_both(
      device, nearest, [&] { return front(&Fronts::depth); },
      [&](std::size_t k) { return fronts[k] < kNoSurface; });
  errors.push_back(nearest.error());
  errors.push_back(covered.error());

  Worst extents("lower_fronts_and_extents", "from and to"),
      blocks("lower_fronts_and_extents", "occupied by extents");
  const auto extent = [&](auto part) {
    return download(device, splat_extent(device, splats, grid, 2, any_blocks(device, grid)).*part);
  };
  const auto from = extent(&Extent::from);
  see_both(
      device, extents, [&] { return extent(&Extent::from); }, everywhere);
  see_both(
      device, extents, [&] { return extent(&Extent::to); },
      [&](std::size_t k) { return from[k] < kNoSurface; });
  see_both(
      device, blocks, [&] { return extent(&Extent::occupied); }, everywhere);
  errors.push_back(extents.error());
  errors.push_back(blocks.error());

  Worst behind("lower_discs_behind", "depth");
  const Buffer<float> first = upload(device, fronts);
  const GapLists gaps = list_gaps(device, grid, first, 3);
  see_both(
      device, behind,
      [&] {
        const DiscsBehind discs = list_discs(device, splats, {{1.8f, 1.0f}}, gaps);
        return download(device, splat_behind(device, discs, gaps.lists, first, 3));
      },
      [&](std::size_t k) { return fronts[k] < kNoSurface; });
  errors.push_back(behind.error());
}

void see_spheres(Device& device, int size, ReferenceErrors& errors) {
  const View view = make_view(off_centre_camera(kWidth, kHeight), 0.5, {0, 0, 0});
  WorldParticles world;
  Random random(2);
  for (int k = 0; k < size; ++k) {
    world.x.push_back(static_cast<float>(random(-4, 4)));
    world.y.push_back(static_cast<float>(random(-3, 3)));
    world.z.push_back(static_cast<float>(random(-4, 4)));
    world.scale.push_back(static_cast<float>(random(0.6, 1.5)));
  }
  const DeviceSpheres spheres =
      upload_spheres(device, view, project_particles(view, world, 2), 1.5);
  Worst depths("lower_spheres", "depth"), normals("normals_of_owners", "normal");
  const SampleGrid grid = pixel_grid(view);
  see_both(
      device, depths, [&] { return download(device, cast_spheres(device, view, spheres, grid)); },
      everywhere);
  see_both(
      device, normals,
      [&] { return download(device, sphere_normals(device, view, spheres, grid)); }, everywhere);
  errors.push_back(depths.error());
  errors.push_back(normals.error());
}

void see_triangles(Device& device, int size, ReferenceErrors& errors) {
  const View view = plain_view();
  const Triangulation mesh = triangulated(field(3 + size / 10, 4, hills));
  Worst depths("lower_triangles", "depth");
  const SampleGrid grid = pixel_grid(view);
  see_both(
      device, depths,
      [&] {
        return download(device, draw_triangles(device, view, mesh, grid, any_blocks(device, grid)));
      },
      everywhere);
  errors.push_back(depths.error());
}

}  // namespace

ReferenceErrors minima_case(Device& device, int size) {
  ReferenceErrors errors;
  see_discs(device, size, errors);
  see_spheres(device, size, errors);
  see_triangles(device, size, errors);
  return errors;
}

}  // namespace meniscus::verify
