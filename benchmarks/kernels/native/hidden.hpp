// Faces that a ray does not meet, or far away, as hidden.cl has them. Everything has internal
// linkage.
#pragma once

#include "kernels/native/creases.hpp"
#include "kernels/native/tile_lists.hpp"

namespace meniscus::bench::native {
namespace {

constexpr float kWithin = -0.05f, kRoundLeeway = 0.2f, kSteep = 0.5f, kCredible = 0.05f,
                kLeastBend = 0.02f;
constexpr float kVouching = 1e-3f, kVouchingSure = 3e-4f, kMeeting = 0.1f;

// A fit at a point, and its weight where the fluid ends.
struct FaceValue {
  Floats f, gx, gy, gz, weight, per_slope;
};

// Returns whether any of the points is within the fit's reach.
[[gnu::always_inline]] inline bool face_at(const float* g, const float* foot, const Floats& x,
                                           const Floats& y, const Floats& z, FaceValue& face) {
  const Floats px = x - foot[0], py = y - foot[1], pz = z - foot[2];
  const Floats squared = square_of(px, py, pz) * g[10];
  if (!any(squared < 1.0f)) return false;
  gradient_at(g, px, py, pz, face.gx, face.gy, face.gz);
  const Floats slope = inverse_root(square_of(face.gx, face.gy, face.gz), 1e-20f);
  face.f = value_at(g, px, py, pz, face.gx, face.gy, face.gz) * slope;
  face.gx *= slope;
  face.gy *= slope;
  face.gz *= slope;
  const Floats q = larger(1.0f - squared, Floats{});
  face.per_slope = slope;
  face.weight = g[13] * q * q * q * larger(1.0f - 0.25f * face.f * face.f, Floats{});
  return true;
}

inline Floats steep_for(const Sample& s) {
  return -kSteep * root(square_of(s.dx, s.dy, all(1.0f)));
}

// Sums over round fits of the sheet that is shown, as far as they are steep to the ray or turn
// away.
struct Turning {
  Floats w{}, f{}, along{}, bend{};

  void add(const float* g, const Sample& s, const FaceValue& face, const Floats& slope,
           const Floats& weight) {
    w += weight;
    f = fused(weight, face.f, f);
    along = fused(weight, slope, along);
    bend = fused(weight, bend_along(g, s) * face.per_slope, bend);
  }
  // How high above their mean, and that of what the ray meets, the ray passes.
  Floats height_over(const Floats& met, const Floats& entering) const {
    const Floats per = 1.0f / larger(w + met, all(kTiny));
    const Floats mean = f * per, slope = (along + entering) * per;
    return mean - 0.25f * slope * slope / larger(bend * per, all(kLeastBend));
  }
};

inline Floats held_by(const Blend& in, const Sample& s, const List& rim, const Middle& near,
                      const Middle& deep, const Floats& weights, const Ints& wanted) {
  const Floats none{}, steep = steep_for(s);
  const Floats x = s.sx + near.z * s.dx, y = s.sy + near.z * s.dy, z = -(s.t + near.z);
  const Box box = box_of(x, y, z, wanted);
  Floats within{}, beyond{};
  for (int k = 0; k < rim.count; k += kWidth)
    for (unsigned found = reach_box(rim, k, box); found; found &= found - 1) {
      const std::ptrdiff_t fit = rim.fit[k + __builtin_ctz(found)];
      const float* const foot = in.feet + 4 * fit;
      FaceValue face;
      if (!face_at(in.records + kRecord * fit, foot, x, y, z, face)) continue;
      const auto along = [&](const Floats& vx, const Floats& vy, const Floats& vz) {
        return dot_of(face.gx, face.gy, face.gz, vx, vy, vz);
      };
      const Floats cosine =
          larger(along(near.nx, near.ny, near.nz), along(deep.nx, deep.ny, deep.nz));
      const Floats nx = foot[0] - near.cx, ny = foot[1] - near.cy, nz = foot[2] - near.cz;
      const Floats dx = foot[0] - deep.cx, dy = foot[1] - deep.cy, dz = foot[2] - deep.cz;
      const Ints convex =
          (dot_of(nx, ny, nz, near.nx, near.ny, near.nz) < 0.0f) & (along(nx, ny, nz) > 0.0f);
      const Ints concave =
          (dot_of(dx, dy, dz, deep.nx, deep.ny, deep.nz) > 0.0f) & (along(dx, dy, dz) < 0.0f);
      const Floats forward = fused(face.gx, s.dx, fused(face.gy, s.dy, -face.gz));
      const Floats weight = face.weight * (1.0f - smooth_step(in.same_low, in.same_high, cosine));
      const Floats holds = convex & concave & (forward > steep) ? weight : none;
      within += face.f > 0.0f ? none : holds;
      beyond += face.f > 0.0f ? holds : none;
    }
  const Floats share = smooth_step(0.0003f, 0.002f, within / larger(weights, all(kTiny)));
  return wanted & (within > beyond) ? share : none;
}

// Sums over the steep and hidden faces at the point that is shown.
struct Hidden {
  // Of hidden faces, sheet R: weights, values, feet and gradients; how much those weigh that the
  // point lies outside of; both times their own weight in the blend.
  Floats w{}, f{}, cx{}, cy{}, cz{}, nx{}, ny{}, nz{}, outside{}, strong{}, strong_outside{};
  Floats within{}, beyond{};  // what faces weigh that the point lies in, and outside of
  Turning turning;
};

[[gnu::always_inline]] inline void add_face(const Blend& in, const Sample& s, int fit,
                                            const FaceValue& face, const Axis& middle,
                                            const Floats& steep, const Blended& shown,
                                            Hidden& sum) {
  const float* const g = in.records + std::ptrdiff_t{fit} * kRecord;
  const float* const foot = in.feet + std::ptrdiff_t{fit} * 4;
  const auto same = [&](const Floats& x) { return smooth_step(in.same_low, in.same_high, x); };
  const Floats none{};
  const auto& [f, gx, gy, gz, counts, per_slope] = face;
  const Floats cosine = dot_of(gx, gy, gz, shown.nx, shown.ny, shown.nz);
  const Floats weight = counts * (1.0f - same(cosine));
  const Floats along = fused(gx, s.dx, fused(gy, s.dy, -gz));
  if (g[15] > 0.5f * kRoundest) {
    const Floats belongs =
        same(g[15] + cosine) * smooth_step(0.5f * kRoundest, kRoundest, all(g[15]));
    sum.turning.add(g, s, face, along, along > steep ? counts * belongs : none);
  }
  const Floats tx = foot[0] - middle.x, ty = foot[1] - middle.y, tz = foot[2] - middle.z;
  const Ints convex = (dot_of(tx, ty, tz, shown.nx, shown.ny, shown.nz) < 0.0f) &
                      (dot_of(tx, ty, tz, gx, gy, gz) > 0.0f);
  const Floats holds = convex & (along > steep) ? weight : none;
  sum.within += f > 0.0f ? none : holds;
  sum.beyond += f > 0.0f ? holds : none;
  const Floats w = along > 0.0f ? weight : none;
  const Floats outside = f < 0.0f ? none : w;
  sum.w += w;
  sum.outside += outside;
  sum.strong = fused(w, all(g[13]), sum.strong);
  sum.strong_outside = fused(outside, all(g[13]), sum.strong_outside);
  sum.f = fused(w, larger(f, all(kWithin)) - kRoundLeeway * g[15], sum.f);
  sum.cx = fused(w, all(foot[0]), sum.cx);
  sum.cy = fused(w, all(foot[1]), sum.cy);
  sum.cz = fused(w, all(foot[2]), sum.cz);
  sum.nx = fused(w, gx, sum.nx);
  sum.ny = fused(w, gy, sum.ny);
  sum.nz = fused(w, gz, sum.nz);
}

[[gnu::always_inline]] inline Hidden hidden_at(const Blend& in, const Sample& s, const List& rim,
                                               const Axis& middle, const Blended& shown) {
  const Floats end = shown.depth - s.t, x = s.sx + end * s.dx, y = s.sy + end * s.dy,
               z = -shown.depth;
  const Floats steep = steep_for(s);
  const Box box = box_of(x, y, z, shown.depth < kNowhere);
  Hidden sum;
  for (int k = 0; k < rim.count; k += kWidth)
    for (unsigned near = reach_box(rim, k, box); near; near &= near - 1) {
      const int fit = rim.fit[k + __builtin_ctz(near)];
      FaceValue face;
      if (face_at(in.records + std::ptrdiff_t{fit} * kRecord, in.feet + std::ptrdiff_t{fit} * 4, x,
                  y, z, face))
        add_face(in, s, fit, face, middle, steep, shown, sum);
    }
  return sum;
}

// Whether hidden faces end the surface: it lies outside of them, and meets them in a convex edge.
inline Ints ended_by(const Hidden& r, const Axis& middle, const Blended& shown) {
  const Floats per = 1.0f / larger(r.w, all(kTiny));
  const Floats x = r.cx * per - middle.x, y = r.cy * per - middle.y, z = r.cz * per - middle.z;
  const Ints credible = r.strong_outside * r.w > kCredible * (r.strong * r.outside);
  return (r.w > 1e-3f) & (r.f > 0.0f) & credible &
         (x * shown.nx + y * shown.ny + z * shown.nz < 0.0f) &
         (x * r.nx + y * r.ny + z * r.nz > 0.0f);
}

}  // namespace
}  // namespace meniscus::bench::native
