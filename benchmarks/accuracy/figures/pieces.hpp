// Pieces of an image: pixels that hang together.
#pragma once

#include <cmath>
#include <vector>

#include "accuracy/figures/statistics.hpp"
#include "accuracy/scene.hpp"

namespace meniscus::accuracy {

struct Pieces {
  std::vector<int> label;  // [pixel] index into `size`
  std::vector<int> size;   // [piece] pixels
  std::vector<bool> at_border;
};

/// `joined(p, q)`: whether the neighbours p and q belong to one piece.
template <class Joined>
Pieces find_pieces(int width, int height, const Joined& joined) {
  const int pixels = width * height;
  Pieces pieces;
  pieces.label.assign(pixels, -1);
  std::vector<int> open;
  for (int seed = 0; seed < pixels; ++seed) {
    if (pieces.label[seed] >= 0) continue;
    const int piece = static_cast<int>(pieces.size.size());
    pieces.size.push_back(0);
    pieces.at_border.push_back(false);
    pieces.label[seed] = piece;
    open.assign(1, seed);
    while (!open.empty()) {
      const int p = open.back(), x = p % width, y = p / width;
      open.pop_back();
      ++pieces.size[piece];
      if (x == 0 || y == 0 || x == width - 1 || y == height - 1) pieces.at_border[piece] = true;
      const auto visit = [&](int q) {
        if (pieces.label[q] >= 0 || !joined(p, q)) return;
        pieces.label[q] = piece;
        open.push_back(q);
      };
      if (x > 0) visit(p - 1);
      if (x < width - 1) visit(p + 1);
      if (y > 0) visit(p - width);
      if (y < height - 1) visit(p + width);
    }
  }
  return pieces;
}

/// Pieces of surface, and of no surface: neighbours hang together unless their depths differ by
/// more than kJump.
template <class Depth>
Pieces find_layers(const Lens& lens, const Depth& depth) {
  return find_pieces(lens.width, lens.height, [&](int p, int q) {
    const bool a = finite(depth[p]), b = finite(depth[q]);
    return a == b && (!a || std::abs(static_cast<double>(depth[p]) - depth[q]) <= kJump);
  });
}

}  // namespace meniscus::accuracy
