// Surface maps back from OpenEXR.
#include <ImfChannelList.h>
#include <ImfDoubleAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfMatrixAttribute.h>
#include <ImfRationalAttribute.h>
#include <ImfStringAttribute.h>
#include <ImfVersion.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <sstream>
#include <string_view>
#include <vector>

#include "base/grouped.hpp"
#include "io/exr_channels.hpp"
#include "io/input_file.hpp"
#include "io/scalar.hpp"
#include "meniscus/camera.hpp"
#include "meniscus/io.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kHeaderAt = 8;  // behind the magic number, the version and its flags

// Lets OpenEXR read a file in memory.
class Stream : public Imf::IStream {
 public:
  explicit Stream(const InputFile& file) : IStream(file.name.c_str()), bytes_(file.bytes) {}
  bool read(char bytes[], int size) override {
    const auto wanted = static_cast<std::size_t>(size);
    if (wanted > bytes_.size() - at_)
      throw InputError("the file ends at byte " + std::to_string(bytes_.size()));
    std::memcpy(bytes, bytes_.data() + at_, wanted);
    at_ += wanted;
    return at_ < bytes_.size();
  }
  std::uint64_t tellg() override { return at_; }
  void seekg(std::uint64_t position) override {
    at_ = static_cast<std::size_t>(std::min<std::uint64_t>(position, bytes_.size()));
  }

 private:
  const std::string& bytes_;
  std::size_t at_ = 0;
};

// How many bytes OpenEXR reads of an attribute of a type, whatever the size that the file states;
// 0: as many as stated. None of the others that it knows is written by write_exr.
std::optional<std::size_t> bytes_read(std::string_view type) {
  static const std::pair<std::string_view, std::size_t> kSizes[] = {
      {"box2f", 16},      {"box2i", 16},   {"chlist", 0},   {"chromaticities", 32},
      {"compression", 1}, {"double", 8},   {"envmap", 1},   {"float", 4},
      {"int", 4},         {"keycode", 28}, {"m33d", 72},    {"m33f", 36},
      {"m44d", 128},      {"m44f", 64},    {"rational", 8}, {"lineOrder", 1},
      {"string", 0},      {"timecode", 8}, {"v2d", 16},     {"v2f", 8},
      {"v2i", 8},         {"v3d", 24},     {"v3f", 12},     {"v3i", 12}};
  for (const auto& [known, size] : kSizes)
    if (type == known) return size;
  return std::nullopt;
}

// The size of every attribute against its type and what is left of the file: OpenEXR makes room for
// it before it reads. Other kinds of files than that of write_exr, such as tiles, are not looked
// into.
void check_attributes(const InputFile& file) {
  const std::string_view bytes = file.bytes;
  const auto whole_number = [&](std::size_t at) {
    return load<std::int32_t>(&bytes[at], std::endian::little);
  };
  if (bytes.size() < kHeaderAt || !Imf::isImfMagic(bytes.data()) ||
      (whole_number(4) & ~Imf::LONG_NAMES_FLAG) != Imf::EXR_VERSION)
    fail(file, "", "is cut off, damaged or no EXR: wanted scan lines");
  const auto behind_text = [&](std::size_t at) {
    const std::size_t end = bytes.find('\0', at);
    return end == std::string_view::npos ? bytes.size() : end + 1;
  };
  for (std::size_t at = kHeaderAt; at < bytes.size() && bytes[at] != '\0';) {
    const std::size_t type_at = behind_text(at), size_at = behind_text(type_at);
    const std::string_view type = bytes.substr(type_at, size_at - type_at - 1);
    const std::size_t left = bytes.size() - std::min(bytes.size(), size_at + sizeof(std::int32_t));
    const std::int32_t size = left > 0 ? whole_number(size_at) : 0;
    if (size < 0 || static_cast<std::size_t>(size) >= std::max<std::size_t>(left, 1))
      fail(file, byte_place(at),
           "is cut off or damaged: the file ends in an attribute of its header");
    const std::optional<std::size_t> wanted = bytes_read(type);
    std::size_t read = wanted.value_or(0);
    if (type == "chlist")  // up to an empty name, 16 bytes behind each
      for (read = size_at + sizeof(std::int32_t); read < bytes.size() && bytes[read] != '\0';)
        read = behind_text(read) + 16;
    if (type == "chlist") read -= size_at + sizeof(std::int32_t) - 1;
    if (!wanted || (read > 0 && read != static_cast<std::size_t>(size)))
      fail(file, byte_place(at),
           "is damaged, or no EXR of Meniscus: an attribute of its header has type " +
               in_quotes(type) + " and " + std::to_string(size) + " bytes");
    at = size_at + sizeof(std::int32_t) + static_cast<std::size_t>(size);
  }
}

template <class Attribute>
const Attribute& attribute(const InputFile& file, const Imf::Header& header, const char* name) {
  const auto* found = header.findTypedAttribute<Attribute>(name);
  if (found == nullptr)
    fail(file, "", std::string("has no attribute ") + name + ", wanted an EXR of Meniscus");
  return *found;
}

std::array<double, 16> matrix(const InputFile& file, const Imf::Header& header, const char* name) {
  const auto& m = attribute<Imf::M44dAttribute>(file, header, name).value();
  std::array<double, 16> result{};
  for (int k = 0; k < 16; ++k) result[k] = m[k / 4][k % 4];
  return result;
}

Camera camera_of(const InputFile& file, const Imf::Header& header) {
  const Imath::Box2i window = header.dataWindow();
  if (window.min != Imath::V2i(0, 0) || window != header.displayWindow())
    fail(file, "", "its pixels do not fill its window from (0, 0) on, wanted an EXR of Meniscus");
  const auto pixels = [](int last) { return static_cast<int>(std::min(last, 1 << 30)) + 1; };
  Camera camera{pixels(window.max.x), pixels(window.max.y), matrix(file, header, "meniscus.view"),
                matrix(file, header, "meniscus.projection")};
  try {
    check(camera);
  } catch (const InvalidArgument& error) {
    fail(file, "", error.what());
  }
  return camera;
}

// Whether the file can hold the pixels that its header states, before there is room for them.
void check_room(const InputFile& file, const Imf::Header& header, const Camera& camera) {
  // What a byte can stand for: 1,032 in deflate, and PXR24 leaves out every fourth before it.
  constexpr std::uint64_t kMostRatio = 1376;
  std::uint64_t pixel = 0;  // bytes
  for (auto c = header.channels().begin(); c != header.channels().end(); ++c)
    pixel += c.channel().type == Imf::HALF ? 2 : 4;
  const std::uint64_t pixels =
      static_cast<std::uint64_t>(camera.width) * static_cast<std::uint64_t>(camera.height);
  if (pixels * pixel / kMostRatio > file.size())
    fail(file, "",
         "its " + counted(file.size(), "byte") + " cannot hold the " +
             std::to_string(camera.width) + "x" + std::to_string(camera.height) +
             " pixels of its header (make the file again)");
}

// Reads all rows into `frame`; the error names the first one that cannot be read.
void read_rows(const InputFile& file, Imf::InputFile& image, const Imf::FrameBuffer& frame,
               int height) {
  image.setFrameBuffer(frame);
  try {
    return image.readPixels(0, height - 1);
  } catch (const std::exception&) {
  }
  Stream stream(file);  // after an error OpenEXR repeats it for every row
  Imf::InputFile again(stream);
  again.setFrameBuffer(frame);
  for (int row = 0; row < height; ++row) try {
      again.readPixels(row);
    } catch (const std::exception& error) {
      fail(file, "row " + std::to_string(row),
           std::string("cannot be read: ") + error.what() + " (make the file again)");
    }
}

// What OpenEXR says is wrong with the file, as our error.
template <class Work>
auto by_openexr(const InputFile& file, const Work& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::exception& error) {
    fail(file, "", std::string("is cut off, damaged or no EXR: ") + error.what());
  }
}

Imf::Header header_of(const InputFile& file) {
  return by_openexr(file, [&] {
    Stream head(file);
    head.seekg(kHeaderAt);
    int version = Imf::EXR_VERSION;
    Imf::Header header;
    header.readFrom(head, version);
    return header;
  });
}

bool has_channel(const Imf::Header& header, const std::string& name) {
  return header.channels().findChannel(name) != nullptr;
}

// Makes room for the maps that the file has: not all need have been asked for.
void make_maps(const Imf::Header& header, std::size_t pixels, Surface& surface,
               std::vector<std::uint32_t>& kind) {
  const auto make_if = [&](const std::string& channel, auto& map) {
    if (has_channel(header, channel)) map.resize(pixels);
  };
  surface.depth.resize(pixels);
  make_if("N.X", surface.normal);
  make_if("P.X", surface.position);
  make_if("id", surface.group);
  make_if("kind", kind);
  make_if("kind", surface.kind);
  make_if("residual", surface.residual);
  make_if("V.X", surface.velocity);
  make_if("forward.u", surface.forward.pixels);
  if (has_channel(header, "Z.back")) {
    Layers& layers = surface.layers;
    layers.most = 1;
    layers.count.resize(pixels);
    layers.thickness.resize(pixels);
    layers.exit.resize(pixels);
    layers.back_normal.resize(pixels);
  }
  for (const WhitewaterType type : kWhitewaterTypes) {
    const std::string name = to_string(type);
    if (!has_channel(header, name + ".coverage")) continue;
    WhitewaterMaps& maps = surface.whitewater.emplace_back(WhitewaterMaps{.type = type});
    for (std::vector<float>* map : {&maps.coverage, &maps.density, &maps.depth})
      map->resize(pixels);
    make_if(name + ".V.X", maps.velocity);
    make_if(name + ".behind", maps.behind);
  }
  if (const auto* names = header.findTypedAttribute<Imf::StringAttribute>("meniscus.attributes")) {
    std::istringstream lines(names->value());
    for (std::string name; std::getline(lines, name);)
      if (has_channel(header, channel_of(name)))
        surface.attributes.push_back({name, std::vector<float>(pixels)});
  }
}

// Where OpenEXR is to put the pixels of all maps.
Imf::FrameBuffer frame_of(const InputFile& file, const Imf::Header& header, Surface& surface,
                          std::vector<std::uint32_t>& kind) {
  Imf::FrameBuffer frame;
  const auto width = static_cast<std::size_t>(surface.camera.width);
  const auto slice = [&](const char* name, Imf::PixelType type, auto* first, std::size_t stride) {
    const Imf::Channel* channel = header.channels().findChannel(name);
    const bool half = channel != nullptr && type == Imf::FLOAT && channel->type == Imf::HALF;
    if (channel == nullptr || (channel->type != type && !half) || channel->xSampling != 1 ||
        channel->ySampling != 1)
      fail(file, "",
           std::string("has no channel ") + name + " with " +
               (type == Imf::FLOAT ? "floats" : "whole numbers") +
               " in all pixels, wanted an EXR of Meniscus");
    frame.insert(name, Imf::Slice(type, reinterpret_cast<char*>(first), stride, stride * width));
  };
  for_each_channel(surface, kind, slice);
  return frame;
}

void take_kinds(const InputFile& file, const std::vector<std::uint32_t>& kind, Surface& surface) {
  const auto width = static_cast<std::size_t>(surface.camera.width);
  for (std::size_t k = 0; k < kind.size(); ++k) {
    if (kind[k] > static_cast<std::uint32_t>(Kind::splash))
      fail(file, "row " + std::to_string(k / width) + ", column " + std::to_string(k % width),
           "kind is " + std::to_string(kind[k]) + ", wanted 0, 1 or 2");
    surface.kind[k] = static_cast<Kind>(kind[k]);
  }
}

std::map<std::string, std::string> texts_of(const Imf::Header& header) {
  std::map<std::string, std::string> texts;
  for (auto a = header.begin(); a != header.end(); ++a)
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&a.attribute()))
      texts.emplace(a.name(), text->value());
  return texts;
}

}  // namespace

Surface read_exr(const std::string& path, std::map<std::string, std::string>* attributes) {
  const InputFile file = read_file(path);
  check_attributes(file);
  const Imf::Header header = header_of(file);
  Surface surface;
  surface.camera = camera_of(file, header);
  check_room(file, header, surface.camera);
  Stream stream(file);
  std::optional<Imf::InputFile> image;
  by_openexr(file, [&] { image.emplace(stream); });

  surface.particle_radius =
      attribute<Imf::DoubleAttribute>(file, header, "meniscus.particleRadius").value();
  if (const auto* disorder = header.findTypedAttribute<Imf::DoubleAttribute>("meniscus.disorder"))
    surface.disorder = disorder->value();
  std::vector<std::uint32_t> kind;  // as the file has it
  make_maps(header,
            static_cast<std::size_t>(surface.camera.width) *
                static_cast<std::size_t>(surface.camera.height),
            surface, kind);
  if (!surface.forward.pixels.empty())
    surface.forward.frames_per_second =
        attribute<Imf::RationalAttribute>(file, header, "framesPerSecond").value();
  read_rows(file, *image, frame_of(file, header, surface, kind), surface.camera.height);
  take_kinds(file, kind, surface);
  if (surface.layers.most > 0) surface.layers.entry = surface.depth;
  if (attributes != nullptr) attributes->merge(texts_of(header));
  return surface;
}

}  // namespace meniscus
