#include "stages/other_methods/anisotropic.hpp"

#include <algorithm>

#include "device/kernels.hpp"
#include "stages/frame/density.hpp"
#include "stages/sample/surface_buffers.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kRows = 11;  // of shapes

}  // namespace

double reach_of(const AnisotropicParams& params) {
  return 2 * params.h * std::max(kMostStretch * params.k_s, params.k_n);
}

AnisotropicKernels shape_kernels(Device& device, const Projected& particles,
                                 const AnisotropicParams& params) {
  const std::size_t n = particles.size();
  const Cells near =
      make_cells(particles.x, particles.y, particles.z, static_cast<float>(2 * params.h));
  const auto found = allocate<float>(device, kRows * n);
  // The variance along an axis of a full ball of radius 2 h with the weights 1 - (d / 2h)^3.
  const double full = 0.15 * ((2 * params.h) * (2 * params.h));
  launch(device, kernels::shape_kernels, 1, {n}, upload_points(device, near),
         upload(device, near.start), found, static_cast<cl_int>(n),
         records::CellGrid{near.inverse_cell, near.mask},
         records::KernelShape{static_cast<float>(params.h), static_cast<float>(params.lambda),
                              static_cast<float>(params.k_s / full),
                              static_cast<float>(kMostStretch * params.k_s),
                              static_cast<float>(params.k_r), static_cast<float>(params.k_n),
                              static_cast<float>(params.n_eps)});
  const std::vector<float> shapes = download(device, found);

  const auto row = [&](std::size_t r) {
    const auto first = shapes.begin() + static_cast<std::ptrdiff_t>(r * n);
    return std::vector<float>(first, first + static_cast<std::ptrdiff_t>(n));
  };
  const Cells cells = make_cells(row(0), row(1), row(2), static_cast<float>(reach_of(params)));
  AnisotropicKernels kernels;
  kernels.host_shapes.resize(kRows * n);
  for (std::size_t r = 0; r < kRows; ++r)
    for (std::size_t p = 0; p < n; ++p)
      kernels.host_shapes[r * n + p] = shapes[r * n + static_cast<std::size_t>(cells.item[p])];
  kernels.x = upload(device, cells.x);
  kernels.y = upload(device, cells.y);
  kernels.z = upload(device, cells.z);
  kernels.start = upload(device, cells.start);
  kernels.shapes = upload(device, kernels.host_shapes);
  kernels.count = static_cast<int>(n);
  kernels.grid = {cells.inverse_cell, cells.mask};
  return kernels;
}

std::vector<SurfaceSample> cast_field(Device& device, const View& view,
                                      const AnisotropicKernels& kernels, const FieldRays& rays,
                                      double level) {
  const std::size_t n = rays.from.size;
  require(rays.points.size() == 2 * n && rays.to.size == n,
          "cast_field: points, from and to have different sizes");
  const auto depth = allocate<float>(device, n);
  const auto normal = allocate<float>(device, 3 * n);
  launch(device, kernels::cast_field, 1, {n}, upload(device, rays.points), rays, depth, normal,
         kernels, kernels.grid,
         records::FieldRays{static_cast<int>(n), kernels.count, static_cast<float>(level),
                            kernel_rays(view)});
  const std::vector<float> t = download(device, depth), m = download(device, normal);
  std::vector<SurfaceSample> samples(n);
  for (std::size_t k = 0; k < n; ++k) samples[k] = {t[k], {m[k], m[n + k], m[2 * n + k]}};
  return samples;
}

}  // namespace meniscus
