// Pictures of few colours in memory as PNG.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace meniscus::accuracy {

using Bytes = std::vector<std::uint8_t>;
using Rgb = std::array<std::uint8_t, 3>;

/// [height][width] indices into a palette of at most 256 colours: a third of the size.
Bytes encode_png(int width, int height, const Bytes& index, const std::vector<Rgb>& palette);

/// Throws OutputError.
void write_file(const std::string& path, const void* data, std::size_t size);

}  // namespace meniscus::accuracy
