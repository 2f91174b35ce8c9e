// particle_fit.cl: the weights and normals of fits around every visible particle, between the
// passes of fit.cl (paper 2.3, with a support of fixed radius instead of a merged group, so that
// nothing changes abruptly from frame to frame; docs/method.md).
//
// A fit is a lane of fit.cl's batches: slot k of lane l of batch b lies at first[b] + 8 k + l. The
// slots name the neighbours, the particle itself among them; -1 is an unused slot. One work-item
// per lane.

// The quadratic B-spline on [0, 1).
inline float spline(const float x) {
  const float y = 1.5f * x;
  return y < 0.5f ? 0.75f - y * y : 0.5f * (1.5f - y) * (1.5f - y);
}

// Weight of neighbour j in the fit around particle i at distance l with normals n_i, n_j:
//   u_j B(l / rho) exp(-2 (1 - n_i.n_j) / sigma^2) m,
// in the first pass, and where the last one gave no fit, m = exp(-h^2 / (h_0 + h_1 l^2)^2) with the
// height h of j over i's tangent plane; later m = exp(-r^2 / tau^2) for a neighbour that lies r
// behind the surface of the pass before. Fits of fewer than three neighbours get no weights.
kernel void weigh_neighbours(
    global const float* particles,  // [4][n] x, y, z (particle radii), u
    global const float* normal,     // [3][n] unit
    global const int* particle,     // [lanes] centre of the lane's fit, -1: unused
    global const int* neighbour,    // [slots]
    global const int* first,        // [batches]
    global const int* length,       // [batches]
    global const float* support,    // [lanes] rho, particle radii
    global const float* quadric,    // [10][lanes] of the pass before, through the particles
    global const float* quality,    // [2][lanes] negative: no fit
    global float* points,           // [7][slots] q = (x_j - x_i) / rho; n_j; weight
    const int n, const int slots, const int lanes, const int pass,
    const float4 options) {  // 2 / sigma^2; tau and h_0, particle radii; h_1, 1 / particle radii
  const int lane = get_global_id(0);
  if (lane >= lanes) return;
  const int i = particle[lane];
  if (i < 0) return;
  const float px = particles[i], py = particles[n + i], pz = particles[2 * n + i];
  const float nx = normal[i], ny = normal[n + i], nz = normal[2 * n + i];
  const int refit = pass > 0 && quality[lane] >= 0.0f;
  float c[10];
#pragma unroll
  for (int k = 0; k < 10; ++k) c[k] = refit ? quadric[k * lanes + lane] : 0.0f;
  const float inverse_rho = 1.0f / support[lane], inverse_tau = 1.0f / options.y;
  const int begin = first[lane / 8] + lane % 8, count = length[lane / 8];
  int used = 0;
  for (int k = 0; k < count; ++k) {
    const int slot = begin + 8 * k;
    const int j = neighbour[slot];
    if (j < 0) break;
    const float x = particles[j] - px, y = particles[n + j] - py, z = particles[2 * n + j] - pz;
    const float mx = normal[j], my = normal[n + j], mz = normal[2 * n + j];
    const float squared = x * x + y * y + z * z;
    const float h = x * nx + y * ny + z * nz;
    const float width = options.z + options.w * squared;
    const float flat = fmax(exp_negative(-(h * h) / (width * width)), 1e-5f);
    const float f = c[0] + (c[1] + c[4] * x + c[7] * y) * x + (c[2] + c[5] * y + c[8] * z) * y +
                    (c[3] + c[6] * z + c[9] * x) * z;
    const float behind = fmax(-f, 0.0f) * inverse_tau;
    const float robust = fmax(exp_negative(-behind * behind), 1e-4f);
    const float turned = fmin(nx * mx + ny * my + nz * mz - 1.0f, 0.0f);
    const float near = particles[3 * n + j] * spline(fmin(sqrt(squared) * inverse_rho, 1.0f)) *
                       exp_negative(options.x * turned);
    used += near >= 1e-6f;
    points[slot] = x * inverse_rho;
    points[slots + slot] = y * inverse_rho;
    points[2 * slots + slot] = z * inverse_rho;
    points[3 * slots + slot] = mx;
    points[4 * slots + slot] = my;
    points[5 * slots + slot] = mz;
    points[6 * slots + slot] = near >= 1e-6f ? near * (refit ? robust : flat) : 0.0f;
  }
  if (used >= 3) return;
  for (int k = 0; k < count; ++k) points[6 * slots + begin + 8 * k] = 0.0f;
}

// Turns each particle's normal to its quadric's gradient at the particle; the side stays.
kernel void turn_normals(global const int* particle, global const float* quadric,
                         global const float* quality, global float* normal,  // [3][n] in and out
                         const int n, const int lanes) {
  const int lane = get_global_id(0);
  if (lane >= lanes) return;
  const int i = particle[lane];
  if (i < 0 || quality[lane] < 0.0f) return;
  const float x = quadric[lanes + lane], y = quadric[2 * lanes + lane],
              z = quadric[3 * lanes + lane];
  const float side = normal[i] * x + normal[n + i] * y + normal[2 * n + i] * z;
  const float size = sqrt(x * x + y * y + z * z);
  if (!(size > 0.0f)) return;
  const float scale = (side < 0.0f ? -1.0f : 1.0f) / size;
  normal[i] = x * scale;
  normal[n + i] = y * scale;
  normal[2 * n + i] = z * scale;
}

// How far a fit can be relied on, three rows:
// - e, how far its surroundings are one sheet: with q = u_j W(l / reach), W Wendland's function, the
//   share of the neighbours whose normals agree,
//     e = max(0.005, smoothstep(0.7, 1.0, sum of q smoothstep(0.85, 0.95, n_i.n_j) / sum of q);
// - the RMS distance (at most 2) of all neighbours from the fit, with the weights of its first pass
//   but for the height;
// - the number of its neighbours, each by its weight u.
kernel void measure_edges(global const float* particles, global const float* normal,
                          global const int* particle, global const int* neighbour,
                          global const int* first, global const int* length,
                          global const float* support,  // [lanes] rho, particle radii
                          global const float* quadric,  // [10][lanes] through the particles
                          global float* rows,           // [3][lanes] e; distance, radii; number
                          const int n, const int lanes,
                          const float falloff,  // 2 / sigma^2
                          const float reach) {  // particle radii
  const int lane = get_global_id(0);
  if (lane >= lanes) return;
  const int i = particle[lane];
  if (i < 0) return;
  const int begin = first[lane / 8] + lane % 8, count = length[lane / 8];
  const float inverse_rho = 1.0f / support[lane];
  float c[10];
#pragma unroll
  for (int k = 0; k < 10; ++k) c[k] = quadric[k * lanes + lane];
  float near = 0.0f, agree = 0.0f, weight = 0.0f, squares = 0.0f, number = 0.0f;
  for (int k = 0; k < count; ++k) {
    const int j = neighbour[begin + 8 * k];
    if (j < 0) break;
    const float x = particles[j] - particles[i], y = particles[n + j] - particles[n + i],
                z = particles[2 * n + j] - particles[2 * n + i], u = particles[3 * n + j];
    const float l = sqrt(x * x + y * y + z * z);
    const float same = normal[i] * normal[j] + normal[n + i] * normal[n + j] +
                       normal[2 * n + i] * normal[2 * n + j];
    const float f = c[0] + (c[1] + c[4] * x + c[7] * y) * x + (c[2] + c[5] * y + c[8] * z) * y +
                    (c[3] + c[6] * z + c[9] * x) * z;
    const float apart = clamp(f, -2.0f, 2.0f);
    const float w =
        u * spline(fmin(l * inverse_rho, 1.0f)) * exp_negative(falloff * fmin(same - 1.0f, 0.0f));
    weight += w;
    squares += w * apart * apart;
    number += u;
    const float d = l / reach;
    if (d >= 1.0f) continue;
    const float r = (1.0f - d) * (1.0f - d);
    const float q = u * r * r * (4.0f * d + 1.0f);
    near += q;
    agree += q * smooth_step(0.85f, 0.95f, same);
  }
  rows[lane] = near > 0.0f ? fmax(0.005f, smooth_step(0.7f, 1.0f, agree / near)) : 1.0f;
  rows[lanes + lane] = weight > 0.0f ? sqrt(squares / weight) : 2.0f;
  rows[2 * lanes + lane] = number;
}
