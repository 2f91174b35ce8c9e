// The kernels that make the image of method fit out of its fits: measured in whole frames.

#include "kernels/capture.hpp"
#include "kernels/cases.hpp"
#include "kernels/native/native.hpp"
#include "stages/sample/blend.hpp"

namespace meniscus::bench {
namespace {

Case frame_case(Frame& frame, const char* kernel) {
  const Frame::Frames& frames = frame.frames(Method::fit);
  Case result{.unit = "pixels"};
  for (const float t : frames.image.depth) result.items += t < kNoSurface;
  result.frame_ms = frame.frame_ms(Method::fit, kernel);
  return result;
}

std::size_t tiles_of(const Frame& frame) {
  return static_cast<std::size_t>((frame.view.width + kTile - 1) / kTile) *
         static_cast<std::size_t>((frame.view.height + kTile - 1) / kTile);
}

// A native version goes through all launches in a frame; `work` takes tiles [begin, end) of one.
template <class Input>
void add_native(Case& result, Frame& frame, const char* kernel,
                const std::vector<std::size_t>& written,
                Input (*input_of)(Frame& frame, CapturedLaunch& launch),
                void (*work)(const Input& input, std::size_t begin, std::size_t end)) {
  result.next_frame_ms = [&frame, kernel] { return frame.next_frame_ms(Method::fit, kernel); };
  const std::size_t tiles = tiles_of(frame);
  add_native(result,
             capture_launches(frame.device, kernel, written,
                              [&] { frame.make_frame(Method::fit, nullptr); }),
             [&frame, input_of, work, tiles](CapturedLaunch& launch, Workers& workers) {
               const Input input = input_of(frame, launch);
               workers.run(tiles, 4,
                           [&](std::size_t begin, std::size_t end) { work(input, begin, end); });
             });
}

native::Lists lists_of(const Frame& frame, const CapturedLaunch& launch) {
  const SampleGrid grid = pixel_grid(frame.view);
  native::Lists lists{launch.read<std::int32_t>(0),
                      launch.read<std::int32_t>(1),
                      grid.nx,
                      grid.first,
                      grid.step,
                      {}};
  for (std::size_t k = 0; k < 12; ++k) lists.ray[k] = static_cast<float>(frame.view.ray[k]);
  return lists;
}

// Pairs of a pixel of the surface and a fit whose reach it is in. Of every `kEvery`th pixel along
// both axes, for all.
double count_hits(Frame& frame) {
  const SurfaceMap& image = frame.frames(Method::fit).image;
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

native::Blend blend_input(Frame& frame, CapturedLaunch& launch) {
  const BlendParams& params = frame.params.blend;
  const cl_int2 strides = launch.scalar<cl_int2>(11);
  const auto fits = [&](std::size_t first, cl_int stride) {
    return native::FitList{launch.read<std::int32_t>(first), launch.read<std::int32_t>(first + 1),
                           launch.read<float>(first + 2), stride};
  };
  return {lists_of(frame, launch),
          launch.read<float>(2),
          launch.read<float>(3),
          launch.read<float>(4),
          fits(5, strides.s[0]),
          fits(8, strides.s[1]),
          launch.write<float>(12),
          launch.write<float>(13),
          launch.write<std::int32_t>(14),
          launch.write<float>(15),
          pixel_grid(frame.view).size(),
          static_cast<float>(params.d_max),
          static_cast<float>(params.same_low),
          static_cast<float>(params.same_high),
          static_cast<float>(params.crease)};
}

// From argument `first` on.
native::Cells cells_of(Frame& frame, const CapturedLaunch& launch, std::size_t first) {
  const Cells& cells = frame.cells();
  return {launch.read<float>(first),
          launch.read<float>(first + 1),
          launch.read<float>(first + 2),
          launch.read<std::int32_t>(first + 3),
          launch.read<std::int32_t>(first + 4),
          cells.inverse_cell,
          cells.mask};
}

native::Follow follow_input(Frame& frame, CapturedLaunch& launch) {
  const auto limits = launch.scalar<records::Settling>(17).limits;
  native::Lists lists = lists_of(frame, launch);
  lists.count += tiles_of(frame);  // of the second list
  return {lists,
          launch.read<float>(2),
          launch.read<float>(3),
          launch.write<float>(4),
          launch.write<float>(5),
          launch.write<std::int32_t>(6),
          launch.write<std::uint8_t>(7),
          launch.write<float>(8),
          cells_of(frame, launch, 9),
          launch.read<float>(15),
          launch.read<float>(16),
          pixel_grid(frame.view).size(),
          limits.contour,
          limits.level,
          limits.before,
          limits.beyond,
          limits.disorder};
}

}  // namespace

Case prepare_blend(Frame& frame) {
  Case result = frame_case(frame, "blend_groups");
  // A reference read; depth, normal, group and trust written; records of 20 values a fit.
  result.bytes = 28 * result.items + 80.0 * static_cast<double>(frame.fits().size());
  // A hit: the quadric on the ray 49, its root 9, distance 13, gradient 23, weight 5, normal and
  // pull 11, sums 40, sheets 10. A pixel: sheets and normal 140.
  result.operations = 160 * count_hits(frame) + 140 * result.items;
  add_native(result, frame, "blend_groups", {12, 13, 14, 15}, blend_input, native::blend_groups);
  return result;
}

Case prepare_settle(Frame& frame) {
  Case result = frame_case(frame, "settle_samples");
  // Triangle, reference, trust and depth read, one map written, and a list. What is computed
  // depends on where the density decides, and is not counted.
  result.bytes = 20 * result.items;
  return result;
}

Case prepare_follow(Frame& frame) {
  Case result = frame_case(frame, "follow_field");
  // A reference depth; how many samples follow the field from there, and how far, is not counted.
  result.bytes = 4 * result.items;
  add_native(result, frame, "follow_field", {4, 5, 6, 7, 8}, follow_input, native::follow_field);
  return result;
}

Case prepare_splash(Frame& frame) {
  Case result = frame_case(frame, "draw_splash");
  // Where splash may begin and end, and the depth before; how many samples it is drawn on, and how
  // far their rays are followed, is not counted.
  result.bytes = 12 * result.items;
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
