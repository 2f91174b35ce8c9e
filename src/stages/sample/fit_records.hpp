// fit_records: fits as kernels take them, for rays that meet them and for points near them
// (hits.cl).
#pragma once

#include <vector>

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/fit/particle_fit.hpp"

namespace meniscus {

/// Floats of a fit's record.
inline constexpr std::size_t kFitRecord = records::FIT;

/// Fits as kernels take them, see hits.cl.
struct BlendRecords {
  std::vector<float> record;  // [fits][kFitRecord]
  std::vector<float> foot;  // [fits][4] eye space; reach of the weight, particle radii; 0: does not
                            // count
  std::size_t size() const { return foot.size() / 4; }
};

/// The same on the device.
struct DeviceRecords {
  Buffer<float> record, foot;
};

/// The weight (1 - D²)³ of kernel blend_groups is as wide as Wendland's function on this share of
/// its radius.
inline constexpr double kBlendReach = 0.84;

/// The records of fits. A fit's weight reaches `radius` times the share of the full support that
/// its own has, but at least 0.7, and counts e v trust; where it tells that the fluid ends, e u
/// trust (kernel blend_groups).
///
///   trust   [fits] 0 .. 1
///   radius  particle radii
BlendRecords make_records(const ParticleFits& fits, const std::vector<double>& trust,
                          const FitParams& fit, double radius);

/// Lifts fits by how far they lie inside the surface on the mean over their weights. Around
/// particles that bend by k the surface, one radius outside, bends by k / (1 + k), but a quadric
/// goes on to bend by k: in either principal direction it is (k - k / (1 + k)) x² / 2 too low at x
/// from its foot (docs/method.md, blend).
void lift_bends(BlendRecords& records);

/// Adds the records of more fits.
void append(BlendRecords& records, const BlendRecords& more);

DeviceRecords upload_records(Device& device, const BlendRecords& records);

}  // namespace meniscus
