// Native versions of the kernels: the same algorithms as plain C++, compiled for the processor of
// the machine that builds them (-O3 -march=native). Each computes, for items [begin, end), what the
// kernel of its name computes, bit for bit, from the same arrays; see the kernel for what they
// hold.
//
// These sources include nothing of the program and of the library's templates: what the compiler
// would make of those here, the linker might give to the rest of the program.
#pragma once

#include <cstddef>
#include <cstdint>

namespace meniscus::bench::native {

/// Whether these sources are compiled with -march=native. If not, they are no measure: without
/// vectors and fused multiply-adds of the processor they are slower by far.
bool has_native_flags();

/// The first pass of particle_fit.cl's fit_particles, as if it were the last.
struct Fits {
  const float *place, *normal;
  const std::int32_t *particle, *neighbour, *first, *length;
  const float* support;
  float *quadric, *residual, *weight, *turned;
  std::size_t lanes;
  std::int32_t nobody;
  float falloff, height, height_growth, off_surface, ridge;
};
/// Batches [begin, end) of eight lanes each.
void fit_particles(const Fits& input, std::size_t begin, std::size_t end);

/// Particles in bucket order (cells.hpp). Vectors may be loaded from where the last is.
struct Cells {
  const float *x, *y, *z;
  const std::int32_t *tag, *start;
  float inverse_cell;
  std::uint32_t mask;
};

/// Every weight is 1.
struct Field {
  Cells cells;
  float* result;  // [4][count]
  float* weight;  // [count] of the levelled field
  std::size_t count;
  int least;    // in a cell, see measure_gradients in density.cl
  float level;  // of a lone particle
  float lone;   // how many times its weight it counts
};
void measure_gradients(const Field& input, std::size_t begin, std::size_t end);

struct Smoothing {
  const float* depth;  // [ny*nx]
  float* smoothed;     // [ny*nx]
  int nx, ny;
  float z_max, spread[3];
};
/// Rows [begin, end).
void smooth_columns(const Smoothing& input, std::size_t begin, std::size_t end);
void smooth_rows(const Smoothing& input, std::size_t begin, std::size_t end);

struct Normals {
  const float* depth;  // [ny*nx]
  float* normal;       // [3][ny*nx]
  int nx, ny;
  float first, step, z_max, ray[12];
};
/// Rows [begin, end).
void depth_normals(const Normals& input, std::size_t begin, std::size_t end);

/// One round of specks.cl, where all particles are large: what changes, and the change. Sixteen
/// values before and after each map may be read.
struct Specks {
  float *depth, *normal;
  std::int32_t* group;
  std::uint8_t* kind;
  float *new_depth, *new_normal;
  std::int32_t* new_group;
  std::uint8_t *new_kind, *change;
  const std::uint8_t* changed;
  std::uint8_t* changes;
  int nx, ny;
  float jump, link;
  int strips() const { return (nx + 7) / 8; }
};
/// Rows [begin, end).
void close_specks(const Specks& input, std::size_t begin, std::size_t end);
void apply_closed(const Specks& input, std::size_t begin, std::size_t end);

/// Samples by tile (samples.hpp): what a kernel that goes through lists is given of them.
struct Lists {
  const std::int32_t *sample, *count;
  int nx;
  float first, step, ray[12];
};

struct FitList {
  const std::int32_t *start, *fit;
  const float* place;  // [8][stride]
  std::ptrdiff_t stride;
};

struct Blend {
  Lists lists;
  const float *reference, *records, *feet;
  FitList met, rim;
  float *depth, *normal;
  std::int32_t* group;
  float* trust;
  std::size_t samples;
  float d_max, same_low, same_high, crease;
};
/// Tiles [begin, end).
void blend_groups(const Blend& input, std::size_t begin, std::size_t end);

/// What draws particles into bins of 8 x 8 samples (bins.cl) is given.
struct Bins {
  const float* records;
  const std::int32_t *end, *entry;  // of all bins; two values an entry
  float* depth;
  int bins_x, nx, ny;
  float first, step;
  std::ptrdiff_t values = 8;  // of a record
};
/// Bins [begin, end).
void splat_depth(const Bins& input, std::size_t begin, std::size_t end);

struct Triangles {
  Bins bins;  // sixteen values a triangle
  bool perspective;
};
/// Bins [begin, end).
void draw_triangles(const Triangles& input, std::size_t begin, std::size_t end);

struct Spheres {
  Bins bins;
  float ray[12];
};
/// Bins [begin, end).
void cast_spheres(const Spheres& input, std::size_t begin, std::size_t end);

struct Motion {
  const float* depth;  // [ny*nx]
  float* motion;       // [3][ny*nx]
  Cells cells;
  const float* velocity;  // [3][count]
  std::size_t count;
  int nx, ny;
  float first, step, ray[12];
};
/// Bins [begin, end) of 8 x 8 samples.
void motion_of_samples(const Motion& input, std::size_t begin, std::size_t end);

struct Settle {
  Lists lists;
  const float* triangle;
  float* reference;
  const float* trust;
  float *depth, *behind;
  std::int32_t *left, *left_count;  // [tiles][256] those that follow_field takes; [tiles]
  Cells cells;
  const float* weight;
  float contour, triangle_reach, before;
  bool only_gaps;
};
/// Tiles [begin, end).
void settle_samples(const Settle& input, std::size_t begin, std::size_t end);

struct Follow {
  Lists lists;
  const float *reference, *trust;
  float *depth, *normal;
  std::int32_t* group;
  std::uint8_t* kind;
  float* behind;
  Cells cells;
  const float *weight, *level_weight;
  std::size_t samples;
  float contour, level, search, beyond, disorder;
};
/// Tiles [begin, end).
void follow_field(const Follow& input, std::size_t begin, std::size_t end);

struct Interpolate {
  const std::uint8_t* shows;
  const float *reference, *splash;
  const std::int32_t *occupied, *splash_occupied;
  float *depth, *normal;
  std::int32_t* group;
  std::uint8_t* kind;
  std::uint8_t* wanted;
  float* open;
  int nx, ny, cells_x, cells_y, stride;
  float first, step;
  float ray[12];
  int every;
  float spread;
  bool perspective;
};
/// Tiles [begin, end), each the same share of the rows of cells.
void interpolate_samples(const Interpolate& input, std::size_t begin, std::size_t end);

}  // namespace meniscus::bench::native
