// sheet: what the fits of one sheet have in common. Means over them go on along a sheet's edge,
// where those over all fits around would mix two sheets.
#pragma once

#include <vector>

#include "device/device.hpp"
#include "device/records.hpp"
#include "stages/frame/cells.hpp"
#include "stages/frame/density.hpp"
#include "stages/vec.hpp"

namespace meniscus {

/// Which fits belong to the sheet of another, and how much they count: at distance l, with the
/// normals n and n', share (1 - l / reach) smoothstep(low, high, n.n'), nothing beyond reach.
using records::SheetWeights;

/// Fits in cells of the weights' reach on the device, and what is averaged of them.
struct SheetFits {
  DeviceCells cells;     // without weights
  Buffer<float> normal;  // [3][n] unit, in bucket order
  Buffer<float> share;   // [n] how much each fit counts, 0 .. 1
  Buffer<float> value;   // [values][n], one or three
};

/// The means of the values over the sheet around each fit, [values][n] in bucket order. Does not
/// wait.
void average_sheet(Device& device, const SheetFits& fits, const SheetWeights& weights,
                   const Buffer<float>& mean);

}  // namespace meniscus
