#include "kernels/native/lanes.hpp"
#include "kernels/native/native.hpp"

namespace meniscus::bench::native {

void project_particles(const Projection& p, std::size_t begin, std::size_t end) {
  const float* const x = p.x;
  const float* const y = p.y;
  const float* const z = p.z;
  const float* const scale = p.scale;
  float* const ex = p.eye;
  float* const ey = p.eye + p.stride;
  float* const ez = p.eye + 2 * p.stride;
  float* const u = p.screen;
  float* const v = p.screen + p.stride;
  float* const ku = p.screen + 2 * p.stride;
  float* const kv = p.screen + 3 * p.stride;
  const float* const m = p.from_world;
  const float m0 = m[0], m1 = m[1], m2 = m[2], m3 = m[3], m4 = m[4], m5 = m[5], m6 = m[6],
              m7 = m[7], m8 = m[8], m9 = m[9], ma = m[10], mb = m[11], mc = m[12], md = m[13],
              me = m[14];
  const float u0 = p.u_row[0], u1 = p.u_row[1], u2 = p.u_row[2], u3 = p.u_row[3];
  const float v0 = p.v_row[0], v1 = p.v_row[1], v2 = p.v_row[2], v3 = p.v_row[3];
  const float w0 = p.w_row[0], w1 = p.w_row[1], w2 = p.w_row[2], w3 = p.w_row[3];
  const float extent_u = p.extent[0], extent_v = p.extent[1], near_depth = p.extent[2],
              margin = p.extent[3], width = p.size[0], height = p.size[1];
  for (std::size_t i = begin; i < end; i += 8) {
    const Floats px = load(x + i) - mc, py = load(y + i) - md, pz = load(z + i) - me;
    const Floats a = m0 * px + m1 * py + m2 * pz + m9;
    const Floats b = m3 * px + m4 * py + m5 * pz + ma;
    const Floats c = m6 * px + m7 * py + m8 * pz + mb;
    const Floats w = w0 * a + w1 * b + w2 * c + w3;
    const Floats pu = (u0 * a + u1 * b + u2 * c + u3) / w;
    const Floats pv = (v0 * a + v1 * b + v2 * c + v3) / w;
    const Floats su = extent_u * load(scale + i) / w, sv = extent_v * load(scale + i) / w;
    const Floats mu = margin * su, mv = margin * sv;
    const Ints kept = (-c > near_depth) & (pu + mu >= 0.0f) & (pu - mu <= width) &
                      (pv + mv >= 0.0f) & (pv - mv <= height);
    store(a, ex + i);
    store(b, ey + i);
    store(c, ez + i);
    store(pu, u + i);
    store(pv, v + i);
    store(kept ? su : Floats{}, ku + i);
    store(kept ? sv : Floats{}, kv + i);
  }
}

}  // namespace meniscus::bench::native
