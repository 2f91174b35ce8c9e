// edges.cl: how far fits can be relied on (docs/method.md, edge and trust; the paper relies on each group
// alike): whether a fit's surroundings are one sheet, and how far they lie off it.
//
// uses: neighbours.cl

// What the neighbours of a fit come to: weights of the particles elsewhere, of those that agree, and of those
// that agree within a narrow angle; weights and squares of the distances of all, and how many they are, each
// by its u; squares and weights of the distances that the residual is made of.
typedef struct {
  floatv near, agree, firm, weight, squares, number, distances, total;
} Surroundings;

INLINED void sum_surroundings(Surroundings* found, const Particles* own, const floatv* c,
                              const floatv roundness, const floatv inverse_rho,
                              const floatv inverse_tau, global const float4* place,
                              global const float4* normal, global const int* neighbour,
                              global const float* kept, const int count, const FitPass by) {
  const floatv none = (floatv)(0.0f);
  const floatv falloff = falloff_of(roundness, by.model);
  const int round = ANY(roundness > 0.0f);
  Surroundings s = {none, none, none, none, none, none, none, (floatv)(1e-30f)};
  Point point[CHUNK];
  for (int from = 0; from < count; from += CHUNK) {
    const int points = min(CHUNK, count - from);
    gather_points(place, normal, neighbour + FIT_BATCH * from, points, point);
    for (int k = 0; k < points; ++k) {
      const Point p = point[k];
      const floatv x = p.x - own->x, y = p.y - own->y, z = p.z - own->z;
      const floatv squared = x * x + y * y + z * z, l = sqrt(squared);
      const floatv same = own->nx * p.dx + own->ny * p.dy + own->nz * p.dz;
      const floatv f = evaluate(c, x, y, z), apart = clamp(f, -2.0f, 2.0f);
      add_distance(f, LOADF(kept + FIT_BATCH * (from + k)), inverse_tau, &s.distances, &s.total);
      const floatv w = p.w * parabola(squared * (inverse_rho * inverse_rho)) *
                       exp_negative(falloff * smaller(same - 1.0f, none));
      s.weight += w;
      s.squares += w * apart * apart;
      s.number += p.w;
      const floatv q = share_of(p.w, l, by.reach);
      floatv agreeing = same;
      if (round) {
        const floatv along = along_slope(c, x, y, z, p.dx, p.dy, p.dz);
        agreeing = fma(roundness, along - same, same);
      }
      s.near += q;
      s.agree += q * smooth_step(0.72f, 0.95f, agreeing);
      s.firm += q * smooth_step(0.85f, 0.95f, agreeing);
    }
  }
  *found = s;
}

// How far a fit's surroundings are one sheet, `edge`, and its firmness, from what they come to, their spread
// and its residual. A bevel along an edge agrees with its row alone, and the others lie farther off than its
// own rest. A fit on which all lie that look its way is a face, also beside a corner, where most are bevels.
// One that its own particles lie off lies across an edge, and may agree with others that do.
INLINED void judge_edge(const Surroundings* found, const floatv u, const floatv roundness,
                        const floatv spread, const floatv residual, const floatv inverse_tau,
                        floatv* edge, floatv* firmness) {
  const floatv one = (floatv)(1.0f), all = u + found->near;
  const floatv agreed =
      SELECT(one, fmax((floatv)(0.005f), smooth_step(0.7f, 1.0f, (u + found->firm) / all)), all > 0.0f);
  const floatv edged = one - roundness;
  const floatv bevel = (one - firmness_of(u, found->near, found->firm, 0.8f)) * edged *
                       smooth_step(0.4f, 0.55f, spread - 2.0f * residual);
  const floatv across = edged * smooth_step(0.38f, 0.55f, residual * inverse_tau);
  const floatv face = 0.2f * edged * (one - smooth_step(0.1f, 0.3f, spread)) * (one - across);
  const floatv least = larger(face, (floatv)(0.0005f)), rest = one - bevel;
  *edge = larger(edge_of(u, found->near, found->agree) * rest * (one - 0.9f * across), least);
  *firmness = larger(agreed * rest, least);
}

// Puts places `foot` before a particle and `deep` before it, along its normal, into [3][2 fits].
inline void put_places(const Particles own, const floatv foot, const floatv deep, const int* at,
                       const intv used, const int fits, global float* field_place) {
  scatter_float(fma(foot, own.nx, own.x), field_place, at, used);
  scatter_float(fma(foot, own.ny, own.y), field_place + 2 * fits, at, used);
  scatter_float(fma(foot, own.nz, own.z), field_place + 4 * fits, at, used);
  scatter_float(fma(deep, own.nx, own.x), field_place + fits, at, used);
  scatter_float(fma(deep, own.ny, own.y), field_place + 3 * fits, at, used);
  scatter_float(fma(deep, own.nz, own.z), field_place + 5 * fits, at, used);
}

// How far a fit can be relied on, and the normal of its particle, in the rows of records.h:
// - e, how far its surroundings are one sheet: with q = u_j W(l / reach), W Wendland's function, the
//   share of the particles elsewhere whose normals agree,
//     e = max(0.005, smoothstep(0.3, 0.9, (c + sum of q smoothstep(0.72, 0.95, a_ij)) /
//                                         (c + sum of q))),    c = 0.01 u_i
//   where a_ij goes from n_i.n_j at roundness 0, between two sheets, to g_i(x_j).n_j at roundness 1,
//   g_i the fit's unit gradient: round surroundings agree with the quadric, not with one normal; a fit
//   off which its own particles lie keeps 1 - 0.9 (1 - roundness) smoothstep(0.38, 0.55, residual / tau);
// - its firmness, which its trust follows from: agreement within a narrower angle, with the particle
//   itself:
//     max(0.005, smoothstep(0.7, 1.0, (u_i + sum of q smoothstep(0.85, 0.95, a_ij)) /
//                                     (u_i + sum of q)));
// - the RMS distance (at most 2) of all neighbours from the fit, with the weights of its first pass
//   but for the height;
// - the number of its neighbours, each by its weight u;
// - x, y and z of the normal as the passes left it;
// - the support;
// - the roundness.
// Of the first two bevels keep less, and faces and all others keep something: judge_edge. They are scaled by
// the weight of the group where the fits are those of groups.
// Fits get their residual, the RMS distance with the weights of the last pass.
//
// What their trust follows from goes into a sheet (trust.hpp): normals; how much each fit counts, which is
// its firmness, 0 without a fit; and behind two values, which become densities, the RMS distance. The
// densities are measured at the foot of each, on its surface next to its particle, and `deep` behind it.
// Without a fit a particle is its own foot.
kernel void measure_edges(global const float4* place, global const float4* normal,
                          AROUND(particle, influence, neighbour, first, length),
                          MEASURED(support, quadric, kept, residual, rows),  // see above
                          IN_SHEET(to, toward, sheet_share, value),
                          global float* field_place,  // [3][2 fits] out: feet, then what is behind
                          const FitPass by, const Feet feet) {
  const int lanes = by.lanes, fits = by.fits;
  const int lane = get_global_id(0) * WIDTH;
  if (lane >= lanes) return;
  const floatv none = (floatv)(0.0f), one = (floatv)(1.0f);
  const Particles own = load_particles(place, normal, particle + lane);
  const int begin = first[lane / FIT_BATCH] + lane % FIT_BATCH, count = length[lane / FIT_BATCH];
  const floatv roundness = LOADF(support + lanes + lane);
  const floatv inverse_tau = 1.0f / tau_of(roundness, by.model);
  floatv c[10];
#pragma unroll
  for (int k = 0; k < 10; ++k) c[k] = LOADF(quadric + k * lanes + lane);
  Surroundings found;
  sum_surroundings(&found, &own, c, roundness, 1.0f / LOADF(support + lane), inverse_tau, place, normal,
                   neighbour + begin, kept + begin, count, by);
  const floatv off = sqrt(found.distances / found.total);
  const floatv spread =
      SELECT((floatv)(2.0f), sqrt(found.squares / found.weight), found.weight > 0.0f);
  floatv edge, firmness;
  judge_edge(&found, own.u, roundness, spread, off, inverse_tau, &edge, &firmness);
  const floatv counts = by.groups ? LOADF(influence + lane) : one;
  firmness *= counts;
  STOREF(counts * edge, rows + EDGE_ROW * lanes + lane);
  STOREF(firmness, rows + FIRMNESS_ROW * lanes + lane);
  STOREF(spread, rows + SPREAD_ROW * lanes + lane);
  STOREF(found.number, rows + SUPPORTERS_ROW * lanes + lane);
  STOREF(own.nx, rows + NORMAL_ROW * lanes + lane);
  STOREF(own.ny, rows + (NORMAL_ROW + 1) * lanes + lane);
  STOREF(own.nz, rows + (NORMAL_ROW + 2) * lanes + lane);
  STOREF(LOADF(support + lane), rows + SUPPORT_ROW * lanes + lane);
  STOREF(roundness, rows + ROUNDNESS_ROW * lanes + lane);
  const floatv before = LOADF(residual + lane);
  const intv fitted = before >= 0.0f, used = LOADI(to + lane) >= 0;
  STOREF(SELECT(before, off, fitted), residual + lane);

  const floatv behind = clamp(-c[0], -1.0f, 1.0f);
  const floatv foot = SELECT(none, feet.offset + behind, fitted), deep = foot - feet.deep;
  int at[WIDTH];
  STOREI(LOADI(to + lane), at);
  put_in_sheet(own, SELECT(none, firmness, fitted), at, used, fits, toward, sheet_share);
  scatter_float(spread, value + 2 * fits, at, used);
  put_places(own, foot, deep, at, used, fits, field_place);
}
