// The kernels that make the image of method fit out of its fits: measured in whole frames.
#include <cmath>

#include "kernels/cases.hpp"
#include "stages/blend.hpp"

namespace meniscus::bench {
namespace {

Case frame_case(Frame& frame, const char* kernel) {
  const Frame::Frames& frames = frame.frames(Method::fit);
  Case result;
  result.unit = "pixels";
  for (const float t : frames.result.image.depth) result.items += t < kNoSurface;
  result.frame_ms = frame.frame_ms(Method::fit, kernel);
  return result;
}

// Pairs of a pixel of the surface and a fit whose reach it is in. Of every `kEvery`th pixel along
// both axes, for all.
double count_hits(Frame& frame) {
  const SurfaceMap& image = frame.frames(Method::fit).result.image;
  const ParticleFits& fits = frame.fits();
  const double reach = kBlendReach * frame.params.blend.radius;
  std::vector<float> x, y, z;
  for (const Vec3d& foot : fits.foot) {
    x.push_back(static_cast<float>(foot.x));
    y.push_back(static_cast<float>(foot.y));
    z.push_back(static_cast<float>(foot.z));
  }
  const Cells cells = make_cells(x, y, z, static_cast<float>(reach));
  constexpr int kEvery = 4;
  double hits = 0;
  for (int j = 0; j < image.grid.ny; j += kEvery)
    for (int i = 0; i < image.grid.nx; i += kEvery) {
      const float t = image.depth[static_cast<std::size_t>(j) * image.grid.nx + i];
      if (!(t < kNoSurface)) continue;
      const Vec3d at = point_at(frame.view, i + 0.5, j + 0.5, t);
      visit_near(cells, static_cast<float>(at.x), static_cast<float>(at.y),
                 static_cast<float>(at.z), [&](std::int32_t p) {
                   const double share = fits.support[cells.item[p]] / frame.params.fit.support;
                   hits += length(Vec3d{cells.x[p], cells.y[p], cells.z[p]} - at) <
                           reach * std::max(0.7, share);
                   return true;
                 });
    }
  return hits * kEvery * kEvery;
}

}  // namespace

Case prepare_blend(Frame& frame) {
  Case result = frame_case(frame, "blend_groups");
  // A reference read; depth, normal, group and trust written; a record of 24 values a fit.
  result.bytes = 28 * result.items + 96.0 * static_cast<double>(frame.fits().size());
  // A hit: the quadric on the ray 49, its root 10, distance 16, gradient 23, weight 5, normal and
  // pull 11, sums 39, sheets 10. A pixel: sheets and normal 140.
  result.operations = 163 * count_hits(frame) + 140 * result.items;
  return result;
}

Case prepare_settle(Frame& frame) {
  Case result = frame_case(frame, "settle_samples");
  // Triangle, reference, trust and depth read, one map written. What is computed depends on where
  // the density decides, and is not counted.
  result.bytes = 20 * result.items;
  return result;
}

Case prepare_follow(Frame& frame) {
  Case result = frame_case(frame, "follow_field");
  // A reference depth; how many samples follow the field from there, and how far, is not counted.
  result.bytes = 4 * result.items;
  return result;
}

Case prepare_compare(Frame& frame) {
  Case result = frame_case(frame, "compare_corners");
  // Of every second sample of each row and column: depth, normal and kind read, one value written.
  result.bytes = 18 * result.items / 4;
  return result;
}

Case prepare_interpolate(Frame& frame) {
  Case result = frame_case(frame, "interpolate_samples");
  // Three of four samples written: depth, normal, group and kind; a flag read and written.
  result.bytes = 23 * result.items * 3 / 4;
  // Of each: the corners' depths 4, normals 12, their length 6.
  result.operations = 22 * result.items * 3 / 4;
  return result;
}

}  // namespace meniscus::bench
