#include "io/exr_zip.hpp"

#include <ImfChannelList.h>
#include <ImfIO.h>
#include <libdeflate.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

#include "base/parallel.hpp"
#include "meniscus/error.hpp"

namespace meniscus {
namespace {

static_assert(std::endian::native == std::endian::little, "OpenEXR files are little-endian");
constexpr int kLevel = 4;  // of libdeflate: what zlib's own level 4 packs to, or less

struct FreeCompressor {
  void operator()(libdeflate_compressor* c) const { libdeflate_free_compressor(c); }
};

// Keeps what OpenEXR writes of the header.
class Text : public Imf::OStream {
 public:
  Text() : OStream("header") {}
  void write(const char bytes[], int size) override {
    text.append(bytes, static_cast<std::size_t>(size));
  }
  std::uint64_t tellp() override { return text.size(); }
  void seekp(std::uint64_t) override { throw OutputError("an OpenEXR header goes back"); }
  std::string text;
};

template <class Number>
void append(std::string& bytes, Number number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

// The lines [first, last) as they are in a file that is not packed: line by line, in it channel by
// channel.
void gather_lines(const Imf::Header& header, const Imf::FrameBuffer& frame, int first, int last,
                  std::vector<std::uint8_t>& lines) {
  const auto width = static_cast<std::size_t>(header.dataWindow().max.x + 1);
  lines.clear();
  for (int y = first; y < last; ++y)
    for (auto channel = header.channels().begin(); channel != header.channels().end(); ++channel) {
      const Imf::Slice& slice = frame[channel.name()];
      const std::size_t value = slice.type == Imf::HALF ? 2 : 4;  // bytes
      const char* from = slice.base + static_cast<std::size_t>(y) * slice.yStride;
      const std::size_t at = lines.size();
      lines.resize(at + width * value);
      for (std::size_t x = 0; x < width; ++x, from += slice.xStride)
        std::memcpy(&lines[at + x * value], from, value);
    }
}

// OpenEXR's predictor: bytes of even places, then those of odd ones; then each as its difference
// from the one before.
void predict(const std::vector<std::uint8_t>& lines, std::vector<std::uint8_t>& split,
             std::vector<std::uint8_t>& differences) {
  const std::size_t n = lines.size(), half = n / 2;  // n is even
  split.resize(n);
  differences.resize(n);
  for (std::size_t k = 0; k < half; ++k) {
    split[k] = lines[2 * k];
    split[half + k] = lines[2 * k + 1];
  }
  differences[0] = split[0];
  for (std::size_t k = 1; k < n; ++k)
    differences[k] = static_cast<std::uint8_t>(split[k] - split[k - 1] + 128);
}

// A block as the file has it: packed, or as it is where that is not larger.
std::string pack(const std::vector<std::uint8_t>& lines,
                 const std::vector<std::uint8_t>& differences) {
  const std::unique_ptr<libdeflate_compressor, FreeCompressor> compressor(
      libdeflate_alloc_compressor(kLevel));
  if (!compressor) throw std::bad_alloc();
  std::string packed(lines.size(), '\0');
  const std::size_t size = libdeflate_zlib_compress(
      compressor.get(), differences.data(), differences.size(), packed.data(), packed.size() - 1);
  if (size > 0)
    packed.resize(size);
  else
    std::memcpy(packed.data(), lines.data(), lines.size());
  return packed;
}

}  // namespace

void write_zipped(OutputFile& file, const Imf::Header& header, const Imf::FrameBuffer& frame) {
  const int height = header.dataWindow().max.y + 1;
  const int step = header.compression() == Imf::ZIP_COMPRESSION ? 16 : 1;
  const auto blocks = static_cast<std::size_t>((height + step - 1) / step);
  std::vector<std::string> packed(blocks);
  parallel_for(blocks, 1, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint8_t> lines, split, differences;
    for (std::size_t k = begin; k < end; ++k) {
      const int first = static_cast<int>(k) * step;
      gather_lines(header, frame, first, std::min(height, first + step), lines);
      predict(lines, split, differences);
      packed[k] = pack(lines, differences);
    }
  });

  Text head;
  append(head.text, std::uint32_t{20000630});  // the magic number
  append(head.text, std::uint32_t{2});         // version 2, scan lines of one part
  header.writeTo(head);
  std::string table;
  std::uint64_t at = head.text.size() + blocks * sizeof at;
  for (const std::string& block : packed) {
    append(table, at);
    at += 2 * sizeof(std::int32_t) + block.size();
  }
  file.write(head.text);
  file.write(table);
  for (std::size_t k = 0; k < blocks; ++k) {
    std::string place;
    append(place, static_cast<std::int32_t>(k) * step);
    append(place, static_cast<std::int32_t>(packed[k].size()));
    file.write(place);
    file.write(packed[k]);
  }
}

}  // namespace meniscus
