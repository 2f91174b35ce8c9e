// project.cl: world -> eye space and screen (paper 2.1, step 1).
// One work-item per WIDTH particles; every array is padded to `stride`, a multiple of it.
// A particle is kept when it lies beyond the near plane and a disc of `margin` particle radii
// around it meets the screen; one that is not kept has no extent (pixels_x = 0).
kernel void project_particles(global const float* x,      // [stride] world units
                              global const float* y,
                              global const float* z,
                              global const float* scale,  // [stride] own radius / common radius
                              global float* eye,          // [3][stride] x, y, z, particle radii
                              global float* screen,       // [4][stride] u, v, pixels per particle
                                                          // radius along u and along v
                              const int stride,
                              const float16 from_world,  // rotation / radius (9), shift, origin
                              const float4 u_row,        // u = u_row.(e, 1) / w_row.(e, 1)
                              const float4 v_row, const float4 w_row,
                              const float4 extent,  // pixels*w per radius along u, along v;
                                                    // near depth; margin, particle radii
                              const float2 size) {  // image, pixels
  const int i = get_global_id(0) * WIDTH;
  if (i >= stride) return;
  const floatv px = LOADF(x + i) - from_world.sc;
  const floatv py = LOADF(y + i) - from_world.sd;
  const floatv pz = LOADF(z + i) - from_world.se;
  const floatv ex = from_world.s0 * px + from_world.s1 * py + from_world.s2 * pz + from_world.s9;
  const floatv ey = from_world.s3 * px + from_world.s4 * py + from_world.s5 * pz + from_world.sa;
  const floatv ez = from_world.s6 * px + from_world.s7 * py + from_world.s8 * pz + from_world.sb;
  const floatv w = w_row.x * ex + w_row.y * ey + w_row.z * ez + w_row.w;
  const floatv u = (u_row.x * ex + u_row.y * ey + u_row.z * ez + u_row.w) / w;
  const floatv v = (v_row.x * ex + v_row.y * ey + v_row.z * ez + v_row.w) / w;
  const floatv ku = extent.x * LOADF(scale + i) / w;
  const floatv kv = extent.y * LOADF(scale + i) / w;
  const floatv mu = extent.w * ku, mv = extent.w * kv, none = (floatv)(0.0f);
  const intv kept = (-ez > extent.z) & (u + mu >= 0.0f) & (u - mu <= size.x) & (v + mv >= 0.0f) &
                    (v - mv <= size.y);
  STOREF(ex, eye + i);
  STOREF(ey, eye + stride + i);
  STOREF(ez, eye + 2 * stride + i);
  STOREF(u, screen + i);
  STOREF(v, screen + stride + i);
  STOREF(SELECT(none, ku, kept), screen + 2 * stride + i);
  STOREF(SELECT(none, kv, kept), screen + 3 * stride + i);
}
