// trust.cl: what it is told from how far fits can be trusted (docs/method.md, trust).
//
// uses: particle_fit.cl

// Puts the places at which the density is asked for where fits are in a sheet: the foot of each, on its
// surface next to its particle, and how far behind it `deep` says. Without a fit a particle is its own
// foot.
//
// The fits go into the sheet, too: normals; how much they count, which is their firmness, 0 without a
// fit; and behind two values, which the densities become, how far the surroundings lie, twice.
kernel void place_feet(global const float4* place,      // [n + 1] of the particles
                       global const int* particle,      // [lanes] a lane's place there
                       MADE(quadric, residual, rows),
                       IN_SHEET(to, toward, share, value),
                       global float* point,             // [3][2 fits] out: feet, then what is behind
                       const Feet feet) {
  const int lanes = feet.lanes, fits = feet.fits, lane = get_global_id(0) * WIDTH;
  if (lane >= lanes) return;
  floatv at[4];
  load_records(place, particle + lane, at);
  const floatv none = (floatv)(0.0f);
  const floatv nx = LOADF(rows + 4 * lanes + lane), ny = LOADF(rows + 5 * lanes + lane),
               nz = LOADF(rows + 6 * lanes + lane), spread = LOADF(rows + 2 * lanes + lane);
  const intv fitted = LOADF(residual + lane) >= 0.0f, used = LOADI(to + lane) >= 0;
  const floatv behind = clamp(-LOADF(quadric + lane), -1.0f, 1.0f);
  const floatv foot = SELECT(none, feet.offset + behind, fitted), deep = foot - feet.deep;
  int to_fit[WIDTH];
  STOREI(LOADI(to + lane), to_fit);
  const Particles own = {at[0], at[1], at[2], none, nx, ny, nz};
  put_in_sheet(own, SELECT(none, LOADF(rows + lanes + lane), fitted), to_fit, used, fits, toward, share);
  scatter_float(spread, value + 2 * fits, to_fit, used);
  scatter_float(spread, value + 3 * fits, to_fit, used);
  scatter_float(fma(foot, nx, at[0]), point, to_fit, used);
  scatter_float(fma(foot, ny, at[1]), point + 2 * fits, to_fit, used);
  scatter_float(fma(foot, nz, at[2]), point + 4 * fits, to_fit, used);
  scatter_float(fma(deep, nx, at[0]), point + fits, to_fit, used);
  scatter_float(fma(deep, ny, at[1]), point + 3 * fits, to_fit, used);
  scatter_float(fma(deep, nz, at[2]), point + 5 * fits, to_fit, used);
}
