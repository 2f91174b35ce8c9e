#include "io/png.hpp"

#include <png.h>

#include "io/input_file.hpp"
#include "io/output_file.hpp"
#include "io/preview.hpp"
#include "io/seal.hpp"
#include "io/writers.hpp"
#include "meniscus/error.hpp"
#include "meniscus/io.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kFirstChunkEnd = 8 + 25;  // the signature, IHDR

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
  png_image description{};
  description.version = PNG_IMAGE_VERSION;
  const auto refuse = [&] {
    const std::string reason = description.message;
    png_image_free(&description);
    fail(file, "", "is cut off, damaged or no PNG: libpng: " + reason + " (make it again)");
  };
  if (!png_image_begin_read_from_memory(&description, file.bytes.data(), file.size())) refuse();
  description.format = PNG_FORMAT_RGB;
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
