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
                              const int stride, const Projection to) {
  const int i = get_global_id(0) * WIDTH;
  if (i >= stride) return;
  const floatv px = LOADF(x + i) - to.origin[0];
  const floatv py = LOADF(y + i) - to.origin[1];
  const floatv pz = LOADF(z + i) - to.origin[2];
  const floatv ex = to.rotation[0] * px + to.rotation[1] * py + to.rotation[2] * pz + to.shift[0];
  const floatv ey = to.rotation[3] * px + to.rotation[4] * py + to.rotation[5] * pz + to.shift[1];
  const floatv ez = to.rotation[6] * px + to.rotation[7] * py + to.rotation[8] * pz + to.shift[2];
  const floatv w = to.w_row[0] * ex + to.w_row[1] * ey + to.w_row[2] * ez + to.w_row[3];
  const floatv u = (to.u_row[0] * ex + to.u_row[1] * ey + to.u_row[2] * ez + to.u_row[3]) / w;
  const floatv v = (to.v_row[0] * ex + to.v_row[1] * ey + to.v_row[2] * ez + to.v_row[3]) / w;
  const floatv ku = to.u_scale * LOADF(scale + i) / w;
  const floatv kv = to.v_scale * LOADF(scale + i) / w;
  const floatv mu = to.margin * ku, mv = to.margin * kv, none = (floatv)(0.0f);
  const intv kept = (-ez > to.near_depth) & (u + mu >= 0.0f) & (u - mu <= to.width) & (v + mv >= 0.0f) &
                    (v - mv <= to.height);
  STOREF(ex, eye + i);
  STOREF(ey, eye + stride + i);
  STOREF(ez, eye + 2 * stride + i);
  STOREF(u, screen + i);
  STOREF(v, screen + stride + i);
  STOREF(SELECT(none, ku, kept), screen + 2 * stride + i);
  STOREF(SELECT(none, kv, kept), screen + 3 * stride + i);
}
