#include "accuracy/error_map.hpp"

#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "meniscus/error.hpp"

namespace meniscus::accuracy {
namespace {

using Rgb = std::array<std::uint8_t, 3>;
constexpr double kFullColor = 0.2;  // s
constexpr Rgb kBackground{80, 80, 80}, kMissing{0, 150, 60}, kExtra{255, 215, 0};
constexpr Rgb kWhite{255, 255, 255}, kInFront{190, 0, 20}, kBehind{0, 50, 190};

Rgb mix(const Rgb& a, const Rgb& b, double share) {
  Rgb color;
  for (int k = 0; k < 3; ++k)
    color[k] = static_cast<std::uint8_t>(std::lround(a[k] + share * (b[k] - a[k])));
  return color;
}

}  // namespace

void write_error_map(const std::string& path, const Truth& truth, const Map& map) {
  const Lens& lens = truth.lens;
  std::vector<Rgb> pixels(truth.depth.size(), kBackground);
  for (std::size_t p = 0; p < pixels.size(); ++p) {
    const bool covered = std::isfinite(map.depth[p]);
    if (covered != truth.covered(p)) pixels[p] = covered ? kExtra : kMissing;
    if (!covered || !truth.covered(p)) continue;
    const int i = static_cast<int>(p) % lens.width, j = static_cast<int>(p) / lens.width;
    const double error =
        (map.depth[p] - truth.depth[p]) * std::abs(dot(truth.normal[p], lens.direction(i, j)));
    pixels[p] =
        mix(kWhite, error < 0 ? kInFront : kBehind, std::min(std::abs(error) / kFullColor, 1.0));
  }
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(lens.width);
  image.height = static_cast<png_uint_32>(lens.height);
  image.format = PNG_FORMAT_RGB;
  if (!png_image_write_to_file(&image, path.c_str(), 0, pixels.data(), 0, nullptr))
    throw OutputError(path + ": cannot be written: " + image.message);
}

}  // namespace meniscus::accuracy
