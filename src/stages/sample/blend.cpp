#include "stages/sample/blend.hpp"

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "device/kernels.hpp"
#include "device/together.hpp"

namespace meniscus {
namespace {

constexpr double kLeastTrust = 0.01;  // fits trusted less do not count
constexpr double kLeastReach = 0.7;   // share of the weight's radius that narrow supports leave
constexpr double kExtent = 1.8;       // of a group's squared radius goes into its weight's
constexpr double kFitted = 0.8;       // of its support a group's weight reaches at most
constexpr double kRimDepth = 2;       // particle radii from where a fit ends sheets, see hidden.cl
constexpr std::size_t kGrain = 512;   // fits that are worth a thread

// What a round fit has in the last value of its record, see pull_of and leeway_of in hits.cl.
constexpr double kRound = 0.9;

// Screen box, in samples; both ends included. Empty when i1 < i0.
struct Box {
  int i0, i1, j0, j1;
};

// The box around the projections of a box in eye space, from its middle and half sides. At one
// depth a pixel coordinate is linear in x and y.
Box box_of(const View& view, const Vec3d& centre, const Vec3d& half, const SampleGrid& grid) {
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

// The wanted boxes that meet each tile.
TileLists list_boxes(const std::vector<Box>& boxes, const std::vector<char>& wanted,
                     const SampleGrid& grid) {
  TileLists tiles;
  tiles.nx = (grid.nx + kTile - 1) / kTile;
  tiles.ny = (grid.ny + kTile - 1) / kTile;
  tiles.start.assign(static_cast<std::size_t>(tiles.nx) * tiles.ny + 1, 0);
  const auto each_tile = [&](auto&& visit) {
    for (std::size_t g = 0; g < boxes.size(); ++g) {
      if (!wanted[g]) continue;
      const Box& box = boxes[g];
      for (int j = box.j0 / kTile; j * kTile <= box.j1; ++j)
        for (int i = box.i0 / kTile; i * kTile <= box.i1; ++i)
          visit(static_cast<std::size_t>(j) * tiles.nx + i, static_cast<cl_int>(g));
    }
  };
  each_tile([&](std::size_t tile, cl_int) { ++tiles.start[tile + 1]; });
  for (std::size_t t = 0; t + 1 < tiles.start.size(); ++t) tiles.start[t + 1] += tiles.start[t];
  tiles.group.resize(tiles.start.back());
  std::vector<cl_int> next(tiles.start.begin(), tiles.start.end() - 1);
  each_tile([&](std::size_t tile, cl_int g) { tiles.group[next[tile]++] = g; });
  return tiles;
}

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
                  const Slopes& slopes, const Box& box, const SampleGrid& grid) {
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

// The lists of FITS_OF_TILES.
struct FitsOfTiles {
  const Buffer<cl_int>&met_start, &met;
  const Buffer<float>& met_place;
  const Buffer<cl_int>&rim_start, &rim;
  const Buffer<float>& rim_place;
  cl_int2 strides;  // values in a row of the lists' places
};

FitsOfTiles lists_of(const FitTiles& tiles) {
  const auto &met = tiles.met, &rim = tiles.rim;
  return {met.start,
          met.fit,
          met.place,
          rim.start,
          rim.fit,
          rim.place,
          {{static_cast<cl_int>(met.fit.size), static_cast<cl_int>(rim.fit.size)}}};
}

}  // namespace

records::Blending blending_of(const BlendParams& params) {
  return {static_cast<float>(params.d_max), static_cast<float>(params.same_low),
          static_cast<float>(params.same_high), static_cast<float>(params.crease)};
}

double reach_of(const ParticleFits& fits, std::size_t k, const FitParams& fit, double radius) {
  const double alone = radius * std::max(fits.support[k] / fit.support, kLeastReach);
  if (fits.extent.empty()) return alone;
  return std::min(std::sqrt(alone * alone + kExtent * fits.extent[k] * fits.extent[k]),
                  kFitted * fits.support[k]);
}

BlendRecords make_records(const ParticleFits& fits, const std::vector<double>& trust,
                          const FitParams& fit, double radius) {
  BlendRecords records{std::vector<float>(fits.size() * kFitRecord),
                       std::vector<float>(fits.size() * 4)};
  const auto make = [&](std::size_t k) {
    if (fits.residual[k] < 0 || !(trust[k] > kLeastTrust)) return;
    const Vec3d& foot = fits.foot[k];
    const double reach = reach_of(fits, k, fit, radius), weight = fits.edge[k] * trust[k];
    const std::array<float, 10>& c = fits.quadric[k];
    // The same function around the foot.
    const auto [value, gradient] = level_at(c, foot - fits.position[k]);
    const double record[] = {value,
                             gradient.x,
                             gradient.y,
                             gradient.z,
                             c[4],
                             c[5],
                             c[6],
                             c[7],
                             c[8],
                             c[9],
                             1 / (reach * reach),
                             fits.visible[k] < kSeen ? 0 : weight * fits.visible[k],
                             1 / trust[k],
                             weight * fits.surface[k],
                             fits.firmness[k] / fits.edge[k],
                             kRound * fits.roundness[k]};
    std::ranges::transform(record, &records.record[k * kFitRecord],
                           [](double v) { return static_cast<float>(v); });
    const double place[] = {foot.x, foot.y, foot.z, reach};
    std::ranges::transform(place, &records.foot[4 * k],
                           [](double v) { return static_cast<float>(v); });
  };
  parallel_for(fits.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) make(k);
  });
  return records;
}

void append(BlendRecords& records, const BlendRecords& more) {
  records.record.insert(records.record.end(), more.record.begin(), more.record.end());
  records.foot.insert(records.foot.end(), more.foot.begin(), more.foot.end());
}

DeviceRecords upload_records(Device& device, const BlendRecords& records) {
  const auto [record, foot] = upload_together(device, records.record, records.foot);
  return {record, foot};
}

TileLists list_tiles(const View& view, const GroupRecords& records, const SampleGrid& grid) {
  const std::size_t n = records.billboard.size();
  std::vector<char> wanted(n);
  std::vector<Box> boxes(n);
  for (std::size_t k = 0; k < n; ++k) {
    wanted[k] = records.billboard[k] > 0;
    const double r = records.billboard[k];
    if (wanted[k]) boxes[k] = box_of(view, records.centre[k], {r, r, r}, grid);
  }
  return list_boxes(boxes, wanted, grid);
}

FitTiles list_fits(Device& device, const View& view, const BlendRecords& records,
                   const SampleGrid& grid) {
  struct Fits {
    std::vector<char> wanted;
    std::vector<Box> box;
    std::vector<std::array<float, 8>> place;  // see List in tile_lists.cl
    std::size_t rows;                         // of these that the kernel reads
    TileLists lists;
  };
  const std::size_t n = records.size();
  const auto fits_of = [n](std::size_t rows) {
    return Fits{
        std::vector<char>(n), std::vector<Box>(n), std::vector<std::array<float, 8>>(n), rows, {}};
  };
  Fits met = fits_of(8), rim = fits_of(4);
  const auto list_slab = [&](Fits& fits, std::size_t k, const Slab& slab) {
    const double place[] = {slab.centre.x, slab.centre.y, slab.centre.z, slab.reach,
                            slab.normal.x, slab.normal.y, slab.normal.z, slab.thick};
    std::ranges::transform(place, fits.place[k].begin(),
                           [](double v) { return static_cast<float>(v); });
    fits.box[k] = box_of(view, slab.centre, half_sides(slab), grid);
    fits.wanted[k] = 1;
  };
  parallel_for(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const float *c = &records.record[k * kFitRecord], reach = records.foot[4 * k + 3];
      if (!(reach > 0)) continue;
      const Slopes slopes = slopes_of(c);
      if (c[11] > 0) list_slab(met, k, slab_of(records, k, slopes, 0));
      if (!(c[13] > 0)) continue;
      list_slab(rim, k,
                slab_of(records, k, slopes, kRimDepth * (slopes.at_foot + slopes.bend * reach)));
      rim.wanted[k] = may_be_steep(view, records, k, slopes, rim.box[k], grid);
    }
  });
  const auto list = [&](Fits& fits) { fits.lists = list_boxes(fits.box, fits.wanted, grid); };
  parallel_both([&] { list(met); }, [&] { list(rim); });
  const auto put = [&](const Fits& fits, cl_int* start, cl_int* fit, float* place) {
    const std::vector<cl_int>& listed = fits.lists.group;
    const std::size_t stride = listed.size();
    std::ranges::copy(fits.lists.start, start);
    std::ranges::copy(listed, fit);
    parallel_for(stride, 8 * kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        for (std::size_t row = 0; row < fits.rows; ++row)
          place[row * stride + i] = fits.place[static_cast<std::size_t>(listed[i])][row];
    });
  };
  const std::size_t starts = met.lists.start.size(), of_met = met.lists.group.size(),
                    of_rim = rim.lists.group.size();
  UploadTogether<cl_int, cl_int, float, cl_int, cl_int, float> arrays(
      device, {starts, of_met, met.rows * of_met, starts, of_rim, rim.rows * of_rim});
  put(met, arrays.data<0>(), arrays.data<1>(), arrays.data<2>());
  put(rim, arrays.data<3>(), arrays.data<4>(), arrays.data<5>());
  const auto [met_start, met_fit, met_place, rim_start, rim_fit, rim_place] = arrays.done();
  return {
      met.lists.nx, met.lists.ny, {met_start, met_fit, met_place}, {rim_start, rim_fit, rim_place}};
}

void blend_groups(Device& device, const View& view, const SampleLists& lists,
                  const DeviceRecords& records, const FitTiles& tiles,
                  const Buffer<float>& reference, const SurfaceBuffers& surface,
                  const BlendParams& params) {
  const int width = device.state().wide_width();
  launch(device, kernels::blend_groups, width, range_of(lists, width), lists, reference, records,
         lists_of(tiles), surface, screen_of(view, surface.grid), blending_of(params));
}

Buffer<cl_int> choose_groups(Device& device, const View& view, const SurfaceBuffers& surface,
                             const DeviceRecords& records, int every, const BlendParams& params) {
  const SampleGrid& grid = surface.grid;
  const int width = device.state().wide_width();
  constexpr int kChoiceRows = 8;  // as in choose_groups.cl
  const int rows = width == 1 ? 1 : kChoiceRows;
  const auto across = static_cast<std::size_t>((grid.nx + width - 1) / width);
  const auto down = static_cast<std::size_t>((grid.ny + rows - 1) / rows);
  const auto group = allocate<cl_int>(device, grid.size());
  launch(device, kernels::choose_groups, width, {across, down, 16, 1}, surface.depth, surface.group,
         records, group, screen_of(view, grid), static_cast<cl_float>(params.d_max), cl_int{every});
  return group;
}

void blend_points(Device& device, const View& view, const DeviceRecords& records,
                  const FitTiles& tiles, const SampleGrid& grid, const Buffer<float>& points,
                  const Buffer<float>& reference, const SurfaceBuffers& surface,
                  const BlendParams& params) {
  const std::size_t n = surface.grid.size();
  const meniscus::records::PointsOnTiles on{
      static_cast<int>(n),        tiles.nx,         tiles.ny, grid.first,
      1.0f / (grid.step * kTile), kernel_rays(view)};
  launch(device, kernels::blend_points, 1, {n}, reference, points, records, lists_of(tiles),
         surface, on, blending_of(params));
}

}  // namespace meniscus
