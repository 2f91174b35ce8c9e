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
// per RUN blocks, of WIDTH samples of BLOCK_ROWS rows each: most blocks are done with at a glance.

#define LINK 2.0f  // particle radii: the spacing
#if WIDTH == 1
#define RUN 1
#else
#define RUN BLOCK_RUN
#endif

// Whether any of a run of blocks is set.
inline int any_of_run(global const uchar* blocks) {
#if WIDTH == 1
  return *blocks;
#else
  return as_ulong(vload8(0, blocks)) != 0;
#endif
}

inline void clear_run(global uchar* blocks) {
#if WIDTH == 1
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
#if WIDTH == 1
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

// The surface before a round, and where what it changes is written.
typedef struct {
  global const float *depth, *normal;
  global const int* group;
  global const uchar* kind;
} Before;

typedef struct {
  global float *depth, *normal;
  global int* group;
  global uchar *kind, *change;
} After;

// WIDTH samples of row j from column i on.
typedef struct {
  int i, j, at;
  floatv t, column;
  intv empty, eligible;
} Row;

INLINED void row_at(const Before before, const int i, const int j, const int2 samples,
                    const float large_until, Row* row) {
  row->i = i;
  row->j = j;
  row->at = j * samples.x + i;
  row->t = LOADF(before.depth + row->at);
  row->column = (float)i + LANES;
  row->empty = !(row->t < INFINITY);
  const intv inner = (row->column > 0.0f) & (row->column < (float)(samples.x - 1));
  row->eligible = inner & (row->empty | (row->t <= large_until));
}

// Neighbour k of the eight, row by row; the fifth of the nine is the sample itself.
inline int shift_of(const int k, const int2 samples) {
  return (k / 3 - 1) * samples.x + k % 3 - 1;
}

// The neighbours' depths, and how a sample hangs together with them.
typedef struct {
  floatv far, near, apart;        // apart: the farthest that it does not hang together with
  intv covered, joined, linked;
} Around;

INLINED void look_around(const Before before, const Row* row, const int2 samples, const float jump,
                         Around* around) {
  const intv zero = (intv)(0), one = (intv)(1);
  around->far = around->apart = (floatv)(0.0f);
  around->near = (floatv)(INFINITY);
  around->covered = around->joined = around->linked = zero;
#pragma unroll
  for (int k = 0; k < 9; ++k) {
    if (k == 4) continue;
    const floatv d = load_from(before.depth, row->at + shift_of(k, samples));
    const intv there = d < INFINITY;
    around->covered += SELECT(zero, one, there);
    around->far = SELECT(around->far, larger(around->far, d), there);
    around->near = smaller(around->near, d);
    const intv hangs = there & (fabs(d - row->t) <= jump);
    around->joined += SELECT(zero, one, hangs);
    around->apart = SELECT(around->apart, larger(around->apart, d), there & !hangs);
    if (k % 2 == 1) around->linked |= fabs(d - row->t) <= LINK;
  }
}

// What a sample's own normal has along a sum of normals.
INLINED floatv along_sum(const Before before, const int at, const int n, const floatv sx,
                         const floatv sy, const floatv sz) {
  return LOADF(before.normal + at) * sx + LOADF(before.normal + n + at) * sy +
         LOADF(before.normal + 2 * n + at) * sz;
}

// Whether no sample changes: within one layer only a normal can stand alone, which is seldom.
INLINED int all_stay(const Before before, const Row* row, const Around* around, const int2 samples,
                     const float jump) {
  const int n = samples.x * samples.y;
  const intv eligible = row->eligible;
  if (!ANY(eligible & (!row->empty | (around->covered > 0)))) return 1;
  if (!ALL(!eligible | (!row->empty & (around->covered == 8) & (around->joined >= 3) & around->linked &
                        (around->far - around->near <= jump))))
    return 0;
  floatv sx = (floatv)(0.0f), sy = sx, sz = sx;
#pragma unroll
  for (int k = 0; k < 9; ++k) {
    if (k == 4) continue;
    const int at = row->at + shift_of(k, samples);
    sx += load_from(before.normal, at);
    sy += LOADF(before.normal + n + at);
    sz += LOADF(before.normal + 2 * n + at);
  }
  const floatv size = sqrt(sx * sx + sy * sy + sz * sz), agreement = size / 8.0f;
  const floatv along = along_sum(before, row->at, n, sx, sy, sz);
  return !ANY(eligible & (agreement > 0.93f) & (along < (agreement - 0.03f) * size));
}

// How many of the 24 around samples without surface have some, where that may close a hole.
INLINED intv covered_within_two(const Before before, const Row* row, const intv may_close,
                                const int2 samples) {
  const intv zero = (intv)(0), one = (intv)(1);
  intv around = zero;
  if (row->j <= 1 || row->j >= samples.y - 2 || !ANY(may_close)) return around;
  for (int k = 0; k < 25; ++k)
    around += SELECT(zero, one,
                     load_from(before.depth, row->at + (k / 5 - 2) * samples.x + k % 5 - 2) < INFINITY);
  return SELECT(zero, around, (row->column > 1.0f) & (row->column < (float)(samples.x - 2)));
}

// The depth of the farthest layer around, which for a sample of the surface is one that it does not
// belong to unless all neighbours do; in a pit, of those that it does not hang together with.
INLINED floatv farthest_layer(const Before before, const Row* row, const Around* around,
                              const intv speck, const int2 samples, const float jump) {
  if (!ANY(speck)) return around->far;
  const floatv t = row->t;
  intv between = (intv)(0);
#pragma unroll
  for (int k = 0; k < 4; ++k) {
    const int shift = shift_of(k, samples);
    between |= larger(load_from(before.depth, row->at + shift),
                      load_from(before.depth, row->at - shift)) < t - jump;
  }
  return SELECT(around->far, around->apart, speck & between);
}

// Sums over the neighbours of a layer; how many they are, and where the first one is.
typedef struct {
  floatv depth, x, y, z;
  intv count, first;
} Layer;

INLINED void sum_layer(const Before before, const Row* row, const floatv farthest, const int2 samples,
                       const float jump, Layer* sum) {
  const floatv none = (floatv)(0.0f);
  const intv zero = (intv)(0), one = (intv)(1);
  const int n = samples.x * samples.y;
  sum->depth = sum->x = sum->y = sum->z = none;
  sum->count = sum->first = zero;
#pragma unroll
  for (int k = 0; k < 9; ++k) {
    if (k == 4) continue;
    const int shift = shift_of(k, samples), at = row->at + shift;
    const floatv d = load_from(before.depth, at);
    const intv deep = (d <= farthest) & !(farthest - d > jump);
    sum->first = SELECT(sum->first, (intv)(shift), deep & (sum->count == 0));
    sum->count += SELECT(zero, one, deep);
    sum->depth += SELECT(none, d, deep);
    sum->x += SELECT(none, load_from(before.normal, at), deep);
    sum->y += SELECT(none, load_from(before.normal, n + at), deep);
    sum->z += SELECT(none, load_from(before.normal, 2 * n + at), deep);
  }
}

// Writes the samples that go or take the mean of their layer.
INLINED void write_changes(const Before before, const Row* row, const Layer* layer, const floatv number,
                           const floatv size, const intv goes, const intv takes, const int2 samples,
                           const After after) {
  const int n = samples.x * samples.y;
  const floatv sum = layer->depth;
  float new_depth[WIDTH], nx[WIDTH], ny[WIDTH], nz[WIDTH];
  int go[WIDTH], take[WIDTH], from[WIDTH];
  STOREF(sum / number, new_depth);
  STOREF(layer->x / size, nx);
  STOREF(layer->y / size, ny);
  STOREF(layer->z / size, nz);
  STOREI(goes, go);
  STOREI(takes, take);
  STOREI(layer->first, from);
  for (int k = 0; k < WIDTH; ++k) {
    if (row->i + k >= samples.x) break;
    const int at = row->at + k;
    after.change[at] = go[k] || take[k];
    if (!after.change[at]) continue;
    after.depth[at] = take[k] ? new_depth[k] : INFINITY;
    after.normal[at] = take[k] ? nx[k] : 0.0f;
    after.normal[n + at] = take[k] ? ny[k] : 0.0f;
    after.normal[2 * n + at] = take[k] ? nz[k] : 0.0f;
    after.group[at] = take[k] ? before.group[at + from[k]] : -1;
    after.kind[at] = take[k] ? before.kind[at + from[k]] : 0;
  }
}

// Finds what changes among WIDTH samples of row j from column i on; returns whether any does.
INLINED int close_row(const int i, const int j, const Before before, const After after,
                      const int2 samples, const float jump, const float large_until) {
  const intv one = (intv)(1);
  Row row;
  row_at(before, i, j, samples, large_until, &row);
  const intv eligible = row.eligible, empty = row.empty;
  if (!ANY(eligible)) return 0;
  Around near;
  look_around(before, &row, samples, jump, &near);
  if (all_stay(before, &row, &near, samples, jump)) return 0;

  const intv covered = near.covered, large = near.far <= large_until;
  const intv around =
      covered_within_two(before, &row, eligible & empty & large & (covered < 6), samples);
  const intv speck = !empty & ((near.joined < 3) | !near.linked);
  Layer layer;
  sum_layer(before, &row, farthest_layer(before, &row, &near, speck, samples, jump), samples, jump,
            &layer);
  const intv count = layer.count;
  const floatv size = sqrt(layer.x * layer.x + layer.y * layer.y + layer.z * layer.z);
  const floatv along =
      along_sum(before, row.at, samples.x * samples.y, layer.x, layer.y, layer.z);
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
  write_changes(before, &row, &layer, number, size, goes, takes, samples, after);
  return 1;
}

// The same for a block's rows, as bits.
INLINED int close_block(const int2 block, const Before before, const After after, const int2 samples,
                        const float jump, const float large_until) {
  const int i = block.x * WIDTH, first = block.y * BLOCK_ROWS;
  int changing = 0;
  for (int j = max(first, 1); j < min(first + BLOCK_ROWS, samples.y - 1); ++j)
    if (close_row(i, j, before, after, samples, jump, large_until)) changing |= 1 << (j - first);
  for (int j = first; changing && j < min(first + BLOCK_ROWS, samples.y); ++j)
    if (!(changing >> (j - first) & 1))
      for (int k = 0; k < WIDTH && i + k < samples.x; ++k) after.change[j * samples.x + i + k] = 0;
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
  const Before before = {depth, normal, group, kind};
  const After after = {closed_depth, closed_normal, closed_group, closed_kind, change};
  for (int k = 0; k < RUN; ++k) {
    const int2 block = (int2)(run.x + k, run.y);
    int changing = 0;  // rows, as bits
    if (block.x < blocks.x &&
        (how.round == 0 ? changed[block_of(block.x * WIDTH, block.y * BLOCK_ROWS, samples.x)]
                    : changed_near(changed, block, blocks, stride)))
      changing = close_block(block, before, after, samples, how.jump, how.large_until);
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
