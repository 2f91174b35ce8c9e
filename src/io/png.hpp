// Pictures of eight bits a channel as PNG.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace meniscus {

struct RgbImage {
  int width = 0, height = 0;        // pixels
  std::vector<std::uint8_t> bytes;  // [height][width][3] sRGB, row 0 on top
};

/// The bytes of a PNG file. Throws OutputError with the reason alone.
std::vector<std::uint8_t> encode_png(const RgbImage& image);

/// Reads a whole PNG file; a transparent one lies on black. Throws InputError when it is missing,
/// damaged or no PNG.
RgbImage read_png(const std::string& path);

}  // namespace meniscus
