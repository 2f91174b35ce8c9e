// Small pictures of a batch's frames.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "io/png.hpp"
#include "program/batch/report.hpp"

namespace meniscus {

/// The picture `width` pixels wide, each pixel the mean light of the area it covers; one that is no
/// wider stays as it is.
RgbImage shrunk(const RgbImage& image, int width);

/// A frame in the contact sheet.
struct Tile {
  std::int64_t frame = 0;
  std::optional<RgbImage> picture;
  std::string why_none;  // in a few words
  std::string details;   // the whole message
};

/// Tiles of at most `most` frames, spread evenly, missing ones among them, with pictures that are
/// at most `width` pixels wide. Never throws for what it finds.
std::vector<Tile> contact_sheet(const BatchReport& report, std::size_t most, int width);

}  // namespace meniscus
