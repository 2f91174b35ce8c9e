// Whitewater in double precision: every particle and every pixel, one after the other.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "meniscus/types.hpp"
#include "stages/vec.hpp"
#include "verify/reference/epsilon.hpp"
#include "verify/reference/project.hpp"

namespace meniscus::reference {

/// A particle of whitewater; world units and world units per second.
struct Drop {
  std::array<double, 3> at;
  double radius;
  Vec3d velocity;
};

/// The same on the screen, and bounds of what single precision adds.
struct Disc {
  double depth, u, v, half_u, half_v;  // particle radii of the water; pixels
  double depth_error, border_error;    // of the depth; of where the border lies, pixels
  bool seen, sure;                     // beyond the near plane; whether single precision sees it so
};

inline Disc disc_of(const Camera& camera, double radius, double near_depth, const Drop& drop) {
  const ProjectedParticle p =
      project(camera, radius, {0, 0, 0}, drop.at, drop.radius / radius, kEpsilon);
  Disc disc{-p.eye[2], p.u, p.v, p.ku, p.kv, p.eye_error[2], 0, false, false};
  disc.border_error = p.u_error + p.v_error + (p.k_error + 2 * kEpsilon) * std::max(p.ku, p.kv);
  disc.seen = disc.depth > near_depth;
  disc.sure = std::abs(disc.depth - near_depth) > disc.depth_error + kEpsilon * near_depth;
  return disc;
}

/// The area in which an ellipse and the pixel (i, j) overlap: the integral over the height y = sin
/// a of the part of the chord, from -cos a to cos a in half axes, that lies in the pixel. Between
/// the angles at which the chord passes a side of the pixel the integrand is smooth.
inline double overlap(const Disc& disc, int i, int j) {
  const double x0 = (i - disc.u) / disc.half_u, x1 = (i + 1 - disc.u) / disc.half_u;
  const auto angle = [](double y) { return std::asin(std::clamp(y, -1.0, 1.0)); };
  const double low = angle((j - disc.v) / disc.half_v),
               high = angle((j + 1 - disc.v) / disc.half_v);
  std::vector<double> ends{low, high};
  for (const double x : {x0, x1})
    if (std::abs(x) < 1)
      for (const double a : {std::acos(std::abs(x)), -std::acos(std::abs(x))})
        if (a > low && a < high) ends.push_back(a);
  std::sort(ends.begin(), ends.end());
  // Gauss and Legendre, eight points.
  constexpr std::array<double, 4> kAt{0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                      0.9602898564975363},
      kWeight{0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
  double sum = 0;
  for (std::size_t k = 0; k + 1 < ends.size(); ++k) {
    const double middle = (ends[k] + ends[k + 1]) / 2, half = (ends[k + 1] - ends[k]) / 2;
    for (std::size_t g = 0; g < kAt.size(); ++g)
      for (const double a : {middle - half * kAt[g], middle + half * kAt[g]}) {
        const double chord = std::cos(a);
        const double part = std::max(0.0, std::min(x1, chord) - std::max(x0, -chord));
        sum += half * kWeight[g] * part * chord;
      }
  }
  return sum * disc.half_u * disc.half_v;
}

/// Discs with a longer half axis get a border that is a pixel wide.
inline constexpr double kWide = 64;

inline double share_of_pixel(const Disc& disc, int i, int j) {
  if (disc.half_u <= kWide && disc.half_v <= kWide) return overlap(disc, i, j);
  const double away =
      std::hypot((i + 0.5 - disc.u) / disc.half_u, (j + 0.5 - disc.v) / disc.half_v);
  return std::clamp((1 - away) * std::min(disc.half_u, disc.half_v) + 0.5, 0.0, 1.0);
}

/// What single precision adds to a share. A border that moves changes areas by its length in the
/// pixel, at most, times how far it moves: a convex one is not longer there than the pixel's own
/// (4), nor than it is altogether. The area of the unit disc is worked out to 2e-6; lengths over
/// half axes of wide discs round to a few parts of their size.
inline double share_error(const Disc& disc) {
  const double half = std::max(disc.half_u, disc.half_v);
  if (half > kWide) return 4 * disc.border_error + 8 * kEpsilon * half + 8 * kEpsilon;
  return std::min(4.0, 2 * M_PI * half) * disc.border_error + 2e-6 * disc.half_u * disc.half_v;
}

/// A pixel's sums, and bounds of what single precision adds to what is told from them.
struct WhitewaterPixel {
  double density = 0, left = 1;  // left: 1 - coverage
  double depth = INFINITY;       // particle radii of the water; of discs that surely touch it
  double perhaps = INFINITY;     // the same of those of which single precision may think otherwise
  Vec3d velocity{};              // sums of shares times velocities and depths behind the front
  double behind = 0;
  double density_error = 0, coverage_error = 0, depth_error = 0;
  double velocity_error = 0, behind_error = 0;  // of the sums, both of lengths
  bool sure = true;                             // single precision may not decide otherwise
  bool depth_is_sure() const { return std::isinf(perhaps) || perhaps > depth + depth_error; }
};

/// All pixels. A particle is seen where its depth lies within `from` and `to`.
///
///   from, to  [pixels] particle radii of the water
///   slack     the front lies so far behind `from`
inline std::vector<WhitewaterPixel> whitewater(const Camera& camera, double radius,
                                               double near_depth, const std::vector<Drop>& drops,
                                               const std::vector<double>& from,
                                               const std::vector<double>& to, double slack) {
  std::vector<WhitewaterPixel> pixels(from.size());
  for (const Drop& drop : drops) {
    const Disc disc = disc_of(camera, radius, near_depth, drop);
    if (!(disc.seen || !disc.sure)) continue;
    const double error = share_error(disc);
    for (int j = 0; j < camera.height; ++j)
      for (int i = 0; i < camera.width; ++i) {
        const auto s = static_cast<std::size_t>(j) * static_cast<std::size_t>(camera.width) +
                       static_cast<std::size_t>(i);
        const double u = i + 0.5 - disc.u, v = j + 0.5 - disc.v, around = 0.5 + disc.border_error;
        const bool wide = disc.half_u > kWide || disc.half_v > kWide;
        const double most = wide ? 1 : around;  // from the border, where there may be a share
        if (std::abs(u) > disc.half_u + most || std::abs(v) > disc.half_v + most) continue;
        const double share = share_of_pixel(disc, i, j);
        WhitewaterPixel& pixel = pixels[s];
        const double close = disc.depth_error + 2 * kEpsilon * disc.depth;
        const bool shown = disc.depth >= from[s] && disc.depth <= to[s];
        if (std::abs(disc.depth - from[s]) <= close || std::abs(disc.depth - to[s]) <= close ||
            !disc.sure)
          pixel.sure = false;
        if (!shown) continue;
        if (share <= error) pixel.perhaps = std::min(pixel.perhaps, disc.depth - close);
        const double behind = std::max(0.0, disc.depth - (from[s] + slack));
        pixel.density += share;
        pixel.left *= 1 - std::min(share, 1.0);
        if (share > error && disc.depth < pixel.depth) {
          pixel.depth = disc.depth;
          pixel.depth_error = close;
        }
        pixel.velocity = pixel.velocity + drop.velocity * share;
        pixel.behind += share * behind;
        // Of a share of 2^-32 a whole step may be lost.
        const double step = 0x1p-31;
        pixel.density_error += error + step;
        pixel.coverage_error += error + 4e-6 * share + step;
        // A step of velocity is two particle radii per second at most.
        pixel.velocity_error +=
            (error + 4 * kEpsilon * share) * length(drop.velocity) + 4 * step * radius;
        pixel.behind_error += error * behind + share * (close + 4 * kEpsilon * behind) + step;
      }
  }
  return pixels;
}

}  // namespace meniscus::reference
