// The closed surface of a function that is below 0 inside (section 2.4, 2.5): blocks of cells
// around it, box after box of them, so that no more cells are held at a time than memory has room
// for.
#pragma once

#include <cstddef>
#include <vector>

#include "device/device.hpp"
#include "device/stage_clock.hpp"
#include "stages/closed/block_box.hpp"
#include "stages/closed/implicit.hpp"
#include "stages/closed/mesh_parts.hpp"
#include "stages/closed/space_grid.hpp"

namespace meniscus {

/// Asks the function at corners that are wanted until all cells around its surface are there.
void close_grid(Device& device, const ImplicitFunction& function, SpaceGrid& grid);

/// Corners around a box's own that are evaluated too: a corner is wanted for the sake of one beside
/// it, so what lies farther away than there are rounds changes nothing.
inline constexpr int kRoundsAround = 8;

/// What is meshed.
struct Contoured {
  Device& device;
  const ImplicitFunction& function;
  const Points& seeds;  // particles that see air; where corners are evaluated first
  double cell;          // side of a cell, in the unit of length of these
  StageClock& clock;
};

/// Cuts a box into ones whose cells take no more than so many bytes each, as far as they are not
/// thinner than 64 cells.
std::vector<BlockBox> share_cells(const Contoured& of, const BlockBox& own, std::size_t memory);

/// The mesh of a box's own blocks. Corners are evaluated up to `around` beyond it; `rounds` becomes
/// how many times more of its own corners were wanted, if that is more.
MeshPart mesh_box(const Contoured& of, const BlockBox& own, int around, int& rounds);

/// How far beyond boxes corners are to be evaluated, where more were wanted so many times: then the
/// boxes' meshes are those of the whole surface. One round in which nothing was wanted tells that
/// none will.
int enough_around(int rounds);

}  // namespace meniscus
