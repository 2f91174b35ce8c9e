// Native versions of the three kernels that take most of a frame: the same algorithms as plain C++,
// compiled for the processor of the machine that builds them (-O3 -march=native). Each computes,
// for items [begin, end), what the kernel of its name computes, bit for bit, from the same arrays;
// see the kernel for what they hold.
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

}  // namespace meniscus::bench::native
