// paper: the paper's text as far as it can be read, where the method `fit` departs from it. It is
// there to reproduce the paper's figures.
//
// It has no cap on a group's size, no smoothing of normals, no ring of neighbours, no robust
// weights and, unless asked for, no offset: the surface passes through the particles' centres.
// Decided where the text leaves it open (docs/method.md has all of it, with the paper's words):
// - Visible particles, the longest Delaunay edge and d_max are those of `fit`: the text gives no
//   numbers, and without a longest edge the triangulation spans the background.
// - A ghost particle (2.2, step 2) replaces a particle of the deleted triangle that lies more than
//   d_max / 2 in front of its farthest. Triangles of ghosts merge like others.
// - The weight w of Eq. 2 is SLIM's [7], of the distance over 1.3 times the farthest member's. A
//   group of fewer than eight particles gets a plane.
// - Fewer than three neighbours within 3.2 particle radii make a splash particle (end of 3); so
//   does belonging to no group.
// paper.cl decides what Eqs. 3 to 7 leave open.
#pragma once

#include <vector>

#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "stages/frame/splash.hpp"
#include "stages/other_methods/merge_groups.hpp"
#include "stages/sample/surface_buffers.hpp"
#include "stages/sample/tile_lists.hpp"
#include "stages/sheet/triangulate.hpp"

namespace meniscus {

/// f(X) = c0 + c1 x + c2 y + c3 z + c4 xx + c5 yy + c6 zz + c7 xy + c8 yz + c9 zx with X in
/// particle radii from the group's centre along the eye axes. f is near a signed distance (particle
/// radii, positive outside) and zero on the surface: the offset is part of it.
struct Quadrics {
  std::vector<std::array<float, 10>> coefficient;  // [groups]
  std::vector<float> residual;  // [groups] weighted RMS of f at the points, particle radii;
                                // negative where there is no fit
};

/// Splash particles are those with fewer than three neighbours nearer than params.link.
SplashSplit split_by_neighbours(const Projected& projected, const SplashParams& params);

/// Patches the holes of deleted triangles with ghost particles (2.2, step 2): a vertex more than
/// d_max / 2 in front of its triangle's farthest is replaced by a new one at the same place of the
/// screen and the farthest's depth. All triangles of the result are kept; its fans are those of
/// `mesh`.
Triangulation add_ghost_particles(const View& view, const Triangulation& mesh, double d_max);

/// The visible particles of which no triangle is left, ascending indices into Projected.
std::vector<std::int32_t> particles_without_group(const Triangulation& mesh,
                                                  std::size_t visible_count);

/// Fits a height field over each group's plane (2.3, Eq. 2; kernel fit_heights). Waits. Throws
/// DeviceError, and InvalidArgument when there are more points than 32-bit indices reach.
///
///   offset  how far outside the points the surface lies, particle radii: the level f = offset
///           |grad f| at the group's centre; the paper's is 0
Quadrics fit_heights(Device& device, const Triangulation& mesh, const Groups& groups,
                     const FitParams& params, double offset = 0);

/// Groups as kernel blend_printed takes them.
struct GroupRecords {
  std::vector<float> values;      // [groups][20], see paper.cl
  std::vector<double> billboard;  // [groups] radius on which the group counts, particle radii
  std::vector<Vec3d> centre;      // [groups] eye space
};

GroupRecords printed_records(const View& view, const Groups& groups, const Quadrics& quadrics,
                             const BlendParams& params);

/// Which groups' billboards meet each tile.
TileLists list_groups(const View& view, const GroupRecords& records, const SampleGrid& grid);

/// The region of the surface (2.4.1).
struct PaperRegion {
  SampleGrid grid;
  Buffer<cl_int> group;  // [ny*nx] group of the sample's triangle, -1: outside
  Buffer<float> depth;   // [ny*nx] depth of the triangle, particle radii, kNoSurface outside
};

/// Draws the triangles (kernels own_samples, draw_region). Does not wait.
PaperRegion draw_region(Device& device, const View& view, const Triangulation& mesh,
                        const Groups& groups, const SampleGrid& grid);

/// Smooths the region's contour by Eqs. 3 to 5 (kernel smooth_contour).
///
///   cell  the depth map's cell size, pixels: the unit of params.sigma_s
///
/// Does not wait.
PaperRegion smooth_contour(Device& device, const PaperRegion& region, const Groups& groups,
                           const RegionParams& params, double cell);

/// Blends the groups over the region (2.4.2, Eqs. 6 and 7; kernel blend_printed). The result has no
/// normals: 2.5 takes them from the mesh. Does not wait.
SurfaceBuffers blend_printed(Device& device, const View& view, const PaperRegion& region,
                             const GroupRecords& records, const BlendParams& params,
                             const PaperParams& paper);

/// Draws splash particles as spheres of their own radius where they lie in front (end of 3; kernel
/// draw_spheres). Changes the surface. Does not wait.
void draw_spheres(Device& device, const View& view, const Projected& projected,
                  const std::vector<std::int32_t>& splash, const SurfaceBuffers& surface);

}  // namespace meniscus
