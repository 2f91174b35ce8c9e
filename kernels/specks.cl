// specks.cl: closes pinholes and removes specks of the surface.
//
// A sample hangs together with those of its eight neighbours whose depths differ by at most `jump`.
// One without surface takes the mean of their farthest layer when at least seven of them have surface.
// No more is done where particles are small, beyond depth `large_until`: drops, arms and the gaps
// between them are as small as flaws there.
//
// Up to that depth six with surface are enough, or 17 of the 24 around, as at the corner of a small
// hole. A sample of the surface that hangs together with fewer than three is no surface where most
// neighbours have none, else it takes the mean of their farthest layer; and so does one whose normal
// stands alone among neighbours that agree (where two sheets graze each other). At rims a sample may
// lie between two layers and hang on none: one that is farther than LINK from all four beside it
// counts as one with fewer than three. In a pit of two or three, through which what lies behind
// shows, samples would be each other's farthest layer, so there only those count that they do not
// hang together with. In a pit samples lie between two in front of them. Where a face is seen from
// its edge depths are as far apart, but in front they are on one side alone. The border stays.
//
// In rounds: close_specks finds what changes, apply_closed changes it. The first looks where samples
// were listed, the next only where something around has changed in the round before. One work-item
// per RUN blocks, of WIDTH samples of eight rows each: most blocks are done with at a glance.

#define BLOCK_ROWS 8
#define LINK 2.0f  // particle radii: the spacing
#if WIDTH == 1
#define RUN 1
#else
#define RUN 8
#endif

// Whether any of a run of blocks is set.
inline int any_of_run(global const uchar* blocks) {
#if RUN == 1
  return *blocks;
#else
  return as_ulong(vload8(0, blocks)) != 0;
#endif
}

inline void clear_run(global uchar* blocks) {
#if RUN == 1
  *blocks = 0;
#else
  vstore8((uchar8)(0), 0, blocks);
#endif
}

// Whether a block within two samples of this one has changed, and of any of the run from it on.
inline int changed_near(global const uchar* changed, const int2 block, const int2 blocks,
                        const int stride) {
  int any_changed = 0;
  const int reach = WIDTH == 1 ? 2 : 1;
#pragma unroll
  for (int y = -1; y <= 1; ++y)
#pragma unroll
    for (int x = -reach; x <= reach; ++x)
      any_changed |= changed[clamp(block.y + y, 0, blocks.y - 1) * stride +
                             clamp(block.x + x, 0, blocks.x - 1)];
  return any_changed;
}
inline int changed_near_run(global const uchar* changed, const int2 run, const int2 blocks,
                            const int stride) {
#if RUN == 1
  return 1;
#else
  int any_changed = 0;
#pragma unroll
  for (int y = -1; y <= 1; ++y) {
    global const uchar* row = changed + clamp(run.y + y, 0, blocks.y - 1) * stride;
    any_changed |= any_of_run(row + run.x) | row[max(run.x - 1, 0)] |
                   row[min(run.x + RUN, blocks.x - 1)];
  }
  return any_changed;
#endif
}

// Finds what changes among WIDTH samples of row j from column i on; returns whether any does.
inline int close_row(const int i, const int j, global const float* depth,
                     global const float* normal, global const int* group,
                     global const uchar* kind, global float* closed_depth,
                     global float* closed_normal, global int* closed_group,
                     global uchar* closed_kind, global uchar* change, const int2 samples,
                     const float jump, const float large_until) {
  const int s = j * samples.x + i, n = samples.x * samples.y;
  const floatv none = (floatv)(0.0f);
  const intv zero = (intv)(0), one = (intv)(1);
  const floatv t = LOADF(depth + s);
  const floatv column = (float)i + LANES;
  const intv empty = !(t < INFINITY);
  const intv inner = (column > 0.0f) & (column < (float)(samples.x - 1));
  const intv eligible = inner & (empty | (t <= large_until));
  if (!ANY(eligible)) return 0;

  floatv far = none, near = (floatv)(INFINITY), apart = none;
  intv covered = zero, joined = zero, linked = zero;
#pragma unroll
  for (int k = 0; k < 9; ++k) {
    if (k == 4) continue;
    const floatv d = load_from(depth, s + (k / 3 - 1) * samples.x + k % 3 - 1);
    const intv there = d < INFINITY;
    covered += SELECT(zero, one, there);
    far = SELECT(far, larger(far, d), there);
    near = smaller(near, d);
    const intv hangs = there & (fabs(d - t) <= jump);
    joined += SELECT(zero, one, hangs);
    apart = SELECT(apart, larger(apart, d), there & !hangs);
    if (k % 2 == 1) linked |= fabs(d - t) <= LINK;
  }
  if (!ANY(eligible & (!empty | (covered > 0)))) return 0;
  // Within one layer only a normal can stand alone, which is seldom.
  if (ALL(!eligible | (!empty & (covered == 8) & (joined >= 3) & linked & (far - near <= jump)))) {
    floatv sx = none, sy = none, sz = none;
#pragma unroll
    for (int k = 0; k < 9; ++k) {
      if (k == 4) continue;
      const int at = s + (k / 3 - 1) * samples.x + k % 3 - 1;
      sx += load_from(normal, at);
      sy += LOADF(normal + n + at);
      sz += LOADF(normal + 2 * n + at);
    }
    const floatv size = sqrt(sx * sx + sy * sy + sz * sz), agreement = size / 8.0f;
    const floatv along =
        LOADF(normal + s) * sx + LOADF(normal + n + s) * sy + LOADF(normal + 2 * n + s) * sz;
    if (!ANY(eligible & (agreement > 0.93f) & (along < (agreement - 0.03f) * size))) return 0;
  }
  const intv large = far <= large_until;
  intv around = zero;
  if (j > 1 && j < samples.y - 2 && ANY(eligible & empty & large & (covered < 6))) {
    for (int k = 0; k < 25; ++k)
      around += SELECT(zero, one,
                       load_from(depth, s + (k / 5 - 2) * samples.x + k % 5 - 2) < INFINITY);
    around = SELECT(zero, around, (column > 1.0f) & (column < (float)(samples.x - 2)));
  }
  // The farthest layer, which for a sample of the surface is one that it does not belong to unless
  // all neighbours do; in a pit, of those that it does not hang together with.
  const intv speck = !empty & ((joined < 3) | !linked);
  floatv layer = far;
  if (ANY(speck)) {
    intv between = zero;
#pragma unroll
    for (int k = 0; k < 4; ++k) {
      const int shift = (k / 3 - 1) * samples.x + k % 3 - 1;
      between |= larger(load_from(depth, s + shift), load_from(depth, s - shift)) < t - jump;
    }
    layer = SELECT(far, apart, speck & between);
  }
  floatv sum = none, sx = none, sy = none, sz = none;
  intv count = zero, first = zero;
#pragma unroll
  for (int k = 0; k < 9; ++k) {
    if (k == 4) continue;
    const int shift = (k / 3 - 1) * samples.x + k % 3 - 1;
    const floatv d = load_from(depth, s + shift);
    const intv deep = (d <= layer) & !(layer - d > jump);
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
  const intv goes = eligible & speck & (covered < 5);
  const intv hole = (covered >= 7) | (large & ((covered >= 6) | (around >= 17)));
  const intv wants = SELECT(speck | alone, hole, empty);
  const intv takes = eligible & !goes & wants & (count >= SELECT((intv)(3), one, empty)) &
                     (size > 0.0f);
  if (!ANY(goes | takes)) return 0;

  float new_depth[WIDTH], nx[WIDTH], ny[WIDTH], nz[WIDTH];
  int go[WIDTH], take[WIDTH], from[WIDTH];
  STOREF(sum / number, new_depth);
  STOREF(sx / size, nx);
  STOREF(sy / size, ny);
  STOREF(sz / size, nz);
  STOREI(goes, go);
  STOREI(takes, take);
  STOREI(first, from);
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
  return 1;
}

// The same for a block's rows, as bits.
inline int close_block(const int2 block, global const float* depth, global const float* normal,
                       global const int* group, global const uchar* kind,
                       global float* closed_depth, global float* closed_normal,
                       global int* closed_group, global uchar* closed_kind, global uchar* change,
                       const int2 samples, const float jump,
                       const float large_until) {
  const int i = block.x * WIDTH, first = block.y * BLOCK_ROWS;
  int changing = 0;
  for (int j = max(first, 1); j < min(first + BLOCK_ROWS, samples.y - 1); ++j)
    if (close_row(i, j, depth, normal, group, kind, closed_depth, closed_normal, closed_group,
                  closed_kind, change, samples, jump, large_until))
      changing |= 1 << (j - first);
  for (int j = first; changing && j < min(first + BLOCK_ROWS, samples.y); ++j)
    if (!(changing >> (j - first) & 1))
      for (int k = 0; k < WIDTH && i + k < samples.x; ++k) change[j * samples.x + i + k] = 0;
  return changing;
}

kernel void close_specks(SHOWN(const, ),
                         SHOWN(, closed_),             // out, where a sample changes
                         global uchar* change,         // [ny*nx] out in changed blocks
                         global const uchar* changed,  // [rows][stride] in the round before; in the
                                                       // first, the listed blocks (samples.hpp)
                         global uchar* changes,        // [rows][stride] of blocks, out: in this round
                         const Closing how) {
  const int2 samples = (int2)(how.blocks.nx, how.blocks.ny);
  const int2 blocks = (int2)(how.blocks.across, how.blocks.down);
  const int stride = how.blocks.stride;
  const int2 run = (int2)(get_global_id(0) * RUN, get_global_id(1));
  if (run.x >= blocks.x || run.y >= blocks.y) return;
  if (how.round > 0 && !changed_near_run(changed, run, blocks, stride)) {
    clear_run(changes + run.y * stride + run.x);
    return;
  }
  for (int k = 0; k < RUN; ++k) {
    const int2 block = (int2)(run.x + k, run.y);
    int changing = 0;  // rows, as bits
    if (block.x < blocks.x &&
        (how.round == 0 ? changed[block_of(block.x * WIDTH, block.y * BLOCK_ROWS, samples.x)]
                    : changed_near(changed, block, blocks, stride)))
      changing = close_block(block, depth, normal, group, kind, closed_depth, closed_normal,
                             closed_group, closed_kind, change, samples, how.jump, how.large_until);
    changes[block.y * stride + block.x] = changing != 0;
  }
}

kernel void apply_closed(SHOWN(const, closed_), global const uchar* change,
                         global const uchar* changes, SHOWN(, ), const Blocks how) {
  const int2 samples = (int2)(how.nx, how.ny), blocks = (int2)(how.across, how.down);
  const int stride = how.stride;
  const int2 run = (int2)(get_global_id(0) * RUN, get_global_id(1));
  if (run.x >= blocks.x || run.y >= blocks.y || !any_of_run(changes + run.y * stride + run.x))
    return;
  const int n = samples.x * samples.y, first = run.y * BLOCK_ROWS;
  for (int x = run.x; x < min(run.x + RUN, blocks.x); ++x) {
    if (!changes[run.y * stride + x]) continue;
    for (int j = first; j < min(first + BLOCK_ROWS, samples.y); ++j)
      for (int i = x * WIDTH; i < min((x + 1) * WIDTH, samples.x); ++i) {
        const int at = j * samples.x + i;
        if (!change[at]) continue;
        depth[at] = closed_depth[at];
        normal[at] = closed_normal[at];
        normal[n + at] = closed_normal[n + at];
        normal[2 * n + at] = closed_normal[2 * n + at];
        group[at] = closed_group[at];
        kind[at] = closed_kind[at];
      }
  }
}
