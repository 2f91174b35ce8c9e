#include "stages/sample/fit_records.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/parallel.hpp"
#include "device/together.hpp"

namespace meniscus {
namespace {

constexpr double kLeastTrust = 0.01;  // fits trusted less do not count
constexpr double kLeastReach = 0.7;   // share of the weight's radius that narrow supports leave
constexpr double kExtent = 1.8;       // of a group's squared radius goes into its weight's
constexpr double kFitted = 0.8;       // of its support a group's weight reaches at most
constexpr double kMeanSquare = 0.1;   // of a distance to one side over (1 - D²)³, of the reach's
constexpr double kKnownBend = 0.3;    // of a quadric; drops that bend more have too few particles
constexpr double kSeen = 1e-3;        // fits that are seen less only end sheets: no ray meets them
constexpr std::size_t kFitsAThread = 512;  // that are worth one

// What a round fit has at FIT_ROUND, see pull_of and leeway_of in hits.cl.
constexpr double kRoundest = 0.9;
static_assert(static_cast<float>(kRoundest) == records::kRoundest);

// The radius of a fit's weight: `radius` times its share of the full support; of a group's fit
// the root of its square and of 1.8 times the square of the group's extent, but at most .8 of its
// support: beyond it the quadric follows nothing.
double reach_of(const ParticleFits& fits, std::size_t k, const FitParams& fit, double radius) {
  const double alone = radius * std::max(fits.support[k] / fit.support, kLeastReach);
  if (fits.extent.empty()) return alone;
  return std::min(std::sqrt(alone * alone + kExtent * fits.extent[k] * fits.extent[k]),
                  kFitted * fits.support[k]);
}

// How far a fit lies inside the surface on the mean over its weight, particle radii, from its
// record.
double sinks_by(const float* record) {
  const auto [xx, yy, zz, xy, yz, xz] =
      std::array{2.0 * record[4],   2.0 * record[5],   2.0 * record[6],
                 double{record[7]}, double{record[8]}, double{record[9]}};  // second derivatives
  const Vec3d gradient{record[1], record[2], record[3]};
  const Vec3d n = gradient / length(gradient);
  const Vec3d along{xx * n.x + xy * n.y + xz * n.z, xy * n.x + yy * n.y + yz * n.z,
                    xz * n.x + yz * n.y + zz * n.z};
  // Across n: their trace, and the sum of their squares, give both principal bends.
  const double in_depth = dot(along, n), sum = xx + yy + zz - in_depth;
  const double squares = xx * xx + yy * yy + zz * zz + 2 * (xy * xy + yz * yz + xz * xz) -
                         2 * dot(along, along) + in_depth * in_depth;
  const double apart = std::sqrt(std::max(2 * squares - sum * sum, 0.0));
  double too_much = 0;
  for (const double twice : {sum + apart, sum - apart}) {
    const double bend = std::clamp(twice / 2, -kKnownBend, kKnownBend);
    too_much += bend - bend / (1 + bend);
  }
  return too_much / 2 * kMeanSquare / record[records::FIT_NARROWNESS];
}

}  // namespace

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
                             kRoundest * fits.roundness[k]};
    std::ranges::transform(record, &records.record[k * kFitRecord],
                           [](double v) { return static_cast<float>(v); });
    const double place[] = {foot.x, foot.y, foot.z, reach};
    std::ranges::transform(place, &records.foot[4 * k],
                           [](double v) { return static_cast<float>(v); });
  };
  parallel_for(fits.size(), kFitsAThread, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) make(k);
  });
  return records;
}

void lift_bends(BlendRecords& records) {
  parallel_for(records.size(), kFitsAThread, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      if (records.foot[4 * k + 3] == 0) continue;
      float* const record = &records.record[k * kFitRecord];
      const double slope = length(Vec3d{record[1], record[2], record[3]});
      record[0] = static_cast<float>(record[0] - sinks_by(record) * slope);
    }
  });
}

void append(BlendRecords& records, const BlendRecords& more) {
  records.record.insert(records.record.end(), more.record.begin(), more.record.end());
  records.foot.insert(records.foot.end(), more.foot.begin(), more.foot.end());
}

DeviceRecords upload_records(Device& device, const BlendRecords& records) {
  const auto [record, foot] = upload_together(device, records.record, records.foot);
  return {record, foot};
}

}  // namespace meniscus
