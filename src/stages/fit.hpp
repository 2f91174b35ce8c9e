// fit: one implicit quadric per group by weighted least squares (paper 2.3, Eq. 2).
#pragma once

#include <array>
#include <vector>

#include "device/device.hpp"
#include "meniscus/parameters.hpp"

namespace meniscus {

/// f(X) = c0 + c1 x + c2 y + c3 z + c4 xx + c5 yy + c6 zz + c7 xy + c8 yz + c9 zx with X in
/// particle radii from the group's centre along the eye axes. f is near a signed distance (particle
/// radii, positive outside) and zero on the surface: the offset is part of it.
struct Quadrics {
  std::vector<std::array<float, 10>> coefficient;  // [groups]
  std::vector<float> residual;  // [groups] weighted RMS of f at the points, particle radii;
                                // negative where there is no fit
};

/// How kernel fit_groups takes many problems: in batches of eight lanes, those of like size
/// together. Point k of lane l lies in slot first[l / 8] + l % 8 + 8 k.
struct FitBatches {
  std::vector<std::int32_t> order;    // [problems] problem of each lane
  std::vector<cl_int> first, length;  // [batches] first slot; slots a lane
  std::size_t lanes = 0, slots = 0;   // in all
  std::size_t first_slot(std::size_t lane) const {
    return static_cast<std::size_t>(first[lane / 8]) + lane % 8;
  }
};

/// The most slots that 32-bit indices reach.
inline constexpr std::size_t kMostSlots = std::size_t{1} << 28;

/// Batches for problems of the given numbers of points, in parts of at most `most_slots` slots, or of
/// one batch where that has more. There is a part even for no problems. Throws InvalidArgument when
/// a batch has too many slots for 32-bit indices.
std::vector<FitBatches> make_batches(const std::vector<std::size_t>& points,
                                     std::size_t most_slots = kMostSlots);

/// Batches on the device.
struct DeviceFits {
  Buffer<float> points;          // [7][slots] x, y, z over the scale; normal; weight
  Buffer<cl_int> first, length;  // [batches]
  Buffer<float> scale;           // [lanes] R, particle radii
  Buffer<float> quadric;         // [10][lanes] out
  Buffer<float> quality;         // [2][lanes] out: residual, negative without a fit; |grad f|
  std::size_t lanes = 0, slots = 0;
};

/// Launches kernel fit_groups: the quadric of each lane's points, through them (the offset is not
/// part of it). Does not wait.
void fit_batches(Device& device, const DeviceFits& fits, const FitParams& params);

}  // namespace meniscus
