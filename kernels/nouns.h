// nouns.h: buffers that travel together are one argument of a kernel, a noun. Its macro gives the
// kernel's text the parameters behind it; a launch takes for it any value of C++ whose members have
// the same names (device/kernels.hpp, which cmake/embed.cmake makes).
//
// `access` is const or nothing; `of` goes in front of the names in the kernel. Where a kernel gives the
// names itself, those here are the members'.

// The lists of samples.cl. [tiles][256]; [2][tiles].
#define SAMPLES(access, sample, count) \
  global access int* sample, global access int* count

// What samples show: [samples], but [3][samples] of the normal.
#define SHOWN(access, of) \
  global access float* of##depth, global access float* of##normal, \
  global access int* of##group, global access uchar* of##kind

// The shown of samples but for who shows it.
#define CORNERS(depth, normal, kind) \
  global const float* depth, global const float* normal, global const uchar* kind

// Maps that say where there may be surface and splash, [samples] finite there, and at how many samples
// of each block they are, [blocks]: a map is not read where 0 are.
#define FRONTS(reference, splash, occupied, splash_occupied) \
  global const float* reference, global const float* splash, \
  global const int* occupied, global const int* splash_occupied

// The trust in a blend (blend.cl) and its depth.
#define TRUSTED(access, trust, depth) \
  global const float* trust, global access float* depth

// The same with all that is shown.
#define SURFACE(access, of) \
  global const float* of##trust, global access float* of##depth, \
  global access float* of##normal, global access int* of##group, global access uchar* of##kind

// What a blend leaves.
#define BLENDED(access, of) \
  global access float* of##depth, global access float* of##normal, \
  global access int* of##group, global access float* of##trust

// Which samples discs, spheres or triangles may cover, and in front of which bins' bounds (bins.cl):
// [4][stride]; [stride].
#define OUTLINES(access, box, key) \
  global access int* box, global access float* key

// Which cells they hide, and what lies deeper there: [4][stride]; [stride].
#define COVERS(access, cells, deepest) \
  global access int* cells, global access float* deepest

// What later kernels lower or add to, out: [cells] +infinity of bounds (bins.cl); [nodes] +infinity of a
// map of depths and INT_MAX of their owners (minima.cl); [counts] 0 of what each disc owns.
#define BLANKS(cell, depth, owner, owned) \
  global float* cell, global float* depth, global int* owner, global int* owned

// The discs of bins: [bins] where each bin's entries end, [entries] disc and place in the bin (fill_bins).
#define ENTRIES(end, entry) \
  global const int* end, global const int2* entry

// What atomic minima and maxima draw into (minima.cl), [samples] +infinity and 0 before, and at how many
// samples of each block they do, [blocks] 0 before.
#define LOWERED(depth, occupied) \
  global uint* depth, global int* occupied
#define LOWERED_AND_RAISED(from, to, occupied) \
  global uint* from, global uint* to, global int* occupied

// Between which depths of a sample there may be anything. [samples].
#define EXTENT(access, from, to) \
  global access float* from, global access float* to

// Points, [n].
#define POINTS(x, y, z) \
  global const float* x, global const float* y, global const float* z

// Their velocities, [n].
#define VELOCITIES(vx, vy, vz) \
  global const float* vx, global const float* vy, global const float* vz

// Particles by the cells of a hash grid (cells.cl): [n] in bucket order, [buckets + 1].
#define CELLS(of) \
  global const float* of##x, global const float* of##y, global const float* of##z, \
  global const uint* of##tag, global const int* of##start, const CellGrid of##grid
#define CELLS_OF(of) \
  {of##x, of##y, of##z, of##tag, of##start, of##grid.inverse_cell, of##grid.mask}

// The same with values of theirs, [n] or rows of them.
#define CELLS_WITH(of, values) \
  global const float* of##x, global const float* of##y, global const float* of##z, \
  global const float* values, \
  global const uint* of##tag, global const int* of##start, const CellGrid of##grid

// The same of the density field: each particle counts `weight`.
#define FIELD(of, weight) \
  global const float* of##x, global const float* of##y, global const float* of##z, \
  global const uint* of##tag, global const int* of##start, const CellGrid of##grid, \
  global const float* weight

// Kernels of particles by the cells of a hash grid: [11][n] of shape_kernels.
#define SHAPES(x, y, z, start, shapes) \
  global const float* x, global const float* y, global const float* z, \
  global const int* start, global const float* shapes

// Which group, or particle, a sample shows, and how deep.
#define REGION(access, group, depth) \
  global access int* group, global access float* depth

// The lanes of fits (neighbours.cl): [lanes] each one's particle, and its influence on its neighbours,
// 0 .. 1. The particles around them: [slots]; [batches] each.
#define AROUND(particle, influence, neighbour, first, length) \
  global const int* particle, global const float* influence, global const int* neighbour, \
  global const int* first, global const int* length

// A pass over lanes: [3][lanes] support, particle radii, roundness, firmness; [10][lanes] quadric around the
// particles; [lanes] residual, -1: no fit; [slots] weights.
#define FITTED(support, quadric, residual, weight) \
  global float* support, global float* quadric, global float* residual, global float* weight

// What supports are narrowed by before the last pass: [fits] the mean residual of the sheet around each
// in bucket order, not above 0 where nothing is known; [1] what noise explains of it, particle radii.
#define NARROWED(mean, noise) \
  global const float* mean, global const float* noise

// What is measured behind the last pass: [9][lanes] rows; the weights are that pass's.
#define MEASURED(support, quadric, weight, residual, rows) \
  global const float* support, global const float* quadric, global const float* weight, \
  global float* residual, global float* rows

// Where fits, or those of lanes, are in a sheet (sheet.cl), in bucket order; -1: the lane is not in use.
// Out, of all fits: [3][fits] unit normals; [fits] how much each counts; [values][fits].
#define IN_SHEET(to, toward, share, value) \
  global const int* to, global float* toward, global float* share, global float* value

// Fits (hits.cl): [fits][FIT]; [fits][4].
#define FITS(record, foot) \
  global const float* record, global const float* foot

// Which of them a tile's rays may meet, and which may be steep or turn away from the eye, ascending:
// [tiles + 1]; [fits of the list]; [8 or 4][stride of the list], see List in tile_lists.cl.
#define FITS_OF_TILES() \
  global const int* met_start, global const int* met, global const float* met_place, \
  global const int* rim_start, global const int* rim, global const float* rim_place, \
  const int2 strides
