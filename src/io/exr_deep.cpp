// Layers as a deep image of OpenEXR.
#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineOutputFile.h>
#include <ImfPartType.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "io/exr_header.hpp"
#include "io/writers.hpp"
#include "meniscus/error.hpp"

namespace meniscus {
namespace {

constexpr char kDeepComments[] =
    "Bodies of fluid along the rays through pixel centres, a sample each, nearest first.\n"
    "Z, ZBack: where the ray enters and leaves it, planar distance along the camera axis, world "
    "units; of the first one Z is the depth of the surface.\n"
    "A: 1.\n"
    "meniscus.view and meniscus.projection: OpenGL convention, for column vectors, "
    "clip = projection * view * x, rows as in the camera file (not transposed).";

void check_layers(const Surface& surface) {
  const Layers& layers = surface.layers;
  const Camera& camera = surface.camera;
  require(layers.most > 0,
          "write_deep_exr: the surface has no layers (set layers when you extract it)");
  require(camera.width > 0 && camera.height > 0,
          "write_deep_exr: the surface's camera has no pixels");
  const auto pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  const auto check_size = [&](const char* name, std::size_t size, std::size_t wanted) {
    require(size == wanted, std::string("write_deep_exr: the layers' ") + name + " are " +
                                std::to_string(size) + ", wanted " + std::to_string(wanted));
  };
  check_size("counts", layers.count.size(), pixels);
  check_size("entries", layers.entry.size(), pixels * static_cast<std::size_t>(layers.most));
  check_size("exits", layers.exit.size(), pixels * static_cast<std::size_t>(layers.most));
}

// Writes all lines. OpenEXR takes a pointer to the first sample of each pixel, and the distance to
// the next: here a whole map.
void write_lines(Imf::DeepScanLineOutputFile& image, const Surface& surface) {
  const Layers& layers = surface.layers;
  const auto width = static_cast<std::size_t>(surface.camera.width),
             height = static_cast<std::size_t>(surface.camera.height);
  constexpr std::size_t kLines = 64;  // at a time
  static const float one = 1;
  std::vector<std::uint32_t> counts(kLines * width);
  std::vector<const float*> alpha(kLines * width, &one), entries(alpha.size()), exits(alpha.size());
  for (std::size_t first = 0; first < height; first += kLines) {
    const std::size_t lines = std::min(kLines, height - first);
    for (std::size_t k = 0; k < lines * width; ++k) {
      const std::size_t pixel = first * width + k;
      counts[k] = std::min(layers.count[pixel], static_cast<std::uint32_t>(layers.most));
      entries[k] = &layers.entry[pixel];
      exits[k] = &layers.exit[pixel];
    }
    // Where line 0 would begin.
    const auto origin = [&](const auto& values) {
      return reinterpret_cast<char*>(reinterpret_cast<std::uintptr_t>(values.data()) -
                                     first * width * sizeof values[0]);
    };
    const std::size_t to_next = width * height * sizeof(float);
    Imf::DeepFrameBuffer frame;
    frame.insertSampleCountSlice(
        Imf::Slice(Imf::UINT, origin(counts), sizeof counts[0], sizeof counts[0] * width));
    const auto insert = [&](const char* name, const std::vector<const float*>& values,
                            std::size_t sample_stride) {
      frame.insert(name, Imf::DeepSlice(Imf::FLOAT, origin(values), sizeof values[0],
                                        sizeof values[0] * width, sample_stride));
    };
    insert("A", alpha, 0);
    insert("Z", entries, to_next);
    insert("ZBack", exits, to_next);
    image.setFrameBuffer(frame);
    image.writePixels(static_cast<int>(lines));
  }
}

}  // namespace

void write_deep_exr(OutputFile& file, const Surface& surface, const Parameters& parameters,
                    const std::string& job) {
  check_layers(surface);
  write_with_openexr(file, [&] {
    Imf::Header header =
        make_exr_header(surface, parameters, Imf::ZIPS_COMPRESSION, job, kDeepComments);
    header.setType(Imf::DEEPSCANLINE);
    for (const char* name : {"A", "Z", "ZBack"})
      header.channels().insert(name, Imf::Channel(Imf::FLOAT));
    ExrStream stream(file);
    Imf::DeepScanLineOutputFile image(stream, header);
    write_lines(image, surface);
  });
}

void write_deep_exr(const std::string& path, const Surface& surface, const Parameters& parameters) {
  OutputFile file(path);
  write_deep_exr(file, surface, parameters);
  file.commit();
}

}  // namespace meniscus
