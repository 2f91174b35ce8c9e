#include <gmock/gmock.h>
#include <png.h>

#include <cmath>

#include "io/picture.hpp"
#include "io/preview.hpp"
#include "io/sample_surface.hpp"
#include "io/temporary_folder.hpp"
#include "meniscus/error.hpp"
#include "meniscus/io.hpp"

namespace meniscus {
namespace {

constexpr Preview kPreviews[] = {Preview::lit, Preview::normal, Preview::depth, Preview::groups};

std::vector<std::uint8_t> decode(const std::string& path, int width, int height) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  EXPECT_TRUE(png_image_begin_read_from_file(&image, path.c_str())) << image.message;
  EXPECT_EQ(image.format, static_cast<png_uint_32>(PNG_FORMAT_RGB));
  EXPECT_EQ(static_cast<int>(image.width), width);
  EXPECT_EQ(static_cast<int>(image.height), height);
  std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(image));
  EXPECT_TRUE(png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr)) << image.message;
  return pixels;
}

TEST(Png, DecodesToThePictureAndIsSrgb) {
  const TemporaryFolder folder;
  const Surface surface = sample_surface(sample_camera());
  for (const Preview preview : kPreviews) {
    write_png(folder / "a.png", surface, preview);
    EXPECT_EQ(decode(folder / "a.png", 61, 47), draw_preview(surface, preview));
    EXPECT_THAT(file_bytes(folder / "a.png"), testing::HasSubstr("sRGB"));
  }
}

TEST(Png, SameBytesTwice) {
  const TemporaryFolder folder;
  const Surface surface = sample_surface(sample_camera(160, 120));
  for (const Preview preview : kPreviews) {
    write_png(folder / "a.png", surface, preview);
    write_png(folder / "b.png", surface, preview);
    EXPECT_TRUE(file_bytes(folder / "a.png") == file_bytes(folder / "b.png"));
  }
}

TEST(Preview, NormalHoldsTheEyeSpaceNormal) {
  const Surface surface = sample_surface(sample_camera());
  const std::vector<std::uint8_t> bytes = draw_preview(surface, Preview::normal);
  const Scene scene(surface);
  int checked = 0;
  for (int row = 1; row + 1 < scene.height; ++row)
    for (int column = 1; column + 1 < scene.width; ++column) {
      const std::size_t k = scene.at(column, row);
      bool inside = true;  // all neighbours show the same thing: no border is smoothed here
      for (const int step : {-1, 1, -scene.width, scene.width})
        inside &= surface.kind[k] == surface.kind[k + step];
      if (!inside || surface.kind[k] != Kind::surface) continue;
      const auto& v = surface.camera.view;
      const Vec3& n = surface.normal[k];
      for (int axis = 0; axis < 3; ++axis) {
        const double value = v[4 * axis] * n.x + v[4 * axis + 1] * n.y + v[4 * axis + 2] * n.z;
        // Half a step of eight bits, and a little for the way to linear light and back.
        ASSERT_NEAR(bytes[3 * k + axis], (value / 2 + .5) * 255, 0.51);
      }
      ++checked;
    }
  EXPECT_GT(checked, 300);
}

TEST(Preview, DepthGetsDarkerWithDistance) {
  const Surface surface = sample_surface(sample_camera());
  const std::vector<std::uint8_t> bytes = draw_preview(surface, Preview::depth);
  // Down the middle column the pond comes nearer.
  const auto light = [&](int row) {
    const std::size_t k = static_cast<std::size_t>(row) * 61 + 20;
    EXPECT_EQ(surface.kind[k], Kind::surface) << row;
    return 0.2 * bytes[3 * k] + 0.7 * bytes[3 * k + 1] + 0.1 * bytes[3 * k + 2];
  };
  EXPECT_LT(light(20), light(27));
  EXPECT_LT(light(27), light(34));
}

TEST(Preview, DrawsNothingInViewAndOnePixel) {
  Camera away = sample_camera(9, 7);
  away.view[11] += 100;
  Surface one = sample_surface(sample_camera(1, 1));
  one.particle_radius = 0;  // not known
  for (const Preview preview : kPreviews) {
    EXPECT_EQ(draw_preview(sample_surface(away), preview).size(), 9u * 7 * 3);
    EXPECT_EQ(draw_preview(one, preview).size(), 3u);
  }
}

TEST(Preview, RefusesMapsOfAnotherSize) {
  EXPECT_THROW(draw_preview(Surface{}, Preview::lit), InvalidArgument);
  Surface surface = sample_surface(sample_camera());
  surface.depth.clear();
  EXPECT_THROW(draw_preview(surface, Preview::depth), InvalidArgument);
}

// A half plane whose border has the slope 1/n or n and passes through the middle of each of its
// steps: the smoothed picture is the share of each pixel that the half plane covers.
TEST(Preview, SmoothingTurnsAJaggedBorderIntoCoverage) {
  for (const int n : {1, 2, 3, 4, 7, -1, -2, -3, -5})
    for (const bool steep : {false, true}) {
      Surface surface;
      surface.camera = sample_camera(48, 48);
      const auto inside = [&](double x, double y) {
        if (steep) std::swap(x, y);
        return (y - 24) * std::abs(n) > (x - 24 - (n % 2 == 0 ? 0 : 0.5)) * (n > 0 ? 1 : -1);
      };
      Picture picture;
      std::vector<double> coverage;
      for (int row = 0; row < 48; ++row)
        for (int column = 0; column < 48; ++column) {
          const bool in = inside(column + .5, row + .5);
          surface.kind.push_back(in ? Kind::surface : Kind::none);
          surface.depth.push_back(in ? 2.0f : std::numeric_limits<float>::infinity());
          surface.normal.push_back(in ? Vec3{0, 0, 1} : Vec3{});
          picture.push_back(in ? Color{1, 1, 1} : Color{});
          double share = 0;
          for (int k = 0; k < 256; ++k)
            share += inside(column + (k % 16 + .5) / 16, row + (k / 16 + .5) / 16) / 256.0;
          coverage.push_back(share);
        }
      const Scene scene(surface);
      const Picture smooth = smooth_borders(scene, picture);
      for (int row = 8; row < 40; ++row)
        for (int column = 8; column < 40; ++column) {
          const std::size_t k = scene.at(column, row);
          // Each of the 16 lines of samples counts its own length to half a sample.
          ASSERT_NEAR(smooth[k].x, coverage[k], 1.0 / 32) << n << " at " << column << ", " << row;
        }
    }
}

}  // namespace
}  // namespace meniscus
