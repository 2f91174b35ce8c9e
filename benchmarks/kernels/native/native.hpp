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

struct Projection {
  const float *x, *y, *z, *scale;
  float *eye, *screen;
  std::size_t stride;
  float from_world[15], u_row[4], v_row[4], w_row[4], extent[4], size[2];
};
/// begin and end are multiples of eight.
void project_particles(const Projection& input, std::size_t begin, std::size_t end);

struct Triangles {
  const float* corners;
  std::uint32_t* depth;
  std::size_t stride;
  int nx, ny;
  float first, step;
  bool perspective;
};
void draw_triangles(const Triangles& input, std::size_t begin, std::size_t end);

struct Fits {
  const float* points;
  const std::int32_t *first, *length;
  const float* scale;
  float *quadric, *quality;
  std::size_t slots, lanes;
  float off_surface, tau, ridge;
};
/// Batches [begin, end) of eight lanes each.
void fit_groups(const Fits& input, std::size_t begin, std::size_t end);

}  // namespace meniscus::bench::native
