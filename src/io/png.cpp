// Pictures as PNG.
#include <png.h>

#include <cstdint>
#include <vector>

#include "io/output_file.hpp"
#include "io/preview.hpp"
#include "io/writers.hpp"
#include "meniscus/error.hpp"
#include "meniscus/io.hpp"

namespace meniscus {

void write_png(OutputFile& file, const Surface& surface, Preview preview) {
  const std::vector<std::uint8_t> pixels = draw_preview(surface, preview);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(surface.camera.width);
  image.height = static_cast<png_uint_32>(surface.camera.height);
  image.format = PNG_FORMAT_RGB;  // eight bits, sRGB
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::vector<std::uint8_t> encoded(size);
  if (!png_image_write_to_memory(&image, encoded.data(), &size, 0, pixels.data(), 0, nullptr)) {
    const std::string reason = image.message;
    png_image_free(&image);
    throw OutputError(file.path() + ": cannot be written: libpng: " + reason);
  }
  file.write(encoded.data(), size);
}

void write_png(const std::string& path, const Surface& surface, Preview preview) {
  OutputFile file(path);
  write_png(file, surface, preview);
  file.commit();
}

}  // namespace meniscus
