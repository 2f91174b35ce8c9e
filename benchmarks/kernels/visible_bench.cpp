#include <memory>
#include <numbers>

#include "kernels/cases.hpp"
#include "stages/frame/visible.hpp"
#include "verify/stage_cases/into_new.hpp"

namespace meniscus::bench {
namespace {

// Nodes under the discs of particles that own a share of the map: each of those must be drawn
// somewhere; what lies behind needs no drawing.
double nodes_under_seen(Frame& frame, double footprint, double step) {
  const Projected& projected = frame.projected();
  double nodes = 0;
  for (const std::int32_t i : frame.seen().index)
    nodes += std::numbers::pi * footprint * footprint * projected.ku[i] * projected.kv[i];
  return nodes / (step * step);
}

}  // namespace

Case prepare_splat(Frame& frame) {
  const SampleGrid grid = pixel_grid(frame.view);
  const double footprint = frame.params.region.reference;
  const auto splats = std::make_shared<SplatParticles>(
      upload_splats(frame.device, frame.projected(), frame.seen().index));
  const double pairs = nodes_under_seen(frame, footprint, 1);
  Case result{.unit = "nodes", .items = static_cast<double>(grid.size())};
  // Six values a disc; a depth written a node.
  result.bytes = 24.0 * splats->count + 4.0 * result.items;
  // A node under a disc: place 2, square 1, sum 1, root 2, depth 2, minimum 1.
  result.operations = 9 * pairs;
  result.launch = [&frame, grid, splats, footprint] {
    splat_depth(frame.device, *splats, grid, footprint);
  };
  return result;
}

Case prepare_owned(Frame& frame) {
  // The visibility map has four nodes a particle radius (find_visible).
  const double footprint = frame.params.visible.footprint;
  const Projected& projected = frame.projected();
  double radius = 0;
  for (const std::int32_t i : frame.seen().index)
    radius += projected.ku[i] / static_cast<double>(frame.seen().index.size());
  const double step = std::min(radius / 4, 2.0);
  const double pairs = nodes_under_seen(frame, footprint, step);
  const double particles = static_cast<double>(frame.split().body.size());
  Case result{.unit = "particles", .items = particles};
  // Six values a particle read and a count written.
  result.bytes = 28 * particles;
  result.operations = 9 * pairs;                                    // as in prepare_splat
  result.atomics = static_cast<double>(frame.seen().index.size());  // an addition each, at least
  result.launch = [&frame] {
    find_visible(frame.device, frame.view, frame.projected(), frame.split().body,
                 frame.params.visible, kLeastFitted);
  };
  return result;
}

// Who is seen, as find_visible finds it: outlines, bounds, lists where there are any, the drawing,
// and the host's part.
Case prepare_owners(Frame& frame, DiscForm form) {
  Case result = prepare_owned(frame);
  result.whole = true;
  result.launch = [&frame, form, find = result.launch] { draw_as(frame.device, form, find); };
  return result;
}
Case prepare_owners_by_bins(Frame& frame) { return prepare_owners(frame, DiscForm::bins); }
Case prepare_owners_by_minima(Frame& frame) { return prepare_owners(frame, DiscForm::minima); }

// The fronts of the seen particles at every pixel, the region's reference.
Case prepare_fronts(Frame& frame, DiscForm form) {
  Case result = prepare_splat(frame);
  const auto splats = std::make_shared<SplatParticles>(
      upload_splats(frame.device, frame.projected(), frame.seen().index));
  result.whole = true;
  result.launch = [&frame, form, splats] {
    draw_as(frame.device, form, [&] {
      const double footprint = frame.params.region.reference;
      splat_fronts(frame.device, *splats, pixel_grid(frame.view), footprint,
                   frame.params.fit.offset / footprint);
    });
  };
  return result;
}
Case prepare_fronts_by_bins(Frame& frame) { return prepare_fronts(frame, DiscForm::bins); }
Case prepare_fronts_by_minima(Frame& frame) { return prepare_fronts(frame, DiscForm::minima); }

}  // namespace meniscus::bench
