// What draws by atomic minima: the nearest front of scattered discs in double precision, and all
// else to the bit as it is drawn bin by bin.
#include "stages/frame/minima.hpp"

#include <numeric>

#include "stages/frame/visible.hpp"
#include "stages/other_methods/spheres.hpp"
#include "stages/sample/behind.hpp"
#include "stages/sample/region.hpp"
#include "verify/reference/visible.hpp"
#include "verify/stage_cases/cases.hpp"
#include "verify/stage_cases/inputs.hpp"
#include "verify/stage_cases/into_new.hpp"
#include "verify/stage_cases/mesh_by_hand.hpp"
#include "verify/stage_cases/worst.hpp"
#include "verify/with_discs.hpp"

namespace meniscus::verify {
namespace {

constexpr int kWidth = 61, kHeight = 47;

const auto everywhere = [](std::size_t) { return true; };

// Runs `draw` both ways: each value must be the same, where `counts` says so.
template <class Draw, class Counts = decltype(everywhere)>
void see_both(Device& device, Worst& worst, const Draw& draw, const Counts& counts = everywhere) {
  const auto drawn = [&](DiscForm form) {
    const WithDiscs with(device, form);
    return draw();
  };
  const auto bins = drawn(DiscForm::bins), minima = drawn(DiscForm::minima);
  for (std::size_t k = 0; k < bins.size(); ++k)
    if (counts(k)) worst.see(static_cast<double>(minima[k]), static_cast<double>(bins[k]), 0);
}

template <class Draw, class Counts = decltype(everywhere)>
ReferenceError both_ways(Device& device, const char* kernel, const char* output, const Draw& draw,
                         const Counts& counts = everywhere) {
  Worst worst(kernel, output);
  see_both(device, worst, draw, counts);
  return worst.error();
}

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

// The nearest fronts of discs against double precision.
std::vector<float> see_fronts(Device& device, const Projected& p,
                              const std::vector<std::int32_t>& all, const SplatParticles& splats,
                              const SampleGrid& grid, ReferenceErrors& errors) {
  const WithDiscs with(device, DiscForm::minima);
  Worst depths("lower_discs", "depth");
  const auto bounds = reference::splat_depth(p, all, grid, 1.8, 0.45, kEpsilon);
  const std::vector<float> fronts = download(device, splat_depth(device, splats, grid, 1.8, 0.45));
  for (std::size_t k = 0; k < fronts.size(); ++k)
    depths.see_within(fronts[k], bounds.low[k], bounds.high[k]);
  errors.push_back(depths.error());
  return fronts;
}

// Discs: fronts, owners, extents and what lies behind.
void see_discs(Device& device, int size, ReferenceErrors& errors) {
  const SampleGrid grid{kWidth, kHeight, 0.5f, 1};
  const Projected p = discs(static_cast<std::size_t>(size), 5, kWidth, kHeight);
  std::vector<std::int32_t> all(p.size());
  std::iota(all.begin(), all.end(), 0);
  const SplatParticles splats = upload_splats(device, p, all);

  const std::vector<float> fronts = see_fronts(device, p, all, splats, grid, errors);
  const auto covered = [&](std::size_t k) { return fronts[k] < kNoSurface; };
  errors.push_back(both_ways(device, "own_discs", "owner", [&] {
    return download(device, splat_owner(device, splats, grid, 1.8));
  }));
  see_counts(device, p, all, errors);

  const auto front = [&](auto part) {
    return
        [&, part] { return download(device, splat_fronts(device, splats, grid, 1.8, 0.45).*part); };
  };
  errors.push_back(
      both_ways(device, "lower_fronts_and_extents", "depth", front(&Fronts::depth), covered));
  errors.push_back(both_ways(device, "lower_fronts_and_extents", "occupied by fronts",
                             front(&Fronts::occupied)));

  const auto extent = [&](auto part) {
    return [&, part] {
      return download(device,
                      splat_extent(device, splats, grid, 2, any_blocks(device, grid)).*part);
    };
  };
  Worst extents("lower_fronts_and_extents", "from and to");
  const auto from = extent(&Extent::from)();
  see_both(device, extents, extent(&Extent::from));
  see_both(device, extents, extent(&Extent::to),
           [&](std::size_t k) { return from[k] < kNoSurface; });
  errors.push_back(extents.error());
  errors.push_back(both_ways(device, "lower_fronts_and_extents", "occupied by extents",
                             extent(&Extent::occupied)));

  const Buffer<float> first = upload(device, fronts);
  const GapLists gaps = list_gaps(device, grid, first, 3);
  const auto behind = [&] {
    const DiscsBehind discs = list_discs(device, splats, {{1.8f, 1.0f}}, gaps);
    return download(device, splat_behind(device, discs, gaps.lists, first, 3));
  };
  errors.push_back(both_ways(device, "lower_discs_behind", "depth", behind, covered));
}

void see_spheres(Device& device, int size, ReferenceErrors& errors) {
  const View view = make_view(off_centre_camera(kWidth, kHeight), 0.5, {0, 0, 0});
  const DeviceSpheres spheres = upload_spheres(device, view, spheres_around(view, size, 2), 1.5);
  const SampleGrid grid = pixel_grid(view);
  errors.push_back(both_ways(device, "lower_spheres", "depth", [&] {
    return download(device, cast_spheres(device, view, spheres, grid));
  }));
  errors.push_back(both_ways(device, "normals_of_owners", "normal", [&] {
    return download(device, sphere_normals(device, view, spheres, grid));
  }));
}

void see_triangles(Device& device, int size, ReferenceErrors& errors) {
  const View view = plain_view();
  const Triangulation mesh = triangulated(field(3 + size / 10, 4, hills));
  const SampleGrid grid = pixel_grid(view);
  errors.push_back(both_ways(device, "lower_triangles", "depth", [&] {
    return download(device, draw_triangles(device, view, mesh, grid, any_blocks(device, grid)));
  }));
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
