#include "stages/sample/settle.hpp"

#include "device/kernels.hpp"

namespace meniscus {
namespace {

// A kept triangle's depth within this many particle radii of a sample vouches for it without
// measuring the density.
constexpr float kTriangleReach = 3;

// The field of a lone particle reaches one particle radius; among others it reaches farther. (A
// blob that reached farther than this had a pinhole: no crossing is found from inside.)
constexpr double kBlobReach = 2.5;

// The density field is sought this many particle radii before and twice as many behind the blend or
// the reference depth; in gaps, which have nothing behind them, farther.
constexpr float kSearch = 2;
constexpr float kFarSearch = 12;

// `beyond`: how far behind the field is sought.
records::Settling settling(const View& view, const SampleGrid& grid, const SettlingField& field,
                           float beyond, bool only_gaps) {
  return {screen_of(view, grid),
          {static_cast<float>(field.params.contour_density),
           static_cast<float>(field.params.blob_density), kTriangleReach, kSearch, beyond,
           static_cast<float>(field.disorder)},
          only_gaps};
}

}  // namespace

void settle_samples(Device& device, const View& view, const SampleLists& lists,
                    const SettlingField& field, const Buffer<float>& triangle_depth,
                    const Buffer<float>& reference, const SurfaceBuffers& surface,
                    const Buffer<float>& behind, bool only_gaps) {
  SampleLists left = lists;
  left.sample = allocate<cl_int>(device, lists.sample.size);
  const int width = device.state().vector_width, wide = device.state().wide_width();
  const records::Settling how =
      settling(view, surface.grid, field, only_gaps ? kFarSearch : 2 * kSearch, only_gaps);
  launch(device, kernels::settle_samples, width, range_of(lists, width), lists, triangle_depth,
         reference, surface, behind, left.sample, field.cells, how);
  launch(device, kernels::follow_field, wide, range_of(lists, wide), left, reference, surface,
         behind, field.cells, field.levelled.weight, how);
}

void settle_points(Device& device, const View& view, const SettlingField& field,
                   const Buffer<float>& points, const Buffer<float>& reference,
                   const SurfaceBuffers& surface) {
  const std::size_t n = surface.grid.size();
  launch(device, kernels::settle_points, 1, {n}, filled<float>(device, n, kNoSurface), reference,
         surface, allocate<float>(device, n), points, field.cells, field.levelled.weight,
         settling(view, surface.grid, field, kSearch, false));
}

void settle_gaps(Device& device, const View& view, const SampleLists& lists,
                 const SettlingField& field, const Buffer<float>& triangle_depth,
                 const Buffer<float>& reference, const Extent& splash,
                 const SurfaceBuffers& surface, const Buffer<float>& behind) {
  if (vectors_are_filled(device)) {
    settle_samples(device, view, lists, field, triangle_depth, reference, surface, behind, true);
    return draw_splash(device, view, lists, field.levelled, splash, surface, field.params);
  }
  // Nothing is in doubt: samples either show something or the field is followed.
  launch(device, kernels::settle_gaps, 1, range_of(lists, 1), lists, reference, surface, behind,
         splash, field.cells, field.levelled.weight,
         settling(view, surface.grid, field, kFarSearch, true));
}

void draw_fronts(Device& device, const SampleGrid& grid, const SplatParticles& seen,
                 double footprint, double bulge, const Fronts& fronts, const SplatParticles& splash,
                 const Extent& extent) {
  splat_fronts_and_extent(device, grid, seen, footprint, bulge, fronts, splash, kBlobReach, extent);
}

void draw_splash(Device& device, const View& view, const SampleLists& lists,
                 const DeviceCells& levelled, const Extent& extent, const SurfaceBuffers& surface,
                 const RegionParams& params, const Buffer<float>* open) {
  const int width = device.state().wide_width();
  const SampleLists nearer = !vectors_are_filled(device) ? lists
                             : open ? keep_samples(device, lists, extent.from, surface.depth, *open)
                                    : keep_samples(device, lists, extent.from, surface.depth);
  launch(device, kernels::draw_splash, width, range_of(nearer, width), nearer, extent, surface,
         cells_with(levelled, levelled.weight), screen_of(view, surface.grid),
         static_cast<cl_float>(params.blob_density), open ? *open : surface.depth,
         cl_int{open == nullptr});
}

}  // namespace meniscus
