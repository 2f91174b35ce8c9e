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

#include <algorithm>
#include <cstring>
#include <optional>
#include <vector>

#include "io/exr_channels.hpp"
#include "io/input_file.hpp"
#include "meniscus/camera.hpp"
#include "meniscus/io.hpp"

namespace meniscus {
namespace {

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

}  // namespace

Surface read_exr(const std::string& path, std::map<std::string, std::string>* attributes) {
  const InputFile file = read_file(path);
  Stream stream(file);
  std::optional<Imf::InputFile> image;
  try {
    image.emplace(stream);
  } catch (const std::exception& error) {
    fail(file, "", std::string("is cut off, damaged or no EXR: ") + error.what());
  }
  const Imf::Header& header = image->header();

  Surface surface;
  surface.camera = camera_of(file, header);
  surface.particle_radius =
      attribute<Imf::DoubleAttribute>(file, header, "meniscus.particleRadius").value();
  const auto width = static_cast<std::size_t>(surface.camera.width);
  const std::size_t pixels = width * static_cast<std::size_t>(surface.camera.height);
  std::vector<std::uint32_t> kind;
  surface.depth.resize(pixels);
  // Not all maps need have been asked for.
  const auto make_if = [&](const char* channel, auto& map) {
    if (header.channels().findChannel(channel) != nullptr) map.resize(pixels);
  };
  make_if("N.X", surface.normal);
  make_if("P.X", surface.position);
  make_if("id", surface.group);
  make_if("kind", kind);
  make_if("kind", surface.kind);
  make_if("residual", surface.residual);
  make_if("V.X", surface.velocity);
  make_if("forward.u", surface.forward.pixels);

  Imf::FrameBuffer frame;
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
  if (!surface.forward.pixels.empty())
    surface.forward.frames_per_second =
        attribute<Imf::RationalAttribute>(file, header, "framesPerSecond").value();
  for_each_channel(surface, kind, slice);
  read_rows(file, *image, frame, surface.camera.height);

  for (std::size_t k = 0; k < kind.size(); ++k) {
    if (kind[k] > static_cast<std::uint32_t>(Kind::splash))
      fail(file, "row " + std::to_string(k / width) + ", column " + std::to_string(k % width),
           "kind is " + std::to_string(kind[k]) + ", wanted 0, 1 or 2");
    surface.kind[k] = static_cast<Kind>(kind[k]);
  }
  if (attributes != nullptr)
    for (auto a = header.begin(); a != header.end(); ++a)
      if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&a.attribute()))
        attributes->emplace(a.name(), text->value());
  return surface;
}

}  // namespace meniscus
