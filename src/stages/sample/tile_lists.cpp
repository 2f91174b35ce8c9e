#include "stages/sample/tile_lists.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/parallel.hpp"
#include "device/together.hpp"

namespace meniscus {
namespace {

constexpr double kRimDepth = 2;  // particle radii from where a fit ends sheets, see hidden.cl
constexpr std::size_t kFitsAThread = 512;  // that are worth one

// What a fit's gradient can be within its reach.
struct Slopes {
  double at_foot;  // its length there
  double bend;     // how far the Hessian lets it turn away per particle radius
};

Slopes slopes_of(const float* c) {
  const auto square = [](double x) { return x * x; };
  return {std::sqrt(c[1] * c[1] + c[2] * c[2] + c[3] * c[3]),
          std::sqrt(4 * (square(c[4]) + square(c[5]) + square(c[6])) +
                    2 * (square(c[7]) + square(c[8]) + square(c[9])))};
}

// Where rays are looked for that meet a fit at its points where f is at most `value` from zero:
// there the quadric leaves the plane at its foot by its bend times half the squared reach, so they
// lie in a slab through the sphere of its reach. With room for the kernels' rounding.
struct Slab {
  Vec3d centre, normal;
  double reach, thick;  // half the slab's
};

Slab slab_of(const BlendRecords& records, std::size_t k, const Slopes& slopes, double value) {
  const float *c = &records.record[k * kFitRecord], *foot = &records.foot[4 * k];
  const double reach = 1.01 * foot[3], slope = std::max(slopes.at_foot, 1e-6);
  const double off = value + std::abs(c[0]) + slopes.bend * reach * reach / 2 + 0.02;
  return {
      {foot[0], foot[1], foot[2]}, {c[1] / slope, c[2] / slope, c[3] / slope}, reach, off / slope};
}

// Half the sides of the box around a slab.
Vec3d half_sides(const Slab& slab) {
  const double r = slab.reach, thick = slab.thick;
  const auto half = [&](double n) {
    if (r * std::abs(n) <= thick) return r;
    return thick * std::abs(n) + std::sqrt((r * r - thick * thick) * std::max(1 - n * n, 0.0));
  };
  return {half(slab.normal.x), half(slab.normal.y), half(slab.normal.z)};
}

// Whether a fit's surface may be steep, or turn away from the eye, anywhere within its reach. At X
// from its foot the gradient is c + H X with the Hessian H: along a ray d it is at most c . d + |H|
// |X| |d|, and its length |c| + |H| |X|. Largest at a corner of the box because rays are affine in
// the pixels.
bool may_be_steep(const View& view, const BlendRecords& records, std::size_t k,
                  const Slopes& slopes, const ScreenBox& box, const SampleGrid& grid) {
  const float* c = &records.record[k * kFitRecord];
  const double bend = slopes.bend * records.foot[4 * k + 3],
               room = bend + records::kSteep * (slopes.at_foot + bend) + 1e-3;
  for (const int i : {box.i0 - 1, box.i1 + 1})
    for (const int j : {box.j0 - 1, box.j1 + 1}) {
      const Vec3d d = ray_direction(view, grid.first + grid.step * i, grid.first + grid.step * j);
      const double along = c[1] * d.x + c[2] * d.y + c[3] * d.z;
      if (along + room * length(d) > 0) return true;
    }
  return false;
}

// Fits that are to be listed by tile: where rays are looked for that they concern, and then the
// lists.
struct Listing {
  std::size_t rows;  // of a place that the kernel reads
  std::vector<char> wanted;
  std::vector<ScreenBox> box;
  std::vector<std::array<float, 8>> place;  // see List in tile_lists.cl
  TileLists lists;

  Listing(std::size_t fits, std::size_t rows) : rows(rows), wanted(fits), box(fits), place(fits) {}

  void add(std::size_t k, const Slab& slab, const View& view, const SampleGrid& grid) {
    const double values[] = {slab.centre.x, slab.centre.y, slab.centre.z, slab.reach,
                             slab.normal.x, slab.normal.y, slab.normal.z, slab.thick};
    std::ranges::transform(values, place[k].begin(),
                           [](double v) { return static_cast<float>(v); });
    box[k] = box_of(view, slab.centre, half_sides(slab), grid);
    wanted[k] = 1;
  }

  // As FitList has them on the device.
  void write(cl_int* start, cl_int* fit, float* places) const {
    const std::vector<cl_int>& listed = lists.box;
    const std::size_t stride = listed.size();
    std::ranges::copy(lists.start, start);
    std::ranges::copy(listed, fit);
    parallel_for(stride, 8 * kFitsAThread, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        for (std::size_t row = 0; row < rows; ++row)
          places[row * stride + i] = place[static_cast<std::size_t>(listed[i])][row];
    });
  }
};

}  // namespace

ScreenBox box_of(const View& view, const Vec3d& centre, const Vec3d& half, const SampleGrid& grid) {
  double u0 = 1e30, u1 = -1e30, v0 = 1e30, v1 = -1e30;
  for (const double side : {-half.z, half.z}) {
    const PixelPosition at =
        project(view, {centre.x, centre.y, std::min(centre.z + side, -view.near_depth)});
    const auto extent = [&](const std::array<double, 4>& row) {
      return (std::abs(row[0]) * half.x + std::abs(row[1]) * half.y) / at.w;
    };
    const double wide = extent(view.u_row), high = extent(view.v_row);
    u0 = std::min(u0, at.u - wide);
    u1 = std::max(u1, at.u + wide);
    v0 = std::min(v0, at.v - high);
    v1 = std::max(v1, at.v + high);
  }
  const auto sample = [&](double pixel, int last) {
    return static_cast<int>(std::clamp((pixel - grid.first) / grid.step, -1.0, last + 1.0));
  };
  return {std::max(0, sample(u0, grid.nx)), std::min(grid.nx - 1, sample(u1, grid.nx) + 1),
          std::max(0, sample(v0, grid.ny)), std::min(grid.ny - 1, sample(v1, grid.ny) + 1)};
}

TileLists list_boxes(const std::vector<ScreenBox>& boxes, const std::vector<char>& wanted,
                     const SampleGrid& grid) {
  TileLists tiles;
  tiles.nx = (grid.nx + kTile - 1) / kTile;
  tiles.ny = (grid.ny + kTile - 1) / kTile;
  tiles.start.assign(static_cast<std::size_t>(tiles.nx) * tiles.ny + 1, 0);
  const auto each_tile = [&](auto&& visit) {
    for (std::size_t b = 0; b < boxes.size(); ++b) {
      if (!wanted[b]) continue;
      const ScreenBox& box = boxes[b];
      for (int j = box.j0 / kTile; j * kTile <= box.j1; ++j)
        for (int i = box.i0 / kTile; i * kTile <= box.i1; ++i)
          visit(static_cast<std::size_t>(j) * tiles.nx + i, static_cast<cl_int>(b));
    }
  };
  each_tile([&](std::size_t tile, cl_int) { ++tiles.start[tile + 1]; });
  for (std::size_t t = 0; t + 1 < tiles.start.size(); ++t) tiles.start[t + 1] += tiles.start[t];
  tiles.box.resize(tiles.start.back());
  std::vector<cl_int> next(tiles.start.begin(), tiles.start.end() - 1);
  each_tile([&](std::size_t tile, cl_int b) { tiles.box[next[tile]++] = b; });
  return tiles;
}

FitTiles list_fits(Device& device, const View& view, const BlendRecords& records,
                   const SampleGrid& grid) {
  Listing met(records.size(), 8), rim(records.size(), 4);
  parallel_for(records.size(), kFitsAThread, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const float *c = &records.record[k * kFitRecord], reach = records.foot[4 * k + 3];
      if (!(reach > 0)) continue;
      const Slopes slopes = slopes_of(c);
      if (c[records::FIT_WEIGHT] > 0) met.add(k, slab_of(records, k, slopes, 0), view, grid);
      if (!(c[records::FIT_END_WEIGHT] > 0)) continue;
      const double deep = kRimDepth * (slopes.at_foot + slopes.bend * reach);
      rim.add(k, slab_of(records, k, slopes, deep), view, grid);
      rim.wanted[k] = may_be_steep(view, records, k, slopes, rim.box[k], grid);
    }
  });
  parallel_both([&] { met.lists = list_boxes(met.box, met.wanted, grid); },
                [&] { rim.lists = list_boxes(rim.box, rim.wanted, grid); });
  const std::size_t starts = met.lists.start.size(), of_met = met.lists.box.size(),
                    of_rim = rim.lists.box.size();
  UploadTogether<cl_int, cl_int, float, cl_int, cl_int, float> arrays(
      device, {starts, of_met, met.rows * of_met, starts, of_rim, rim.rows * of_rim});
  met.write(arrays.data<0>(), arrays.data<1>(), arrays.data<2>());
  rim.write(arrays.data<3>(), arrays.data<4>(), arrays.data<5>());
  const auto [met_start, met_fit, met_place, rim_start, rim_fit, rim_place] = arrays.done();
  return {
      met.lists.nx, met.lists.ny, {met_start, met_fit, met_place}, {rim_start, rim_fit, rim_place}};
}

}  // namespace meniscus
