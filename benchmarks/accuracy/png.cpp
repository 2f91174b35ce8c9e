#include "accuracy/png.hpp"

#include <png.h>

#include "io/output_file.hpp"
#include "meniscus/error.hpp"

namespace meniscus::accuracy {

Bytes encode_png(int width, int height, const Bytes& index, const std::vector<Rgb>& palette) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGB_COLORMAP;
  image.colormap_entries = static_cast<png_uint_32>(palette.size());
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  Bytes encoded(size);
  if (!png_image_write_to_memory(&image, encoded.data(), &size, 0, index.data(), 0,
                                 palette.data())) {
    const std::string reason = image.message;
    png_image_free(&image);
    throw OutputError("a picture cannot be encoded: libpng: " + reason);
  }
  encoded.resize(size);
  return encoded;
}

void write_file(const std::string& path, const void* data, std::size_t size) {
  OutputFile file(path);
  file.write(data, size);
  file.commit();
}

}  // namespace meniscus::accuracy
