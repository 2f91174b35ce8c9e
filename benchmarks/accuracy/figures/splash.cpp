#include "accuracy/figures/splash.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "accuracy/figures/pieces.hpp"

namespace meniscus::accuracy {
namespace {

constexpr double kBeside = 1;  // s; a piece of the map this near may be one too many

/// What is counted for one piece of splash.
struct Count {
  int pixels = 0, right = 0, holes = 0;
  std::set<int> truth_pieces, map_pieces;  // of surface
  std::set<int> right_pieces;              // of pixels at the right depth
};

/// Labels of the truth's pieces of splash within kBeside of each pixel, the nearest first; -1:
/// none.
std::vector<int> nearest_splash(const Truth& truth) {
  const std::vector<int>& piece = truth.piece;
  const int width = truth.lens.width, height = truth.lens.height;
  std::vector<int> nearest(piece.size(), -1);
  std::vector<double> best(piece.size(), 1e30);
  for (std::size_t p = 0; p < piece.size(); ++p) {
    if (piece[p] < 0) continue;
    const int x = static_cast<int>(p) % width, y = static_cast<int>(p) / width;
    const double reach = kBeside * truth.lens.scale(truth.depth[p]);
    const int steps = static_cast<int>(reach);
    for (int j = std::max(0, y - steps); j <= std::min(height - 1, y + steps); ++j)
      for (int i = std::max(0, x - steps); i <= std::min(width - 1, x + steps); ++i) {
        const double distance = std::hypot(i - x, j - y);
        const std::size_t q = static_cast<std::size_t>(j) * width + i;
        if (distance > reach || distance >= best[q]) continue;
        best[q] = distance;
        nearest[q] = piece[p];
      }
  }
  return nearest;
}

/// Gives each piece of the map to the piece of splash it belongs to.
void count_map_pieces(const Truth& truth, const Map& map, std::map<int, Count>& counts) {
  const std::vector<int>& piece = truth.piece;
  const Pieces ours = find_layers(truth.lens, map.depth);
  const std::vector<int> nearest = nearest_splash(truth);
  struct Overlap {
    std::map<int, int> on, near;  // pixels by piece of splash
    int elsewhere = 0;            // on other surface of the truth
  };
  std::vector<Overlap> overlaps(ours.size.size());
  for (std::size_t p = 0; p < piece.size(); ++p) {
    if (!finite(map.depth[p])) continue;
    Overlap& overlap = overlaps[ours.label[p]];
    const bool on_truth = truth.covered(p) && std::abs(map.depth[p] - truth.depth[p]) <= kJump;
    if (piece[p] >= 0)
      ++overlap.on[piece[p]];
    else if (on_truth)
      ++overlap.elsewhere;
    if (nearest[p] >= 0) ++overlap.near[nearest[p]];
  }
  const auto most = [](const std::map<int, int>& pixels) {
    return std::max_element(pixels.begin(), pixels.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; })
        ->first;
  };
  for (std::size_t k = 0; k < overlaps.size(); ++k) {
    const Overlap& overlap = overlaps[k];
    if (ours.size[k] <= kSpeckPixels || 2 * overlap.elsewhere > ours.size[k]) continue;
    if (overlap.on.empty() && overlap.near.empty()) continue;
    const auto owner = counts.find(most(overlap.on.empty() ? overlap.near : overlap.on));
    if (owner != counts.end()) owner->second.map_pieces.insert(static_cast<int>(k));
  }
}

}  // namespace

Splash splash_figures(const Truth& truth, const Map& map) {
  const std::vector<int>& piece = truth.piece;
  const Lens& lens = truth.lens;
  std::map<int, Count> counts;
  for (const int k : piece)
    if (k >= 0) ++counts[k].pixels;
  std::erase_if(counts, [](const auto& entry) { return entry.second.pixels <= kSpeckPixels; });
  if (counts.empty()) return {};

  std::vector<bool> right(piece.size());
  for (std::size_t p = 0; p < piece.size(); ++p)
    right[p] = piece[p] >= 0 && std::abs(map.depth[p] - truth.depth[p]) <= kJump;
  const auto same_splash = [&](int p, int q) {
    return piece[p] == piece[q] && right[p] == right[q];
  };
  const Pieces parts = find_pieces(lens.width, lens.height, same_splash);
  // Parts of a piece of splash that are wrong and touch nothing but the piece itself are its holes.
  std::vector<bool> enclosed(parts.size.size(), true);
  for (int p = 0; p < static_cast<int>(piece.size()); ++p) {
    const int x = p % lens.width, y = p / lens.width;
    const auto look = [&](int q) {
      if (piece[q] != piece[p]) enclosed[parts.label[p]] = false;
    };
    if (x > 0) look(p - 1);
    if (x < lens.width - 1) look(p + 1);
    if (y > 0) look(p - lens.width);
    if (y < lens.height - 1) look(p + lens.width);
  }
  const Pieces whole =
      find_pieces(lens.width, lens.height, [&](int p, int q) { return piece[p] == piece[q]; });
  std::set<int> holes;
  for (std::size_t p = 0; p < piece.size(); ++p) {
    const auto found = counts.find(piece[p]);
    if (found == counts.end()) continue;
    Count& count = found->second;
    count.right += right[p];
    if (whole.size[whole.label[p]] > kSpeckPixels) count.truth_pieces.insert(whole.label[p]);
    const int part = parts.label[p];
    if (right[p] && parts.size[part] > kSpeckPixels) count.right_pieces.insert(part);
    if (!right[p] && enclosed[part] && holes.insert(part).second) ++count.holes;
  }
  count_map_pieces(truth, map, counts);

  Splash result{0, 0, 0, 0};
  const auto share = 100.0 / static_cast<double>(counts.size());
  for (const auto& [k, count] : counts) {
    if (2 * count.right >= count.pixels) result.covered += share;
    if (count.right == 0) ++result.missing;
    if (count.map_pieces.size() > std::max<std::size_t>(count.truth_pieces.size(), 1))
      ++result.doubled;
    if (count.right > 0 && count.holes == 0 &&
        count.right_pieces.size() <= std::max<std::size_t>(count.truth_pieces.size(), 1))
      result.closed += share;
  }
  return result;
}

}  // namespace meniscus::accuracy
