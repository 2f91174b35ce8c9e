#include "methods/contour.hpp"

#include <bit>

#include "methods/closed_steps.hpp"
#include "stages/closed/dual_mesh.hpp"
#include "stages/closed/share_space.hpp"

namespace meniscus {
namespace {

// Corners around a box's own that are needed to mesh its cells: those of the cells around them.
constexpr int kMeshed = 1;

constexpr int kCubeBlocks = 8;         // side of the cubes in which seeds are counted
constexpr double kThinnestCells = 64;  // side of a box
// What the cells around a seed take where cells are as large as its radius: those of one that lies
// apart from others most, in a plane and on either side of it.
constexpr double kSeedBytes = 2048;

Points points_in(const SpaceBox& box, const Points& points) {
  Points inside;
  for (std::size_t p = 0; p < points.size(); ++p) {
    const Vec3d at{points.x[p], points.y[p], points.z[p]};
    if (box.holds(at)) inside.add(at);
  }
  return inside;
}

std::size_t wanted_in(const SpaceGrid& grid, const BlockBox& own) {
  std::size_t corners = 0;
  for (const CornerBlock& block : grid.blocks)
    if (own.holds(block.at)) corners += static_cast<std::size_t>(std::popcount(block.wanted));
  return corners;
}

void ask_corners(Device& device, const ImplicitFunction& function, SpaceGrid& grid) {
  fill_corners(grid, points_together(device), [&](const Points& points) {
    return measure_implicit(device, function, points).value;
  });
}

// close_grid(), of a box. Returns how many blocks there were at first and after each round;
// `last_wanted` becomes the last round that wanted corners of the box's own, if that is later.
std::vector<std::size_t> close_box(const Contoured& of, const BlockBox& own, SpaceGrid& grid,
                                   int& last_wanted) {
  std::vector<std::size_t> added{grid.blocks.size()};
  std::size_t wanted = wanted_in(grid, own);
  for (bool more = true; more;) {
    ask_corners(of.device, of.function, grid);
    more = want_closed(grid);
    added.push_back(grid.blocks.size());
    const std::size_t now = wanted_in(grid, own);
    if (now > wanted) last_wanted = std::max(last_wanted, static_cast<int>(added.size()) - 1);
    wanted = now;
  }
  return added;
}

}  // namespace

void close_grid(Device& device, const ImplicitFunction& function, SpaceGrid& grid) {
  do {
    ask_corners(device, function, grid);
  } while (want_closed(grid));
}

std::vector<BlockBox> share_cells(const Contoured& of, const BlockBox& own, std::size_t memory) {
  const double block = kBlockSide * of.cell;
  CubeCounts counts;
  counts.blocks = kCubeBlocks;
  CubeCounter counter(kCubeBlocks * block);
  for (std::size_t p = 0; p < of.seeds.size(); ++p)
    counter.add({of.seeds.x[p], of.seeds.y[p], of.seeds.z[p]});
  counts.cubes = counter.cubes();
  Sharing sharing;
  sharing.memory = memory;
  sharing.bytes = kSeedBytes / (of.cell * of.cell);
  sharing.block = block;
  sharing.halo = kRoundsAround * of.cell;
  sharing.thinnest = kThinnestCells * of.cell;
  return share_space(counts, sharing, own);
}

MeshPart mesh_box(const Contoured& of, const BlockBox& own, int around, int& rounds) {
  of.clock.start("corners");
  const double band = band_of(of.cell);
  const SpaceBox near = space_of(own, of.cell, around).wider(band + 2 * kBlockSide * of.cell);
  SpaceGrid grid = grid_around(points_in(near, of.seeds), band, of.cell, corners_of(own, around));
  const std::vector<std::size_t> added = close_box(of, own, grid, rounds);
  forget_outside(grid, corners_of(own, kMeshed));
  const DualMesh mesh = mesh_grid(of.device, of.function, grid, of.clock, corners_of(own));
  return part_of(grid, mesh, added, own);
}

int enough_around(int rounds) { return rounds + 1 + kMeshed; }

}  // namespace meniscus
