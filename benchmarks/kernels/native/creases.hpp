// The sheets of what a ray meets, as creases.cl has them. Everything has internal linkage.
#pragma once

#include "kernels/native/hits.hpp"

namespace meniscus::bench::native {
namespace {

// What a sample shows.
struct Blended {
  Floats depth = all(kNowhere), nx{}, ny{}, nz{}, trust{};
  Ints group = Ints{} - 1;
};

// A sheet's gradient.
struct Axis {
  Floats x{}, y{}, z{};

  // How far a hit's gradient agrees with it; round fits agree by so much more.
  Floats alike(const Hit& hit, const float* g) const {
    return g[15] + dot_of(hit.gx, hit.gy, hit.gz, x, y, z);
  }
  void add(const Hit& hit, const Floats& weight) {
    x = fused(weight, hit.gx, x);
    y = fused(weight, hit.gy, y);
    z = fused(weight, hit.gz, z);
  }
  void take(const Hit& hit, const Ints& better) {
    x = better ? hit.gx : x;
    y = better ? hit.gy : y;
    z = better ? hit.gz : z;
  }
  // Takes the direction of a sum of gradients.
  void turn_to(const Axis& sum) {
    const Floats size = square_of(sum.x, sum.y, sum.z), scale = inverse_root(size, kTiny);
    x = size > kTiny ? sum.x * scale : x;
    y = size > kTiny ? sum.y * scale : y;
    z = size > kTiny ? sum.z * scale : z;
  }
};

struct Sheet {
  Floats w{}, t{}, cx{}, cy{}, cz{}, nx{}, ny{}, nz{}, vx{}, vy{}, vz{}, ux{}, uy{}, uz{};
};

[[gnu::always_inline]] inline void add_hit(Sheet& sum, const float* foot, const Sample& s,
                                           const Hit& hit, const Floats& share) {
  const Floats w = share * hit.weight;
  sum.w += w;
  sum.t = fused(w, hit.tau, sum.t);
  sum.cx = fused(w, all(foot[0]), sum.cx);
  sum.cy = fused(w, all(foot[1]), sum.cy);
  sum.cz = fused(w, all(foot[2]), sum.cz);
  sum.nx = fused(w, hit.gx, sum.nx);
  sum.ny = fused(w, hit.gy, sum.ny);
  sum.nz = fused(w, hit.gz, sum.nz);
  const Floats v = share * hit.pull, u = v * hit.tau;
  const Floats px = fused(hit.tau, s.dx, s.sx - foot[0]), py = fused(hit.tau, s.dy, s.sy - foot[1]),
               pz = -s.t - foot[2] - hit.tau;
  sum.vx = fused(v, px, sum.vx);
  sum.vy = fused(v, py, sum.vy);
  sum.vz = fused(v, pz, sum.vz);
  sum.ux = fused(u, px, sum.ux);
  sum.uy = fused(u, py, sum.uy);
  sum.uz = fused(u, pz, sum.uz);
}

// A sheet's depth behind the reference, the middle of its feet, and the direction of its gradients.
struct Middle {
  Floats z, cx, cy, cz, nx, ny, nz;
};

inline Middle middle_of(const Sheet& s) {
  const Floats v = 1.0f / larger(s.w, all(kTiny)),
               size = inverse_root(square_of(s.nx, s.ny, s.nz), kTiny);
  return {s.t * v, s.cx * v, s.cy * v, s.cz * v, s.nx * size, s.ny * size, s.nz * size};
}

inline Ints convex_between(const Middle& a, const Middle& b) {
  return dot_of(b.cx - a.cx, b.cy - a.cy, b.cz - a.cz, a.nx - b.nx, a.ny - b.ny, a.nz - b.nz) <
         0.0f;
}

inline Floats takes_over(const Floats& a, const Floats& b, const Ints& convex, const Floats& share,
                         float crease) {
  const Floats meeting = convex ? larger(a, b) : smaller(a, b);
  return (meeting == b) & (magnitude(a - b) <= crease) ? share : Floats{};
}

// How much of what a ray meets is of sheets B and C.
struct Shares {
  Floats b, c;
};

inline Shares shares_in_corner(const Middle& a, const Middle& b, const Middle& c,
                               const Floats& some_b, const Floats& some_c, const Ints& only_b,
                               float crease) {
  const Floats one = all(1.0f);
  const Ints ab = convex_between(a, b), ac = convex_between(a, c), bc = convex_between(b, c);
  const auto b_on = [&](const Floats& depth, const Floats& other) {
    return only_b ? one : takes_over(depth, other, ab, some_b, crease);
  };
  const Floats b1 = b_on(a.z, b.z);
  const Floats c1 = takes_over(a.z + (b.z - a.z) * b1, c.z, ac, some_c, crease);
  const Floats c2 = takes_over(a.z, c.z, ac, some_c, crease);
  const Floats b2 = b_on(a.z + (c.z - a.z) * c2, b.z);
  const Floats c3 = takes_over(b.z, c.z, bc, some_c, crease);
  const Floats b3 = b_on(a.z, b.z + (c.z - b.z) * c3);
  const Ints odd_ac = (ab == bc) & (ab != ac), odd_bc = (ab == ac) & (ab != bc);
  return {odd_bc   ? b3 * (one - c3)
          : odd_ac ? b2
                   : b1 * (one - c1),
          odd_bc   ? b3 * c3
          : odd_ac ? c2 * (one - b2)
                   : c1};
}

inline void add_normal(const Sheet& s, const Floats& z, const Floats& share, Blended& out) {
  const Floats gx = s.nx + (z * s.vx - s.ux), gy = s.ny + (z * s.vy - s.uy),
               gz = s.nz + (z * s.vz - s.uz);
  const Floats scale = share / root(larger(square_of(gx, gy, gz), all(kTiny)));
  out.nx = fused(gx, scale, out.nx);
  out.ny = fused(gy, scale, out.ny);
  out.nz = fused(gz, scale, out.nz);
}

inline Middle either_sheet(const Middle& a, const Middle& b, const Ints& first) {
  return {first ? a.z : b.z,   first ? a.cx : b.cx, first ? a.cy : b.cy, first ? a.cz : b.cz,
          first ? a.nx : b.nx, first ? a.ny : b.ny, first ? a.nz : b.nz};
}

}  // namespace
}  // namespace meniscus::bench::native
