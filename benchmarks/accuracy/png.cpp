#include "accuracy/png.hpp"

#include <png.h>

#include "io/output_file.hpp"
#include "meniscus/error.hpp"

namespace meniscus::accuracy {
namespace {

Bytes encode(int width, int height, const Bytes& pixels, const std::vector<Rgb>* palette) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = palette ? PNG_FORMAT_RGB_COLORMAP : PNG_FORMAT_RGB;
  image.colormap_entries = palette ? static_cast<png_uint_32>(palette->size()) : 0;
  const void* const colors = palette ? palette->data() : nullptr;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  Bytes encoded(size);
  if (!png_image_write_to_memory(&image, encoded.data(), &size, 0, pixels.data(), 0, colors)) {
    const std::string reason = image.message;
    png_image_free(&image);
    throw OutputError("a picture cannot be encoded: libpng: " + reason);
  }
  encoded.resize(size);
  return encoded;
}

}  // namespace

Bytes encode_png(int width, int height, const Bytes& rgb) {
  return encode(width, height, rgb, nullptr);
}

Bytes encode_png(int width, int height, const Bytes& index, const std::vector<Rgb>& palette) {
  return encode(width, height, index, &palette);
}

void write_file(const std::string& path, const void* data, std::size_t size) {
  OutputFile file(path);
  file.write(data, size);
  file.commit();
}

std::string base64(const Bytes& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    const std::size_t left = bytes.size() - k;
    const std::uint32_t three =
        bytes[k] << 16 | (left > 1 ? bytes[k + 1] << 8 : 0) | (left > 2 ? bytes[k + 2] : 0);
    text += kDigits[three >> 18];
    text += kDigits[three >> 12 & 63];
    text += left > 1 ? kDigits[three >> 6 & 63] : '=';
    text += left > 2 ? kDigits[three & 63] : '=';
  }
  return text;
}

}  // namespace meniscus::accuracy
