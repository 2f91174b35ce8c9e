// Surface maps as OpenEXR.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfFramesPerSecond.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <half.h>

#include <atomic>
#include <cmath>
#include <cstdint>
#include <map>
#include <string_view>
#include <vector>

#include "base/parallel.hpp"
#include "io/exr_channels.hpp"
#include "io/exr_header.hpp"
#include "io/exr_zip.hpp"
#include "io/output_file.hpp"
#include "io/writers.hpp"
#include "meniscus/error.hpp"
#include "meniscus/io.hpp"

namespace meniscus {
namespace {

constexpr char kComments[] =
    "Surface of particles seen by a camera, sampled at pixel centres.\n"
    "Z: planar distance along the camera axis, world units, positive; +infinity where there is no "
    "surface.\n"
    "A: 1 where there is surface, else 0.\n"
    "N.X N.Y N.Z: outward unit normal, world space; 0 where there is no surface.\n"
    "P.X P.Y P.Z: position, world space, world units; 0 where there is no surface.\n"
    "id: the group of particles that weighs most, counted from 1; 0: none.\n"
    "kind: 0 none, 1 surface, 2 splash.\n"
    "residual: RMS residual of the group's fit, particle radii; 0: none.\n"
    "meniscus.view and meniscus.projection: OpenGL convention, for column vectors, "
    "clip = projection * view * x, rows as in the camera file (not transposed).";

constexpr char kVelocityComments[] =
    "\nV.X V.Y V.Z: velocity, world space, world units per second; 0 where there is no surface.";
constexpr char kAttributeComments[] =
    "\nThe channels that meniscus.attributes names, one a line (after particle. where a map has "
    "its "
    "name): what the particles carry, weighed as velocities are; 0 where there is no surface.";
constexpr char kForwardComments[] =
    "\nforward.u forward.v: how far the surface moves on the screen until the next frame (at "
    "framesPerSecond), pixels to the right and down; 0 where there is no surface.";

constexpr char kLayerComments[] =
    "\nlayers: how many bodies of fluid lie along the ray; 0 where there is no surface.\n"
    "Z.back: where the ray leaves the first one, as Z; +infinity where there is no surface.\n"
    "N.back.X N.back.Y N.back.Z: outward unit normal there, world space; 0 where there is no "
    "surface.\n"
    "thickness: fluid along the ray, of all bodies, world units; 0 where there is no surface.";

constexpr char kWhitewaterComments[] =
    "\nfoam, spray, bubble: particles as discs, foam and spray where they are not behind the "
    "water, "
    "bubbles where they are in it.\n"
    "*.coverage: share of the pixel that is covered, 0 to 1.\n"
    "*.density: sum of the shares that discs cover.\n"
    "*.Z: of the nearest disc, as Z; +infinity where there is none.\n"
    "*.V.X *.V.Y *.V.Z: mean velocity, world space, world units per second; 0 where there is "
    "none.\n"
    "bubble.behind: mean depth behind Z, world units; 0 where there is none.";

Imf::Compression exr_compression(Compression compression) {
  switch (compression) {
    case Compression::none:
      return Imf::NO_COMPRESSION;
    case Compression::rle:
      return Imf::RLE_COMPRESSION;
    case Compression::zips:
      return Imf::ZIPS_COMPRESSION;
    case Compression::zip:
      return Imf::ZIP_COMPRESSION;
    case Compression::piz:
      return Imf::PIZ_COMPRESSION;
    case Compression::pxr24:
      return Imf::PXR24_COMPRESSION;
  }
  throw InvalidArgument("write_exr: unknown compression");
}

Imf::Header make_header(const Surface& surface, const Parameters& parameters,
                        Compression compression, const std::string& job,
                        const Imf::FrameBuffer& frame) {
  std::string comments = kComments, names;
  if (!surface.velocity.empty()) comments += kVelocityComments;
  if (!surface.attributes.empty()) {
    comments += kAttributeComments;
    for (const Attribute& attribute : surface.attributes)
      names += (names.empty() ? "" : "\n") + attribute.name;
  }
  if (surface.layers.most > 0) comments += kLayerComments;
  if (!surface.forward.pixels.empty()) comments += kForwardComments;
  if (!surface.whitewater.empty()) comments += kWhitewaterComments;
  Imf::Header header =
      make_exr_header(surface, parameters, exr_compression(compression), job, comments);
  for (auto channel = frame.begin(); channel != frame.end(); ++channel)
    header.channels().insert(channel.name(), Imf::Channel(channel.slice().type));
  if (!surface.attributes.empty())
    header.insert("meniscus.attributes", Imf::StringAttribute(names));
  if (!surface.forward.pixels.empty())
    Imf::addFramesPerSecond(header, Imf::guessExactFps(surface.forward.frames_per_second));
  return header;
}

void check_maps(const Surface& surface) {
  const Camera& camera = surface.camera;
  require(camera.width > 0 && camera.height > 0, "write_exr: the surface's camera has no pixels");
  const auto pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  require(surface.depth.size() == pixels,
          "write_exr: depth has " + std::to_string(surface.depth.size()) + " pixels, wanted " +
              std::to_string(pixels) + " (extract with Parameters::image set)");
  const auto check_map = [&](const char* name, std::size_t size) {
    require(size == 0 || size == pixels, std::string("write_exr: ") + name + " has " +
                                             std::to_string(size) + " pixels, wanted " +
                                             std::to_string(pixels) + " or none");
  };
  check_map("normal", surface.normal.size());
  check_map("position", surface.position.size());
  check_map("group", surface.group.size());
  check_map("kind", surface.kind.size());
  check_map("residual", surface.residual.size());
  check_map("velocity", surface.velocity.size());
  check_map("forward", surface.forward.pixels.size());
  const Layers& layers = surface.layers;
  require(layers.most >= 0, "write_exr: layers are " + std::to_string(layers.most));
  if (layers.most > 0) {
    check_map("layers", layers.count.size());
    check_map("thickness", layers.thickness.size());
    check_map("N.back", layers.back_normal.size());
    for (const auto* depths : {&layers.entry, &layers.exit})
      require(depths->size() == pixels * static_cast<std::size_t>(layers.most),
              "write_exr: the layers' depths are " + std::to_string(depths->size()) + ", wanted " +
                  std::to_string(pixels) + " times " + std::to_string(layers.most));
  }
  for (const Attribute& attribute : surface.attributes)
    check_map(attribute.name.c_str(), attribute.values.size());
  for (const WhitewaterMaps& maps : surface.whitewater)
    for (const std::size_t size : {maps.coverage.size(), maps.density.size(), maps.depth.size(),
                                   maps.velocity.size(), maps.behind.size()})
      check_map(to_string(maps.type).c_str(), size);
}

// The channels of 16 bits, by their names. A map of which a value does not fit has none.
std::map<std::string_view, std::vector<half>> narrow_channels(const Surface& surface,
                                                              std::vector<std::uint32_t>& kind) {
  const auto map_of = [](std::string_view name) { return name.substr(0, name.find('.')); };
  const auto width = static_cast<std::size_t>(surface.camera.width);
  const auto height = static_cast<std::size_t>(surface.camera.height);
  std::map<std::string_view, std::vector<half>> channels;
  std::map<std::string_view, bool> fits;  // by the name of the map
  const auto is_narrow = [&](std::string_view name) {
    for (const char* map : {"N", "residual", "V", "forward"})
      if (map_of(name) == map) return true;
    return false;
  };
  const auto narrow = [&](std::string_view name, Imf::PixelType type, const void* at,
                          std::size_t stride) {
    if (type != Imf::FLOAT || !is_narrow(name)) return;
    const char* first = static_cast<const char*>(at);
    std::vector<half>& values = channels[name];
    values.resize(width * height);
    std::atomic<bool> all_fit{true};
    parallel_for(height, 1, [&](std::size_t begin, std::size_t end) {
      bool fit = true;
      for (std::size_t k = begin * width; k < end * width; ++k) {
        const float value = *reinterpret_cast<const float*>(first + k * stride);
        fit &= std::abs(value) <= HALF_MAX;
        values[k] = value;
      }
      if (!fit) all_fit = false;
    });
    fits.try_emplace(map_of(name), true).first->second &= all_fit;
  };
  for_each_channel(surface, kind, narrow);
  std::erase_if(channels, [&](const auto& channel) { return !fits[map_of(channel.first)]; });
  return channels;
}

}  // namespace

void write_exr(OutputFile& file, const Surface& surface, const Parameters& parameters,
               Compression compression, bool half, const std::string& job) {
  check_maps(surface);
  std::vector<float> alpha(surface.depth.size());
  for (std::size_t k = 0; k < alpha.size(); ++k)
    alpha[k] = std::isfinite(surface.depth[k]) ? 1.0f : 0.0f;
  std::vector<std::uint32_t> kind(surface.kind.size());
  for (std::size_t k = 0; k < kind.size(); ++k)
    kind[k] = static_cast<std::uint32_t>(surface.kind[k]);

  Imf::FrameBuffer frame;
  const auto slice = [&](const char* name, Imf::PixelType type, const void* first,
                         std::size_t stride) {
    frame.insert(name, Imf::Slice(type, const_cast<char*>(static_cast<const char*>(first)), stride,
                                  stride * static_cast<std::size_t>(surface.camera.width)));
  };
  slice("A", Imf::FLOAT, alpha.data(), sizeof(float));
  for_each_channel(surface, kind, slice);
  std::map<std::string_view, std::vector<::half>> narrow;
  if (half) narrow = narrow_channels(surface, kind);
  for (const auto& [name, values] : narrow)
    slice(std::string(name).c_str(), Imf::HALF, values.data(), sizeof values[0]);

  write_with_openexr(file, [&] {
    const Imf::Header header = make_header(surface, parameters, compression, job, frame);
    if (compression == Compression::zip || compression == Compression::zips)
      return write_zipped(file, header, frame);
    ExrStream stream(file);
    Imf::OutputFile image(stream, header);
    image.setFrameBuffer(frame);
    image.writePixels(surface.camera.height);
  });
}

void write_exr(const std::string& path, const Surface& surface, const Parameters& parameters,
               Compression compression, bool half) {
  OutputFile file(path);
  write_exr(file, surface, parameters, compression, half);
  file.commit();
}

}  // namespace meniscus
