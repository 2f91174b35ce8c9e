// project.cl: world -> eye space and screen (paper 2.1, step 1).
// One work-item per particle; the range is `stride` exactly and every array is padded to it, so
// that there is no test and the compiler can use vectors.
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
  const int i = get_global_id(0);
  const float px = x[i] - from_world.sc;
  const float py = y[i] - from_world.sd;
  const float pz = z[i] - from_world.se;
  const float ex = from_world.s0 * px + from_world.s1 * py + from_world.s2 * pz + from_world.s9;
  const float ey = from_world.s3 * px + from_world.s4 * py + from_world.s5 * pz + from_world.sa;
  const float ez = from_world.s6 * px + from_world.s7 * py + from_world.s8 * pz + from_world.sb;
  const float w = w_row.x * ex + w_row.y * ey + w_row.z * ez + w_row.w;
  const float u = (u_row.x * ex + u_row.y * ey + u_row.z * ez + u_row.w) / w;
  const float v = (v_row.x * ex + v_row.y * ey + v_row.z * ez + v_row.w) / w;
  const float ku = extent.x * scale[i] / w;
  const float kv = extent.y * scale[i] / w;
  const float mu = extent.w * ku, mv = extent.w * kv;
  const int kept = (-ez > extent.z) & (u + mu >= 0.0f) & (u - mu <= size.x) & (v + mv >= 0.0f) &
                   (v - mv <= size.y);
  eye[i] = ex;
  eye[stride + i] = ey;
  eye[2 * stride + i] = ez;
  screen[i] = u;
  screen[stride + i] = v;
  screen[2 * stride + i] = kept ? ku : 0.0f;
  screen[3 * stride + i] = kept ? kv : 0.0f;
}
