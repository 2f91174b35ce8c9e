// What passes between stages. Lengths are in particle radii, eye space and pixel coordinates as in
// view.hpp, unless a comment says otherwise.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "device/records.hpp"
#include "stages/vec.hpp"
#include "stages/view.hpp"

namespace meniscus {

inline constexpr float kNoSurface = std::numeric_limits<float>::infinity();

/// Where the screen is sampled: sample (i, j) lies at pixel coordinates
/// (first + i * step, first + j * step) and is stored at j * nx + i.
struct SampleGrid {
  int nx = 0, ny = 0;
  float first = 0;  // pixels
  float step = 1;   // pixels
  std::size_t size() const { return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny); }
  bool operator==(const SampleGrid&) const = default;
};

/// The same as kernels take it.
inline records::Lattice lattice_of(const SampleGrid& grid) {
  return {grid.nx, grid.ny, grid.first, grid.step};
}

/// The image: W x H samples at pixel centres.
inline SampleGrid pixel_grid(const View& view) { return {view.width, view.height, 0.5f, 1.0f}; }

/// The paper's depth map (2.1): n_x = W/h + 1 by n_y = H/h + 1 nodes of cell size h, rounded up so
/// that the nodes reach the image's far edges.
inline SampleGrid node_grid(const View& view, double cell) {
  const auto nodes = [&](int side) { return static_cast<int>(std::ceil(side / cell)) + 1; };
  return {nodes(view.width), nodes(view.height), 0.0f, static_cast<float>(cell)};
}

/// The surface on a sample grid.
struct SurfaceMap {
  SampleGrid grid;
  std::vector<float> depth;         // [ny*nx] kNoSurface where there is none
  std::vector<Vec3> normal;         // [ny*nx] unit, outward, eye axes; zero where unknown
  std::vector<std::int32_t> group;  // [ny*nx] the heaviest group, -1: none
  std::vector<Kind> kind;           // [ny*nx]
  std::vector<Vec3> velocity;       // [ny*nx] world axes, world units per second; empty: unknown
};

/// A sample of the surface at one pixel position.
struct SurfaceSample {
  float depth = kNoSurface;
  Vec3 normal;  // unit, outward, eye axes; zero where unknown
};

/// Two neighbouring nodes whose depths differ by more than z_max (infinity counts): the silhouette
/// passes between them (Mueller et al. 2007, 3.4).
struct SilhouetteEdge {
  std::int32_t front = 0;  // node index of the shallow end; finite
  std::int32_t back = 0;   // node index of the deep end; may have no surface
  float cut = 0.5f;        // where the front layer ends: 0 at the front node, 1 at the back node
  SurfaceSample surface;   // the front layer at the cut
};

}  // namespace meniscus
