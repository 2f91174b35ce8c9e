// share_space: space as boxes that each take no more memory than there is. What takes memory lies
// in points: where these are is counted in cubes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "stages/closed/block_box.hpp"
#include "stages/vec.hpp"

namespace meniscus {

/// How many points lie in the cubes of space.
struct CubeCounts {
  struct Cube {
    std::array<std::int32_t, 3> at;
    std::int64_t count;
  };
  std::vector<Cube> cubes;
  std::int32_t blocks = 1;  // side of a cube
};

/// The blocks, of this side in particle radii, that make cubes of about 32 radii.
std::int32_t blocks_of_cubes(double block);

/// Counts points in cubes of this side.
class CubeCounter {
 public:
  explicit CubeCounter(double side) : side_(side) {}
  void add(const Vec3d& at);
  std::vector<CubeCounts::Cube> cubes() const;

 private:
  double side_;
  std::unordered_map<std::uint64_t, std::int64_t> counts_;
  std::uint64_t last_ = ~std::uint64_t{0};
  std::int64_t* here_ = nullptr;
};

/// What boxes are to be like; lengths in the unit of `block`.
struct Sharing {
  std::size_t memory = 0;  // that a box takes at most, bytes
  double bytes = 0;        // that a point takes in a box, or around it
  double block = 1;        // side of a block
  double halo = 0;         // how far around a box points count
  double thinnest = 0;     // no box is made thinner
  int least = 1;           // boxes, where that makes none of them thinner
};

/// Cuts a box where about half of its points lie on either side, and so on, until nothing takes
/// more than it may, nothing can be cut or a cut would save less than 15 %.
std::vector<BlockBox> share_space(const CubeCounts& counts, const Sharing& sharing,
                                  const BlockBox& all = {});

}  // namespace meniscus
