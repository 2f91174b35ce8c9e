// specks.cl: closes pinholes and removes specks of the surface.
//
// A sample hangs together with those of its eight neighbours whose depths differ by at most `jump`.
// One without surface takes the mean of their farthest layer when at least six of them have surface,
// or 17 of the 24 around, as at the corner of a small hole. One of the surface that hangs together
// with fewer than three is no surface where most neighbours have none, else it takes the mean of
// their farthest layer; and so does one whose normal stands alone among neighbours that agree (where
// two sheets graze each other). Splash is left alone: a droplet may be one sample. The border stays.
//
// In rounds: close_specks finds what changes, apply_closed changes it. A sample changes only where
// something around it has changed in the round before, so that a round after the first has little to
// do. One work-item per strip of WIDTH samples of a row.

inline intv load_kind(global const uchar* kind) {
  int lane[WIDTH];
#pragma unroll
  for (int k = 0; k < WIDTH; ++k) lane[k] = kind[k];
  return LOADI(lane);
}

// Values from sample `first` on, which may lie before the map where its lanes are not used.
inline floatv load_from(global const float* map, const int first) {
#if WIDTH > 1
  if (first < 0) {
    float lane[WIDTH];
    for (int k = 0; k < WIDTH; ++k) lane[k] = map[max(first + k, 0)];
    return LOADF(lane);
  }
#endif
  return LOADF(map + max(first, 0));
}

// Whether a strip within two samples of this one has changed.
inline int changed_near(global const uchar* changed, const int strip, const int j, const int strips,
                        const int rows) {
  int any_changed = 0;
  const int reach = WIDTH == 1 ? 2 : 1;
  for (int y = max(j - 2, 0); y <= min(j + 2, rows - 1); ++y)
    for (int x = max(strip - reach, 0); x <= min(strip + reach, strips - 1); ++x)
      any_changed |= changed[y * strips + x];
  return any_changed;
}

kernel void close_specks(global const float* depth,   // [ny*nx] particle radii
                         global const float* normal,  // [3][ny*nx]
                         global const int* group, global const uchar* kind,
                         global float* closed_depth,  // out, where a sample changes
                         global float* closed_normal, global int* closed_group,
                         global uchar* closed_kind,
                         global uchar* change,         // [ny*nx] out in changed strips
                         global const uchar* changed,  // [ny*strips] in the round before
                         global uchar* changes,        // [ny*strips] out: in this round
                         const int2 samples, const int strips,
                         const float jump) {  // particle radii
  const int strip = get_global_id(0), j = get_global_id(1);
  if (strip >= strips || j >= samples.y) return;
  changes[j * strips + strip] = 0;
  if (j == 0 || j == samples.y - 1 || !changed_near(changed, strip, j, strips, samples.y)) return;
  const int i = strip * WIDTH, s = j * samples.x + i, n = samples.x * samples.y;
  const floatv none = (floatv)(0.0f);
  const intv zero = (intv)(0), one = (intv)(1);
  const floatv t = LOADF(depth + s);
  const floatv column = (float)i + LANES;
  const intv empty = !(t < INFINITY);
  const intv eligible = (column > 0.0f) & (column < (float)(samples.x - 1)) &
                        (empty | (load_kind(kind + s) != 2));
  if (!ANY(eligible)) return;

  floatv far = none;
  intv covered = zero, joined = zero;
  for (int k = 0; k < 9; ++k) {
    if (k == 4) continue;
    const floatv d = load_from(depth, s + (k / 3 - 1) * samples.x + k % 3 - 1);
    const intv there = d < INFINITY;
    covered += SELECT(zero, one, there);
    far = SELECT(far, fmax(far, d), there);
    joined += SELECT(zero, one, there & (fabs(d - t) <= jump));
  }
  if (!ANY(eligible & (!empty | (covered > 0)))) return;
  intv around = zero;
  if (j > 1 && j < samples.y - 2 && ANY(eligible & empty & (covered < 6))) {
    for (int k = 0; k < 25; ++k)
      around += SELECT(zero, one,
                       load_from(depth, s + (k / 5 - 2) * samples.x + k % 5 - 2) < INFINITY);
    around = SELECT(zero, around, (column > 1.0f) & (column < (float)(samples.x - 2)));
  }
  // The farthest layer, which for a sample of the surface is one that it does not belong to unless
  // all neighbours do.
  floatv sum = none, sx = none, sy = none, sz = none;
  intv count = zero, first = zero;
  for (int k = 0; k < 9; ++k) {
    if (k == 4) continue;
    const int shift = (k / 3 - 1) * samples.x + k % 3 - 1;
    const floatv d = load_from(depth, s + shift);
    const intv deep = (d < INFINITY) & !(far - d > jump);
    first = SELECT(first, (intv)(shift), deep & (count == 0));
    count += SELECT(zero, one, deep);
    sum += SELECT(none, d, deep);
    sx += SELECT(none, load_from(normal, s + shift), deep);
    sy += SELECT(none, load_from(normal, n + s + shift), deep);
    sz += SELECT(none, load_from(normal, 2 * n + s + shift), deep);
  }
  const floatv size = sqrt(sx * sx + sy * sy + sz * sz);
  const floatv along =
      LOADF(normal + s) * sx + LOADF(normal + n + s) * sy + LOADF(normal + 2 * n + s) * sz;
  const floatv number = TO_FLOATV(max(count, one));
  const floatv agreement = size / number;  // 1: all neighbours' normals are the same
  const intv alone = (count >= 6) & (count == covered) & (agreement > 0.93f) &
                     (along < (agreement - 0.03f) * size);
  const intv speck = !empty & (joined < 3);
  const intv goes = eligible & speck & (covered < 5);
  const intv wants = SELECT(speck | alone, (covered >= 6) | (around >= 17), empty);
  const intv takes = eligible & !goes & wants & (count >= SELECT((intv)(3), one, empty)) &
                     (size > 0.0f);
  if (!ANY(goes | takes)) return;

  float new_depth[WIDTH], nx[WIDTH], ny[WIDTH], nz[WIDTH];
  int go[WIDTH], take[WIDTH], from[WIDTH];
  STOREF(sum / number, new_depth);
  STOREF(sx / size, nx);
  STOREF(sy / size, ny);
  STOREF(sz / size, nz);
  STOREI(goes, go);
  STOREI(takes, take);
  STOREI(first, from);
  changes[j * strips + strip] = 1;
  for (int k = 0; k < WIDTH; ++k) {
    if (i + k >= samples.x) break;
    const int at = s + k;
    change[at] = go[k] || take[k];
    if (!change[at]) continue;
    closed_depth[at] = take[k] ? new_depth[k] : INFINITY;
    closed_normal[at] = take[k] ? nx[k] : 0.0f;
    closed_normal[n + at] = take[k] ? ny[k] : 0.0f;
    closed_normal[2 * n + at] = take[k] ? nz[k] : 0.0f;
    closed_group[at] = take[k] ? group[at + from[k]] : -1;
    closed_kind[at] = take[k] ? kind[at + from[k]] : 0;
  }
}

kernel void apply_closed(global const float* closed_depth, global const float* closed_normal,
                         global const int* closed_group, global const uchar* closed_kind,
                         global const uchar* change, global const uchar* changes,
                         global float* depth, global float* normal, global int* group,
                         global uchar* kind, const int2 samples, const int strips) {
  const int strip = get_global_id(0), j = get_global_id(1);
  if (strip >= strips || j >= samples.y || !changes[j * strips + strip]) return;
  const int n = samples.x * samples.y;
  for (int k = 0; k < WIDTH; ++k) {
    const int i = strip * WIDTH + k, at = j * samples.x + i;
    if (i >= samples.x || !change[at]) continue;
    depth[at] = closed_depth[at];
    normal[at] = closed_normal[at];
    normal[n + at] = closed_normal[n + at];
    normal[2 * n + at] = closed_normal[2 * n + at];
    group[at] = closed_group[at];
    kind[at] = closed_kind[at];
  }
}
