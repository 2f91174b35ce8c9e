#include "io/png.hpp"

#include <png.h>

#include <algorithm>

#include "base/grouped.hpp"
#include "io/input_file.hpp"
#include "io/output_file.hpp"
#include "io/preview.hpp"
#include "io/scalar.hpp"
#include "io/seal.hpp"
#include "io/writers.hpp"
#include "meniscus/error.hpp"
#include "meniscus/io.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kFirstChunkEnd = 8 + 25;  // the signature, IHDR
constexpr std::size_t kDepthAt = 24;            // of a sample, bits, one byte in IHDR
constexpr std::size_t kMostRatio = 1032;        // of deflate: what one byte can stand for

// Whether a file can hold its picture, before there is room for it: eight bits a channel, RGB as
// write_png makes it. Fewer bits or channels would grow further in memory.
bool can_hold(const InputFile& file, const png_image& image) {
  constexpr png_uint_32 kLargest = 16384;  // each side, as of a camera
  return image.width <= kLargest && image.height <= kLargest && image.format == PNG_FORMAT_RGB &&
         file.bytes[kDepthAt] == 8 && PNG_IMAGE_SIZE(image) / kMostRatio <= file.size();
}

// Whether every chunk ends within the file: libpng makes room for one before it reads it.
bool chunks_fit(const InputFile& file) {
  constexpr std::size_t kAround = 12;  // bytes: its length, its name and its checksum
  for (std::size_t at = 8; at < file.size();) {
    if (file.size() - at < kAround) return false;
    const std::size_t length = load<std::uint32_t>(&file.bytes[at], std::endian::big);
    if (length > file.size() - at - kAround) return false;
    at += kAround + length;
  }
  return true;
}

}  // namespace

std::vector<std::uint8_t> encode_png(const RgbImage& image) {
  png_image description{};
  description.version = PNG_IMAGE_VERSION;
  description.width = static_cast<png_uint_32>(image.width);
  description.height = static_cast<png_uint_32>(image.height);
  description.format = PNG_FORMAT_RGB;  // eight bits, sRGB
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(description);
  std::vector<std::uint8_t> encoded(size);
  if (!png_image_write_to_memory(&description, encoded.data(), &size, 0, image.bytes.data(), 0,
                                 nullptr)) {
    const std::string reason = description.message;
    png_image_free(&description);
    throw OutputError("libpng: " + reason);
  }
  encoded.resize(size);
  return encoded;
}

RgbImage read_png(const std::string& path) {
  const InputFile file = read_file(path);
  if (png_sig_cmp(reinterpret_cast<png_const_bytep>(file.bytes.data()), 0,
                  std::min<std::size_t>(file.size(), 8)) == 0 &&
      !chunks_fit(file))
    fail(file, "", "is cut off or damaged: a part of it is longer than the file (make it again)");
  png_image description{};
  description.version = PNG_IMAGE_VERSION;
  const auto refuse = [&] {
    const std::string reason = description.message;
    png_image_free(&description);
    fail(file, "", "is cut off, damaged or no PNG: libpng: " + reason + " (make it again)");
  };
  if (!png_image_begin_read_from_memory(&description, file.bytes.data(), file.size())) refuse();
  if (!can_hold(file, description)) {
    png_image_free(&description);
    fail(file, "",
         "its " + counted(file.size(), "byte") + " are no picture of " +
             std::to_string(description.width) + "x" + std::to_string(description.height) +
             " pixels by Meniscus, 8-bit RGB (make it again)");
  }
  RgbImage image{static_cast<int>(description.width), static_cast<int>(description.height), {}};
  image.bytes.resize(PNG_IMAGE_SIZE(description));
  const png_color black{0, 0, 0};
  if (!png_image_finish_read(&description, &black, image.bytes.data(), 0, nullptr)) refuse();
  return image;
}

void write_png(OutputFile& file, const Surface& surface, Preview preview, const std::string& job) {
  std::vector<std::uint8_t> encoded;
  try {
    encoded =
        encode_png({surface.camera.width, surface.camera.height, draw_preview(surface, preview)});
  } catch (const OutputError& error) {
    throw OutputError(file.path() + ": cannot be written: " + error.what());
  }
  file.write(encoded.data(), kFirstChunkEnd);
  file.write(seal_chunks(job));
  file.write(encoded.data() + kFirstChunkEnd, encoded.size() - kFirstChunkEnd);
  seal(file, OutputFormat::png);
}

void write_png(const std::string& path, const Surface& surface, Preview preview) {
  OutputFile file(path);
  write_png(file, surface, preview);
  file.commit();
}

}  // namespace meniscus
