#include "io/png.hpp"

#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <new>
#include <utility>

#include "base/grouped.hpp"
#include "base/parallel.hpp"
#include "io/input_file.hpp"
#include "io/output_file.hpp"
#include "io/preview.hpp"
#include "io/scalar.hpp"
#include "io/seal.hpp"
#include "io/writers.hpp"
#include "meniscus/camera.hpp"
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
  constexpr png_uint_32 kLargest = kLargestSide;
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

// Pictures are deflated in strips of rows side by side, each with the end of the one before it as
// its dictionary. They are cut by the picture's size alone, so that the number of threads changes
// no byte.
constexpr std::size_t kStrip = 1 << 18;       // bytes
constexpr std::size_t kDictionary = 1 << 15;  // deflate's window, bytes

struct Strip {
  std::vector<std::uint8_t> bytes;  // deflated; all strips one after the other are one stream
  std::size_t size = 0;             // before that
  uLong sum = 0;                    // adler32
};

void append_number(std::vector<std::uint8_t>& bytes, std::uint32_t number) {
  for (const int shift : {24, 16, 8, 0})
    bytes.push_back(static_cast<std::uint8_t>(number >> shift));
}

void append_chunk(std::vector<std::uint8_t>& file, const char* name,
                  const std::vector<std::uint8_t>& data) {
  append_number(file, static_cast<std::uint32_t>(data.size()));
  const std::size_t from = file.size();
  file.insert(file.end(), name, name + 4);
  file.insert(file.end(), data.begin(), data.end());
  append_number(file, static_cast<std::uint32_t>(crc32_z(0, &file[from], file.size() - from)));
}

int paeth(int left, int above, int corner) {
  const int to_left = std::abs(above - corner), to_above = std::abs(left - corner);
  const int to_corner = std::abs(left + above - 2 * corner);
  const int nearest = to_above <= to_corner ? above : corner;
  return to_left <= to_above && to_left <= to_corner ? left : nearest;
}

// PNG's filters 0 to 4 of one row; `above` is the row before it, of zeros where there is none.
void filter_row(int filter, const std::uint8_t* row, const std::uint8_t* above, std::size_t size,
                std::uint8_t* to) {
  constexpr std::size_t kPixel = 3;  // bytes
  const auto run = [&](auto predict) {
    for (std::size_t k = 0; k < std::min(size, kPixel); ++k)
      to[k] = static_cast<std::uint8_t>(row[k] - predict(0, above[k], 0));
    for (std::size_t k = kPixel; k < size; ++k)
      to[k] =
          static_cast<std::uint8_t>(row[k] - predict(row[k - kPixel], above[k], above[k - kPixel]));
  };
  switch (filter) {
    case 0:
      return run([](int, int, int) { return 0; });
    case 1:
      return run([](int left, int, int) { return left; });
    case 2:
      return run([](int, int up, int) { return up; });
    case 3:
      return run([](int left, int up, int) { return (left + up) / 2; });
    default:
      return run(paeth);
  }
}

// How far a filtered row is from zeros: what is near them deflates well.
std::uint64_t distance_from_zero(const std::vector<std::uint8_t>& row) {
  std::uint64_t sum = 0;
  for (const std::uint8_t byte : row)
    sum += static_cast<std::uint64_t>(std::abs(static_cast<std::int8_t>(byte)));
  return sum;
}

// [height] rows: the number of the filter that leaves least, and what it leaves.
std::vector<std::uint8_t> filter_rows(const RgbImage& image) {
  const std::size_t size = 3 * static_cast<std::size_t>(image.width);
  const auto height = static_cast<std::size_t>(image.height);
  std::vector<std::uint8_t> filtered((size + 1) * height);
  parallel_for(height, 8, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint8_t> tried(size), best(size);
    const std::vector<std::uint8_t> nothing(size);
    for (std::size_t row = begin; row < end; ++row) {
      const std::uint8_t* const bytes = &image.bytes[row * size];
      std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
      std::uint8_t& chosen = filtered[row * (size + 1)];
      for (std::uint8_t filter = 0; filter < 5; ++filter) {
        filter_row(filter, bytes, row == 0 ? nothing.data() : bytes - size, size, tried.data());
        const std::uint64_t distance = distance_from_zero(tried);
        if (distance >= least) continue;
        least = distance;
        chosen = filter;
        std::swap(tried, best);
      }
      std::copy(best.begin(), best.end(), &chosen + 1);
    }
  });
  return filtered;
}

Strip deflate_strip(const std::vector<std::uint8_t>& filtered, std::size_t begin, std::size_t end) {
  constexpr int kLevel = 6, kNoHeader = -15, kMemory = 8;
  z_stream stream{};
  if (deflateInit2(&stream, kLevel, Z_DEFLATED, kNoHeader, kMemory, Z_FILTERED) != Z_OK)
    throw std::bad_alloc();
  const std::size_t before = std::min(begin, kDictionary);
  if (before > 0)
    deflateSetDictionary(&stream, &filtered[begin - before], static_cast<uInt>(before));
  Strip strip;
  strip.size = end - begin;
  strip.sum = adler32_z(adler32(0, nullptr, 0), &filtered[begin], strip.size);
  constexpr std::size_t kFlush = 16;  // bytes, what ends a strip
  strip.bytes.resize(deflateBound(&stream, static_cast<uLong>(strip.size)) + kFlush);
  stream.next_in = const_cast<Bytef*>(&filtered[begin]);
  stream.avail_in = static_cast<uInt>(strip.size);
  stream.next_out = strip.bytes.data();
  stream.avail_out = static_cast<uInt>(strip.bytes.size());
  deflate(&stream, end == filtered.size() ? Z_FINISH : Z_SYNC_FLUSH);
  strip.bytes.resize(stream.total_out);
  deflateEnd(&stream);
  return strip;
}

}  // namespace

std::vector<std::uint8_t> encode_png(const RgbImage& image) {
  const auto width = static_cast<std::size_t>(image.width);
  const auto height = static_cast<std::size_t>(image.height);
  const std::vector<std::uint8_t> filtered = filter_rows(image);
  const std::size_t line = 3 * width + 1;
  const std::size_t rows = std::max<std::size_t>(1, kStrip / line);
  std::vector<Strip> strips((height + rows - 1) / rows);
  parallel_for(strips.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      strips[k] = deflate_strip(filtered, k * rows * line,
                                std::min(filtered.size(), (k + 1) * rows * line));
  });

  std::vector<std::uint8_t> encoded = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  std::vector<std::uint8_t> header;
  append_number(header, static_cast<std::uint32_t>(width));
  append_number(header, static_cast<std::uint32_t>(height));
  header.insert(header.end(), {8, 2, 0, 0, 0});  // bits, RGB, deflate, five filters, rows in order
  append_chunk(encoded, "IHDR", header);
  append_chunk(encoded, "sRGB", {0});  // to be shown as it is perceived
  uLong sum = adler32(0, nullptr, 0);
  for (std::size_t k = 0; k < strips.size(); ++k) {
    Strip& strip = strips[k];
    sum = adler32_combine(sum, strip.sum, static_cast<z_off_t>(strip.size));
    if (k == 0) strip.bytes.insert(strip.bytes.begin(), {0x78, 0x9c});  // zlib's header
    if (k + 1 == strips.size()) append_number(strip.bytes, static_cast<std::uint32_t>(sum));
    append_chunk(encoded, "IDAT", strip.bytes);
  }
  append_chunk(encoded, "IEND", {});
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

void write_png(OutputFile& file, const Surface& surface, Preview preview, const std::string& job,
               const std::function<void(double)>& reached) {
  constexpr double kDrawn = 0.85;  // of the time, about
  const auto drawn = [&](double share) { reached(kDrawn * share); };
  const std::vector<std::uint8_t> encoded = encode_png(
      {surface.camera.width, surface.camera.height, draw_preview(surface, preview, drawn)});
  file.write(encoded.data(), kFirstChunkEnd);
  file.write(seal_chunks(job));
  file.write(encoded.data() + kFirstChunkEnd, encoded.size() - kFirstChunkEnd);
  seal(file, OutputFormat::png);
  reached(1);
}

void write_png(const std::string& path, const Surface& surface, Preview preview) {
  OutputFile file(path);
  write_png(file, surface, preview);
  file.commit();
}

}  // namespace meniscus
