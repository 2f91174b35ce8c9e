#include "accuracy/error_map.hpp"

#include <algorithm>
#include <cmath>

#include "accuracy/figures/flicker.hpp"

namespace meniscus::accuracy {
namespace {

constexpr double kFullColor = 0.2;  // s
constexpr int kSteps = 100;         // of colour, from white to full colour
constexpr Rgb kWhite{255, 255, 255}, kInFront{190, 0, 20}, kBehind{0, 50, 190};

// Palette: in front, white, behind; then these.
constexpr std::uint8_t kRight = kSteps, kBackground = 2 * kSteps + 1;
constexpr std::uint8_t kMissing = kBackground + 1, kExtra = kBackground + 2;

Rgb mix(const Rgb& a, const Rgb& b, double share) {
  Rgb color;
  for (int k = 0; k < 3; ++k)
    color[k] = static_cast<std::uint8_t>(std::lround(a[k] + share * (b[k] - a[k])));
  return color;
}

std::vector<Rgb> make_palette() {
  std::vector<Rgb> palette;
  for (int k = -kSteps; k <= kSteps; ++k)
    palette.push_back(mix(kWhite, k < 0 ? kInFront : kBehind, std::abs(k) / 1. / kSteps));
  palette.push_back({80, 80, 80});
  palette.push_back({0, 150, 60});
  palette.push_back({255, 215, 0});
  return palette;
}

}  // namespace

Bytes error_map(const Truth& truth, const Map& map) {
  const Lens& lens = truth.lens;
  Bytes pixels(truth.depth.size(), kBackground);
  for (std::size_t p = 0; p < pixels.size(); ++p) {
    const bool covered = finite(map.depth[p]);
    if (covered != truth.covered(p)) pixels[p] = covered ? kExtra : kMissing;
    if (!covered || !truth.covered(p)) continue;
    const double error =
        (map.depth[p] - truth.depth[p]) * std::abs(dot(truth.normal[p], lens.direction(p)));
    const double steps = std::clamp(error / kFullColor, -1., 1.) * kSteps;
    pixels[p] = static_cast<std::uint8_t>(kRight + std::lround(steps));
  }
  return encode_png(lens.width, lens.height, pixels, make_palette());
}

Bytes change_map(const Lens& lens, std::span<const Map> maps) {
  Bytes pixels(static_cast<std::size_t>(lens.width) * lens.height, kBackground);
  for (std::size_t p = 0; p < pixels.size(); ++p) {
    double largest = -1;
    for (std::size_t k = 0; k + 2 < maps.size(); ++k)
      if (const auto change =
              second_difference(maps[k].depth[p], maps[k + 1].depth[p], maps[k + 2].depth[p]))
        largest = std::max(largest, std::abs(*change));
    if (largest >= 0)
      pixels[p] = static_cast<std::uint8_t>(
          kRight - std::lround(std::min(largest / kFullColor, 1.) * kSteps));
  }
  return encode_png(lens.width, lens.height, pixels, make_palette());
}

}  // namespace meniscus::accuracy
