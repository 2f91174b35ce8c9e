// layer_rows: the two loops over pixels in which layers (layers.hpp) takes its time: drawing the
// faces of a mesh, and writing the layers of rays that cross it once. Pixels beside each other in a
// row are done at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "meniscus/types.hpp"
#include "stages/view.hpp"

namespace meniscus {

/// Numbers that are linear on the screen and belong to a face: its depth is
/// FaceRows::depth + above / below, world units, and the outward normal of an exit, not of unit
/// length, has three of them.
enum FaceNumber : std::size_t { kAbove, kBelow, kNormalX, kNormalY, kNormalZ, kFaceNumbers };
using FaceNumbers = std::array<float, kFaceNumbers>;

/// The rows of a face that lie in a band.
struct FaceRows {
  int column, columns;  // of its pixels: the first one, and how many in each row
  int row, rows;        // the first one, counted in the band, and how many
  /// How far the first pixel lies within each side, by a column, by a row, in whole numbers. Pixels
  /// lie in the face where none of the three is below 0.
  std::array<std::int64_t, 3> within, to_right, down;
  FaceNumbers at, by_column, by_row;  // at the first pixel, and what a column and a row add
  float depth;                        // of one of its corners: little cancels
  float least, most;                  // of all of them: a sliver's quotient may be anything
  float nearest;                      // crossings less than this behind the front count not
  bool enters;                        // rays enter here
};

/// The crossings of the rays of a band. Most rays have one behind the front, and it is an exit: the
/// first exit that is drawn of each pixel has its place, others are listed, those of each pixel as
/// they are drawn.
struct BandCrossings {
  static constexpr std::size_t kSpare = 16;  // values that may be written behind the last one

  std::size_t stride = 0;                    // of rows
  std::vector<float> exit;                   // [rows][stride] depth; kNoSurface: there is none
  std::array<std::vector<float>, 3> normal;  // [rows][stride] there
  std::size_t others = 0;
  std::vector<std::uint32_t> other_pixel;          // row * stride + column, twice; + 1: enters
  std::vector<float> other_depth;                  // [others]
  std::array<std::vector<float>, 3> other_normal;  // [others] of exits

  BandCrossings(int rows, int width);
  void make_room(std::size_t more);  // for so many others
};

/// Adds the crossings of a face behind `front`, [rows][width] the depths that the band's pixels
/// show. There is room for as many others as the face has pixels.
using DrawFace = void(const FaceRows& face, const float* front, int width, BandCrossings& band);

/// Pixels beside each other in a row, at most 32.
struct RowPart {
  int column, row;  // the first one, in the image
  int count;
  std::size_t pixel;    // the first one, in the image
  std::size_t in_band;  // and in its band
};

/// Writes the layers of those pixels whose rays cross the mesh once behind the front, where they
/// leave it, and which have no other crossing (`others`, [rows][stride], is kNoOther): first exit,
/// thickness, count and normal. Other pixels keep the 0 that they have, but get what the band has
/// as exit. Returns which those are, a bit each.
using FillOnce = std::uint32_t(const View& view, const RowPart& part, const BandCrossings& band,
                               const std::uint32_t* others, Layers& layers);
inline constexpr std::uint32_t kNoOther = ~0u;

struct LayerLoops {
  DrawFace* draw;
  FillOnce* fill;
};

/// Those that this processor can run, all with the same result, the fastest first.
std::vector<LayerLoops> layer_loops();

}  // namespace meniscus
