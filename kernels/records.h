// records.h: what kernels and C++ both know. Kernels have it in front of their text; C++ includes it
// through device/records.hpp, in namespace meniscus::records.
//
// A record is a kernel's argument, by value. All members have four bytes, so that no compiler puts
// anything between them (`meniscus verify`, probe `records`).

#ifdef __OPENCL_VERSION__
#define RECORD(name) typedef struct name name; struct name
#endif

enum {
  TILE = 16,  // samples are taken in tiles of TILE x TILE (samples.cl),
  BIN = 8,    // and drawn in bins of BIN x BIN (bins.cl)
  DISC_SHARES = 8,  // work-items that share a disc on GPUs (minima.cl)
  CHOICE_ROWS = 8,  // rows of samples whose fits are chosen together (choose_groups.cl)
  BLOCK_ROWS = 8,   // rows of a block of samples, and
  BLOCK_RUN = 8,    // blocks that a work-item takes, but on GPUs (specks.cl)
  FIT_BATCH = 16,   // lanes whose neighbours lie one beside the other (neighbours.cl)
  // Set in the group of a sample that was interpolated: its group is the one of a corner, until
  // choose_groups.cl has looked at those around. All bits are set in -1, no group.
  OF_CORNER = 1 << 30
};

// A fit's record in the blend (hits.cl): FIT floats, which fill a line of most caches. The quadric around
// its foot comes first (fit.cl). Foot and reach are four floats in an array of their own.
enum {
  FIT_NARROWNESS = 10,  // one over the reach squared, 1 / particle radii^2
  FIT_WEIGHT,           // in the blend; 0: no ray meets it
  FIT_DOUBT,            // one over the trust that is part of the weights (trust.hpp)
  FIT_END_WEIGHT,       // the weight where the fluid ends (hidden.cl)
  FIT_FIRMNESS,         // over the e in the weights
  FIT_ROUND,            // how round it is, 0 between two sheets to ROUNDEST around a bend
  FIT
};
#define ROUNDEST 0.9f

// Rows of what is measured of fits (edges.cl).
enum {
  EDGE_ROW,        // e
  FIRMNESS_ROW,
  SPREAD_ROW,      // particle radii
  SUPPORTERS_ROW,  // number of neighbours, each by its u
  NORMAL_ROW,      // three
  SUPPORT_ROW = NORMAL_ROW + 3,  // particle radii
  ROUNDNESS_ROW,
  FIT_ROWS
};

// What is drawn of discs: the nearest fronts, those behind a map (behind.cl), or all (visible.cl).
enum { FRONT = 0, BEHIND = 1, EVERY = 2 };

// Which samples of a list are kept: those where one map is less than another, and so where a third is
// not finite, or where it is finite (list_samples.cl).
enum { NEARER = 0, NEARER_UNLESS = 1 };

// Added to the trust in a blended sample.
#define ON_EDGE 2.0f  // at a convex crease: the density is low there although the sheets go on
#define ENDED 4.0f    // beyond a convex edge of the fluid
#define PASSED 8.0f   // over the surface, which the ray does not enter

// Faces that rays meet at no more than this cosine are steep. Those beside a sample may lie too far along
// the ray to be met near it; they are evaluated at the sample itself (hidden.cl).
#define STEEP 0.5f

// Particles count in the density (field.cl), and in motion (motion.cl), within this distance, particle
// radii. No cell has a smaller side.
#define DENSITY_SUPPORT 4.0f
#define MOTION_SUPPORT 4.0f

// Neighbours weigh in a fit within this share of its support (neighbours.cl).
#define FIT_REACH 0.85f

// Where samples lie on the screen: sample (i, j) at pixel (first + i step, first + j step).
RECORD(Lattice) {
  int nx, ny;
  float first, step;  // pixels
};

// The ray of pixel (u, v): eye point (o + t d, -t) at depth t, affine in the pixel coordinates:
// o.x = ox + ox_u u + ox_v v.
RECORD(RayMap) {
  float ox, ox_u, ox_v, oy, oy_u, oy_v;
  float dx, dx_u, dx_v, dy, dy_u, dy_v;
};

// Samples and the rays through them.
RECORD(Screen) {
  int nx, ny;
  float first, step;  // pixels; interpolate.cl: from one that is asked for to the next
  RayMap rays;
};

// From the world to eye space and the screen (paper 2.1, step 1): eye e = rotation (X - origin) + shift,
// particle radii; u = u_row.(e, 1) / w_row.(e, 1), pixels.
RECORD(Projection) {
  float rotation[9], shift[3], origin[3];  // over the particle radius; particle radii; world units
  float u_row[4], v_row[4], w_row[4];
  float u_scale, v_scale;      // pixels w per particle radius
  float near_depth, margin;    // particle radii
  float width, height;         // of the image, pixels
};

// The map of the nearest particles (stream.cl).
RECORD(FrontCells) {
  int nx, ny;
  float per_pixel, border;  // cells; those beyond the screen's edge
  int block, blocks;        // cells along a block's side; blocks in a row
};

// Particles of one type of whitewater, and what is summed of them (whitewater.cl).
#define WHITEWATER_MOST 1048576.0f  // velocity and depth behind the front count up to this
RECORD(Whitewater) {
  int count;
  int nx, ny;              // pixels
  int moves, lies_behind;  // 1: velocities, depths behind the front are summed, too
  float per_length;        // particle radii per world unit
  float speed;             // steps of velocity per world unit per second, a power of two
  float slack;             // the front lies so far behind `from`, particle radii
};

// A hash grid (cells.cl).
RECORD(CellGrid) {
  float inverse_cell;  // 1 / particle radii
  uint mask;           // buckets - 1
};

// What settle.cl asks of the density field.
RECORD(FieldLimits) {
  float contour;   // the density below which the surface has ended
  float level;     // of the levelled field: the surface
  float vouching;  // a triangle this near to a sample vouches for it, particle radii
  float before;    // the field is sought so far before the blend or the reference, and
  float beyond;    // so far behind them, particle radii
  float disorder;  // of the particles, 0 .. 2: the field of irregular ones tells less
};

RECORD(Settling) {
  Screen screen;
  FieldLimits limits;
  int only_gaps;  // 1: samples that show something stay
};

// What is sorted into bins (bins.cl), `across` of them in a row.
RECORD(Outlined) {
  int count, stride;  // discs; values in a row of theirs
  int across;
};

// What particles may cover, and the cells that they hide (visible.cl).
RECORD(Covering) {
  int stride;                // values in a row of theirs
  Lattice samples;
  float inverse_step;        // of samples, 1 / pixels
  int shift;                 // a cell's side is 1 << shift samples
  float footprint, bulge;    // particle radii; over the footprint
  int cells, nodes, counts;  // how many begin blank, see BLANKS
};

// Particles that are drawn as spheres (minima.cl).
RECORD(DrawnSpheres) {
  int count, stride;       // particles; values in a row of theirs
  int across;              // bins in a row
  int drawn;               // FRONT, BEHIND or EVERY
  float footprint, bulge;  // particle radii; over the footprint
  float inverse_step;      // of samples, 1 / pixels
};

// In chunks, one to a work-item.
RECORD(Chunked) {
  int count, stride, across;
  int chunk;  // discs
  int own;    // counts of a chunk, bins and some more; 0: shared ones, which are 0 before
};

// The bins whose entries are given.
RECORD(ListedBins) {
  int begin, end;
  int across;
};

// What an anisotropic kernel is shaped by (anisotropic.cl).
RECORD(KernelShape) {
  float h, lambda;           // particle radii; share of the mean in the centre
  float per_variance, most;  // k_s over the variance of a full neighbourhood; most stretch
  float k_r, k_n, n_eps;
};

// Rays through the field of `kernels` kernels.
RECORD(FieldRays) {
  int rays, kernels;
  float level;
  RayMap map;
};

// How groups are blended as printed (paper.cl).
RECORD(PrintedBlend) {
  float u_scale, v_scale;  // see View
  float w_row[4];
  float d_max;             // particle radii
  float b_least, b_gain;   // of R: at right angles, gain to equal normals
};

// Points of the implicit function (implicit.cl).
RECORD(Implicit) {
  int count, stride;
  float reach;                // of the fits' weights, at most, particle radii
  float contour, level;       // as of FieldLimits
  float same_low, same_high;  // as of Blending
  float mass;                 // of a particle, see upload_cells()
  float disorder;             // of the particles, 0 .. 1
};

// What a pass fits with (particle_fit.cl).
RECORD(FitModel) {
  float sigma, tau, off_surface, ridge;  // at roundness 0
  float sigma_gain, tau_gain, off_surface_gain, ridge_gain;  // of roundness 1 over these
};

RECORD(FitPass) {
  int lanes;
  int nobody;      // the particle of lanes that are not in use
  int fits;        // of all lanes
  int done, left;  // passes before and after this one
  int groups;      // 1: of groups, not firm between passes; e and firmness times the influence of each
  int tries;       // 1: of trial fits (roundness.cl): one quadric in the first trial, two sheets in the second
  int narrows;     // 1: supports are narrowed first, see narrowed_support in particle_fit.cl
  float full;      // the support of a fit between two sheets, particle radii
  float round_gain;  // of roundness 1 over that
  float least;       // to which share of `full` supports are narrowed at most
  FitModel model;
  float reach;     // within which normals agree or do not, particle radii
  float sharp;     // how many times more of 2 / sigma^2 a firm fit has
  float leeway;    // products of normals so much below 1 are no difference to a firm fit
  float ahead;     // what lies ahead of a firm fit, over what lies behind
  float height, height_growth;  // h_0, particle radii; h_1, 1 / particle radii
};

// What noise explains of residuals (particle_fit.cl).
RECORD(Noise) {
  int fits;
  float least;  // particle radii
  float over;   // times the residual that a twentieth are below
};

// How far fits' edges look, and where the density around fits is asked for (edges.cl).
RECORD(Feet) {
  float offset;  // of the surface from particles, particle radii
  float deep;    // how far behind the feet the density is asked for, too, particle radii
};

// Lanes of trial fits and what counts around them (roundness.cl).
RECORD(Trial) {
  int lanes, nobody;
  int fits;                   // of all lanes
  float reach;                // particle radii
  float same_low, same_high;  // as of Blending
};

// Samples and the blocks of them that a round takes (specks.cl).
RECORD(Blocks) {
  int nx, ny;          // samples
  int across, down;    // blocks
  int stride;          // blocks in a row, and those that pad it to runs
};

RECORD(Closing) {
  Blocks blocks;
  int round;
  float jump;         // particle radii
  float large_until;  // depth up to which a particle's radius spans some samples, particle radii
};

// Cells between the samples of a lattice, two of the samples asked for along each side
// (interpolate.cl).
RECORD(LatticeCells) {
  int cells_x, cells_y;
  int stride, rows;  // cells in a row and those that pad it; the same of rows
  int every;         // samples from one that is asked for to the next
  float tolerance;   // of corners to the planes of others, particle radii
  float agreeing;    // the least cosine between their normals
  float spread;      // of the depths by the corners' planes, at most, particle radii
  int trust_empty;   // 1: nothing fits between the lattice's samples
  int perspective;
};

// Points on a grid's tiles, whose lists of fits serve them, and their rays.
RECORD(PointsOnTiles) {
  int count, tiles_x, tiles_y;
  float first, inverse_tile;  // pixels, 1 / pixels
  RayMap rays;
};

// Whose fits count in a mean (sheet.cl).
RECORD(SheetWeights) {
  float reach;      // particle radii
  float low, high;  // cosines between normals from which fits begin to count, and count in full
};

RECORD(SheetMeans) {
  int fits;
  int values;  // 1 or 3
  SheetWeights weights;
};

// How bends are scored (sheet.cl).
RECORD(BendScoring) {
  int fits;
  SheetWeights near;  // over which evidence is averaged
  float noise;        // squared distance that irregular particles add, radii^2
  float rounder;      // is added to the scores of irregular particles
};

// Over which of these scores the mean goes (sheet.cl).
RECORD(ScoreMeans) {
  int fits;
  float reach;  // particle radii
};

// How intersections are blended (blend.cl).
RECORD(Blending) {
  float d_max;                // of a hit from the reference, particle radii
  float same_low, same_high;  // cosines between which normals become those of one sheet
  float crease;               // two sheets meet within this of each other, particle radii
};

#ifdef __OPENCL_VERSION__
#undef RECORD
#endif
