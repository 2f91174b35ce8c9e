// neighbours: the particles that each fit weighs, in lists as the device takes them, and the fits
// in cells.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "device/device.hpp"
#include "stages/frame/cells.hpp"
#include "stages/frame/density.hpp"
#include "stages/frame/near_lists.hpp"
#include "stages/frame/project.hpp"
#include "stages/frame/visible.hpp"

namespace meniscus {

/// Over which fits residuals are averaged, particle radii.
inline constexpr float kResidualReach = 6;

/// The neighbours of fits, as kernel fit_particles takes them: fits in batches of 16 lanes,
/// those with about as many neighbours together. Neighbour k of lane l is in slot first[l / 16] + l
/// % 16 + 16 k.
struct NeighbourLists {
  std::vector<std::int32_t> fit;      // [lanes] -1: the lane is not in use
  std::vector<cl_int> particle;       // [lanes] the fit's place in the surface, else nobody's
  std::vector<cl_int> first, length;  // [batches] first slot; slots a lane
  std::vector<cl_int> neighbour;      // [slots] places in the surface; nobody's: not in use
};

/// Lists of all particles of `around` within `reach` of each of `centre`, one or several where that
/// makes more than `most_slots` slots.
std::vector<NeighbourLists> list_neighbours(const Projected& projected,
                                            const std::vector<std::int32_t>& centre,
                                            const std::vector<std::int32_t>& around, double reach,
                                            std::size_t most_slots);

/// Fits in cells of side kResidualReach, in which they are averaged (average_lanes()).
struct LaneCells {
  Cells host;
  DeviceCells cells;               // the same, without weights
  std::vector<Buffer<cl_int>> to;  // of each part of the neighbours: [lanes] where each one's fit
                                   // is in bucket order, -1: the lane is not in use
};

/// Lists of neighbours on the device, and the fits of their lanes.
struct FitNeighbours {
  struct Part {
    NeighbourLists lists;  // but for the neighbours
    Buffer<cl_int> particle;
    Buffer<float> influence;  // [lanes] Visible::influence of the fit
    Buffer<cl_int> neighbour, first, length;
  };
  std::vector<Part> parts;
  LaneCells sheet;
};

/// Lists of neighbours, as list_near() makes them of the same arrays, on the device. Throws
/// DeviceError.
FitNeighbours upload_neighbours(Device& device, const Projected& projected, const NearLists& near,
                                const Visible& centre, const std::vector<std::int32_t>& around);

/// What fits need of places alone: the neighbours within `reach` (particle radii) of each of
/// `centre` among the surface's particles `around`. Throws DeviceError.
FitNeighbours find_neighbours(Device& device, const Projected& projected, const Visible& centre,
                              const std::vector<std::int32_t>& around, double reach);

}  // namespace meniscus
