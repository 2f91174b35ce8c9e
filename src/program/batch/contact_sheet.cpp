#include "program/batch/contact_sheet.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/parallel.hpp"
#include "io/input_file.hpp"
#include "io/preview.hpp"
#include "meniscus/error.hpp"
#include "meniscus/io.hpp"
#include "program/wording.hpp"

namespace meniscus {
namespace {

float linear(std::uint8_t srgb) {
  const double s = srgb / 255.0;
  return static_cast<float>(s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4));
}

std::uint8_t srgb(double linear) {
  const double s = linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::clamp(s, 0.0, 1.0) * 255 + 0.5);
}

// The output of `record` with this ending, no deep image; empty: there is none.
std::string output_with(const FrameRecord& record, const char* ending) {
  for (const std::string& path : record.outputs)
    if (const std::string name = lower_case(path);
        name.ends_with(ending) && !name.ends_with(".deep.exr"))
      return path;
  return "";
}

void fill(Tile& tile, const FrameRecord& record, int width) {
  if (record.status == FrameStatus::failed) {
    tile.why_none = "failed";
    tile.details = record.error;
    return;
  }
  const std::string png = output_with(record, ".png"), exr = output_with(record, ".exr");
  try {
    if (!png.empty()) {
      tile.picture = shrunk(read_png(png), width);
    } else if (!exr.empty()) {
      const Surface surface = read_exr(exr);
      if (surface.normal.empty()) {
        tile.why_none = "no picture";
        tile.details = exr + " has no normals to draw it with (give --aov N, or a PNG among -o)";
        return;
      }
      tile.picture =
          shrunk({surface.camera.width, surface.camera.height, draw_preview(surface, Preview::lit)},
                 width);
    } else {
      tile.why_none = "no picture";
      tile.details = "the frame has neither a PNG nor an EXR";
    }
  } catch (const std::exception& error) {
    tile.why_none = "cannot be read";
    tile.details = words_of(error);
  }
}

}  // namespace

RgbImage shrunk(const RgbImage& image, int width) {
  if (image.width <= width) return image;
  std::array<float, 256> light{};
  for (int k = 0; k < 256; ++k)
    light[static_cast<std::size_t>(k)] = linear(static_cast<std::uint8_t>(k));
  const double scale = static_cast<double>(image.width) / width;
  RgbImage small{width, std::max(1, static_cast<int>(std::lround(image.height / scale))), {}};
  const double scale_y = static_cast<double>(image.height) / small.height;
  small.bytes.reserve(3 * static_cast<std::size_t>(small.width) *
                      static_cast<std::size_t>(small.height));
  for (int row = 0; row < small.height; ++row)
    for (int column = 0; column < small.width; ++column) {
      const double x0 = column * scale, x1 = x0 + scale, y0 = row * scale_y, y1 = y0 + scale_y;
      double sum[3] = {0, 0, 0};
      for (int y = static_cast<int>(y0); y < image.height && y < y1; ++y) {
        const double tall = std::min(y1, y + 1.0) - std::max(y0, static_cast<double>(y));
        for (int x = static_cast<int>(x0); x < image.width && x < x1; ++x) {
          const double area = tall * (std::min(x1, x + 1.0) - std::max(x0, static_cast<double>(x)));
          const std::size_t k =
              3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                   static_cast<std::size_t>(x));
          for (std::size_t c = 0; c < 3; ++c) sum[c] += area * light[image.bytes[k + c]];
        }
      }
      for (const double s : sum) small.bytes.push_back(srgb(s / (scale * scale_y)));
    }
  return small;
}

std::vector<Tile> contact_sheet(const BatchReport& report, std::size_t most, int width) {
  struct Entry {
    std::int64_t frame;
    const FrameRecord* record;  // null: missing
  };
  std::vector<Entry> all;
  for (const FrameHistory& f : report.frames) all.push_back({f.last.frame, &f.last});
  for (const std::int64_t frame : report.missing) all.push_back({frame, nullptr});
  std::sort(all.begin(), all.end(),
            [](const Entry& a, const Entry& b) { return a.frame < b.frame; });

  const std::size_t count = std::min(all.size(), most);
  std::vector<Tile> tiles(count);
  parallel_for(count, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      // The first and the last one, and those evenly between.
      const Entry& entry =
          all[count > 1 ? (k * (all.size() - 1) + (count - 1) / 2) / (count - 1) : 0];
      tiles[k].frame = entry.frame;
      if (entry.record == nullptr)
        tiles[k].why_none = "missing";
      else
        fill(tiles[k], *entry.record, width);
    }
  });
  return tiles;
}

}  // namespace meniscus
