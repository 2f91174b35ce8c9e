// density: the particles' density field, which ends the contour (paper 2.4.1) and draws the splash
// (paper, end of 3).
#pragma once

#include "device/device.hpp"
#include "device/records.hpp"
#include "device/together.hpp"
#include "meniscus/parameters.hpp"
#include "stages/frame/cells.hpp"
#include "stages/vec.hpp"

namespace meniscus {

/// Radius beyond which a particle adds nothing to the density: twice the smoothing length s, which
/// is two particle radii.
inline constexpr float kDensitySupport = records::kDensitySupport;

/// A hash grid on the device.
struct DeviceCells {
  Buffer<float> x, y, z;  // [n] eye space in bucket order, particle radii
  Buffer<float> weight;   // [n] a particle's share in the field is multiplied by this
  Buffer<cl_uint> tag;    // [n] of each particle's cell (cells.hpp)
  Buffer<cl_int> start;   // [buckets + 1]
  records::CellGrid grid{1, 0};
};

/// Cells whose particles have other values.
struct CellsWith {
  const Buffer<float>&x, &y, &z, &values;
  const Buffer<cl_uint>& tag;
  const Buffer<cl_int>& start;
  records::CellGrid grid;
};
inline CellsWith cells_with(const DeviceCells& cells, const Buffer<float>& values) {
  return {cells.x, cells.y, cells.z, values, cells.tag, cells.start, cells.grid};
}

/// Points, [n] each, particle radii.
struct DevicePoints {
  Buffer<float> x, y, z;
};

/// Uploads the points of cells, in bucket order.
DevicePoints upload_points(Device& device, const Cells& cells);

/// Work-items for n particles of cells that are taken cell by cell.
Range range_of_blocks(std::size_t n, int width);

/// Uploads cells without weights, and other arrays with them.
template <class... T>
std::tuple<DeviceCells, Buffer<T>...> upload_with_cells(Device& device, const Cells& cells,
                                                        const std::vector<T>&... values) {
  return std::apply(
      [&](const auto& x, const auto& y, const auto& z, const auto& tag, const auto& start,
          const auto&... others) {
        return std::tuple{DeviceCells{x, y, z, {}, tag, start, {cells.inverse_cell, cells.mask}},
                          others...};
      },
      upload_together(device, cells.x, cells.y, cells.z, cells.tag, cells.start, values...));
}

/// Uploads cells; every weight is `mass`, with which the density of a fluid is 1 that has a
/// particle in each 8 `mass` cubic particle radii.
DeviceCells upload_cells(Device& device, const Cells& cells, float mass = 1);

/// The density at eye-space points (particle radii). Waits.
std::vector<float> measure_density(Device& device, const DeviceCells& cells,
                                   const std::vector<Vec3d>& points);

/// The same of points [3][rows][n], into the first values of `density`, [rows][n]. Points of a cell
/// share a search where they are near to each other in their order, too, and so do those at one
/// place of the rows. Does not wait.
void measure_density(Device& device, const DeviceCells& cells, const Buffer<float>& points,
                     const Buffer<float>& density, int rows = 1);

/// Where each of the 27 cells around a particle holds as many, and half of their mean number, it is
/// inside the fluid. There are eight on average.
inline constexpr int kFilledCell = 4;

/// Which particles' gradients are measured: all, or, where every weight is 1, those that may be
/// near air. Inside the fluid the gradient is taken for 0 and the density for 1, which stand for
/// all that measuring would find there, unless the particle radius is much too large: a face less
/// than half a cell away is missed then (docs/method.md).
enum class Measured { everywhere, near_air };

/// Gradient (1 / particle radii) and value of the field at the particles' own positions, [4][n] in
/// bucket order: x, y, z, density. Does not wait.
Buffer<float> measure_gradients(Device& device, const DeviceCells& cells,
                                Measured where = Measured::everywhere);

/// The same into `field`, 4 n values, and cells whose weights even the field's level out:
/// params.blob_density for a lone particle, 0.45 inside the fluid. Does not wait.
///
///   lone  times its weight a lone particle counts, >= 1 (lone_factor()); others the less of it the
///         more they are among others
DeviceCells level_cells(Device& device, const DeviceCells& cells, Measured where,
                        const RegionParams& params, const Buffer<float>& field, double lone = 1);

}  // namespace meniscus
