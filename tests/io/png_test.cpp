#include "io/png.hpp"

#include <gmock/gmock.h>
#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>

#include "base/parallel.hpp"
#include "io/picture.hpp"
#include "io/preview.hpp"
#include "io/sample_surface.hpp"
#include "io/temporary_folder.hpp"
#include "io/writers.hpp"
#include "meniscus/error.hpp"
#include "meniscus/io.hpp"
#include "thrown.hpp"

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

// Several strips, each deflated by itself; a row of each filter, too.
TEST(Png, OfManyStripsDecodesToThePicture) {
  const TemporaryFolder folder;
  RgbImage image{700, 500, {}};
  std::uint32_t random = 1;
  for (int row = 0; row < image.height; ++row)
    for (int k = 0; k < 3 * image.width; ++k) {
      random = random * 1664525u + 1013904223u;
      const int kinds[] = {0, k, 3 * row, (k + row) / 2, static_cast<int>(random >> 24)};
      image.bytes.push_back(static_cast<std::uint8_t>(kinds[row / 20 % 5]));
    }
  const std::vector<std::uint8_t> encoded = encode_png(image);
  std::ofstream(folder / "a.png", std::ios::binary)
      .write(reinterpret_cast<const char*>(encoded.data()),
             static_cast<std::streamsize>(encoded.size()));
  EXPECT_TRUE(decode(folder / "a.png", image.width, image.height) == image.bytes);
  EXPECT_LT(encoded.size(), image.bytes.size() / 3);
  EXPECT_TRUE(on_threads(1, [&] { return encode_png(image); }) == encoded);
}

TEST(Png, SaysHowFarItIs) {
  const TemporaryFolder folder;
  const Surface surface = sample_surface(sample_camera());
  for (const Preview preview : kPreviews) {
    std::vector<double> shares;
    OutputFile file(folder / "a.png");
    write_png(file, surface, preview, "", [&](double share) { shares.push_back(share); });
    file.commit();
    EXPECT_GE(shares.size(), 4u);
    EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
    EXPECT_GT(shares.front(), 0);
    EXPECT_EQ(shares.back(), 1);
  }
}

TEST(Png, IsReadBackAndNeverWhenCutOff) {
  const TemporaryFolder folder;
  const Surface surface = sample_surface(sample_camera(24, 18));
  write_png(folder / "a.png", surface, Preview::lit);
  const RgbImage image = read_png(folder / "a.png");
  EXPECT_EQ(image.width, 24);
  EXPECT_EQ(image.height, 18);
  EXPECT_EQ(image.bytes, draw_preview(surface, Preview::lit));
  const std::string bytes = file_bytes(folder / "a.png");
  const std::size_t last_chunk = 12;  // IEND holds nothing
  for (std::size_t size = 0; size < bytes.size() - last_chunk; ++size) {
    std::ofstream(folder / "b.png", std::ios::binary) << bytes.substr(0, size);
    ASSERT_THROW(read_png(folder / "b.png"), InputError) << size << " of " << bytes.size();
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
// steps: the smoothed picture is the share of each pixel that the half plane covers. The same where
// the border is a crease.
TEST(Preview, SmoothingTurnsAJaggedBorderIntoCoverage) {
  constexpr auto kNowhere = std::numeric_limits<float>::infinity();
  for (const int n : {1, 2, 3, 4, 7, -1, -2, -3, -5})
    for (const auto& [steep, crease] :
         {std::pair{false, false}, {true, false}, {false, true}, {true, true}}) {
      Surface surface;
      surface.camera = sample_camera(48, 48);
      const auto inside = [&, &steep = steep](double x, double y) {
        if (steep) std::swap(x, y);
        return (y - 24) * std::abs(n) > (x - 24 - (n % 2 == 0 ? 0 : 0.5)) * (n > 0 ? 1 : -1);
      };
      Picture picture;
      std::vector<double> coverage;
      for (int row = 0; row < 48; ++row)
        for (int column = 0; column < 48; ++column) {
          const bool in = inside(column + .5, row + .5);
          surface.kind.push_back(in || crease ? Kind::surface : Kind::none);
          surface.depth.push_back(in || crease ? 2.0f : kNowhere);
          surface.normal.push_back(in ? Vec3{0, 0, 1} : crease ? Vec3{0, 0.8f, 0.6f} : Vec3{});
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

// Tilted planes that meet in a crease along a column have no steps: nothing is blended.
TEST(Preview, SmoothingKeepsStraightCreasesAndInteriors) {
  Surface surface;
  surface.camera = sample_camera(40, 30);
  surface.camera.view = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  surface.particle_radius = 0.01;
  const View view = make_view(surface.camera, 1, {0, 0, 0});
  Picture picture;
  for (int row = 0; row < 30; ++row)
    for (int column = 0; column < 40; ++column) {
      // The planes z = -4 - 3 |x|, hit by the ray t * (x, y, -1): many radii of depth a pixel.
      const double x = ray_direction(view, column + .5, row + .5).x;
      const double depth = 4 / (1 - 3 * std::abs(x));
      surface.depth.push_back(static_cast<float>(depth));
      surface.normal.push_back(static_cast<Vec3>(normalized(Vec3d{x > 0 ? 3.0 : -3.0, 0, 1})));
      surface.kind.push_back(Kind::surface);
      picture.push_back({static_cast<float>(column % 2), static_cast<float>(row % 3), 0});
    }
  EXPECT_GT(surface.depth[0] - surface.depth[1], 20 * surface.particle_radius);
  EXPECT_EQ(smooth_borders(Scene(surface), picture), picture);
}

// An orthographic look at the plane z = 0 from above; `plane` gives the depth at a pixel or
// infinity.
Surface seen_from_above(int side, const std::function<float(int, int)>& depth_at) {
  Surface surface;
  surface.camera.width = surface.camera.height = side;
  surface.camera.view = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  const double scale = 2.0 / side;  // a pixel is one unit wide
  surface.camera.projection = {scale, 0, 0, 0, 0, scale, 0, 0, 0, 0, -0.01, 0, 0, 0, 0, 1};
  surface.particle_radius = 1;
  for (int row = 0; row < side; ++row)
    for (int column = 0; column < side; ++column) {
      const float depth = depth_at(column, row);
      surface.depth.push_back(depth);
      surface.kind.push_back(std::isinf(depth) ? Kind::none : Kind::surface);
      surface.normal.push_back(std::isinf(depth) ? Vec3{} : Vec3{0, 0, 1});
    }
  return surface;
}

TEST(Relief, IsZeroOnAPlaneAndFullAroundASpeck) {
  constexpr float kNone = std::numeric_limits<float>::infinity();
  const Surface plane = seen_from_above(65, [](int, int) { return 10.0f; });
  for (const Relief& relief : measure_relief(Scene(plane), 8)) {
    ASSERT_EQ(relief.hollow, 0);
    ASSERT_EQ(relief.bulge, 0);
  }
  // A pixel alone: of the 96 samples only those within half a pixel of it hit it, and a disc of
  // radius 8 has 64 pi pixels, so at most a few of the samples.
  const Surface speck =
      seen_from_above(65, [&](int i, int j) { return i == 31 && j == 33 ? 10.0f : kNone; });
  EXPECT_GT(measure_relief(Scene(speck), 8)[33 * 65 + 31].bulge, 0.95f);
}

TEST(Relief, TellsTheFootOfAStepFromItsTop) {
  // A step of 8 radii up at column 32. At its foot half of the disc stands a full disc radius
  // higher, on its top half of it lies that much lower.
  const Surface step = seen_from_above(64, [](int i, int) { return i < 32 ? 20.0f : 12.0f; });
  const auto relief = measure_relief(Scene(step), 8);
  const Relief foot = relief[32 * 64 + 31], top = relief[32 * 64 + 32];
  EXPECT_EQ(foot.bulge, 0);
  EXPECT_EQ(top.hollow, 0);
  // The measurement nearest to the step lies up to four pixels off it: the disc's part beyond a
  // chord at half its radius is 0.196 of it, and half of it is 0.5; a sample is 1/96.
  EXPECT_GT(foot.hollow, 0.196f - 1.0f / 96);
  EXPECT_LT(foot.hollow, 0.5f + 1.0f / 96);
  EXPECT_GT(top.bulge, 0.196f - 1.0f / 96);
  EXPECT_LT(top.bulge, 0.5f + 1.0f / 96);
}

std::string reading_error(const std::string& path) {
  return text_of_thrown<InputError>([&] { read_png(path); });
}

TEST(Png, RefusesAPictureThatItsFileCannotHold) {
  const TemporaryFolder folder;
  write_png(folder / "a.png", sample_surface(sample_camera(24, 18)), Preview::lit);
  std::string bytes = file_bytes(folder / "a.png");
  const auto put = [&](std::size_t at, std::initializer_list<int> values) {
    for (const int value : values) bytes[at++] = static_cast<char>(value);
    const uLong sum = crc32(0, reinterpret_cast<const Bytef*>(bytes.data() + 12), 17);
    for (int k = 0; k < 4; ++k) bytes[29 + k] = static_cast<char>(sum >> (24 - 8 * k));
    std::ofstream(folder / "b.png", std::ios::binary) << bytes;
  };
  put(16, {0, 0, 0x40, 0, 0, 0, 0x40, 0});  // 16384 x 16384
  EXPECT_THAT(reading_error(folder / "b.png"),
              testing::HasSubstr("bytes are no picture of 16384x16384 pixels"));
  // Grey of one bit: 24 times as large in memory as when it is unpacked.
  put(16, {0, 0, 0, 24, 0, 0, 0, 18, 1, 0});
  EXPECT_THAT(reading_error(folder / "b.png"), testing::HasSubstr("8-bit RGB"));
}

// libpng makes room for a part before it reads it.
TEST(Png, RefusesAPartThatTheFileCannotHold) {
  const TemporaryFolder folder;
  write_png(folder / "a.png", sample_surface(sample_camera(24, 18)), Preview::lit);
  std::string bytes = file_bytes(folder / "a.png");
  bytes.replace(33, 4, std::string("\x1e\0\0\0", 4));  // 503 MB; behind the signature and IHDR
  std::ofstream(folder / "b.png", std::ios::binary) << bytes;
  EXPECT_THAT(reading_error(folder / "b.png"), testing::HasSubstr("longer than the file"));
}

TEST(Preview, WhatIsNoNumberIsBlackAndNoCrash) {
  for (const float wrong : {NAN, INFINITY, -INFINITY, 1e38f, -1e38f}) {
    Surface surface = layered_surface(sample_camera(), 1);
    for (std::size_t k = 0; k < surface.normal.size(); k += 3) {
      surface.normal[k] = surface.layers.back_normal[k] = {wrong, wrong, wrong};
      surface.layers.exit[k] = surface.layers.thickness[k] = wrong;
      surface.depth[k] = k % 2 ? wrong : surface.depth[k];
    }
    for (const double radius : {surface.particle_radius, 1e-300, 1e300}) {
      surface.particle_radius = radius;
      for (const Preview preview : kPreviews)
        EXPECT_EQ(draw_preview(surface, preview).size(), 3u * 61 * 47);
      EXPECT_EQ(draw_preview(surface, Preview::glass).size(), 3u * 61 * 47);
    }
  }
}

TEST(Preview, GlassBendsWhatLiesBehind) {
  const Surface glass = layered_surface(sample_camera(), 1);
  const std::vector<std::uint8_t> picture = draw_preview(glass, Preview::glass);
  ASSERT_EQ(picture.size(), 3 * glass.depth.size());
  // A plate with parallel sides that meets rays at right angles bends none and absorbs some.
  const auto plate = [&](float thickness, bool there) {
    Surface surface = glass;
    Layers& layers = surface.layers;
    const Camera& camera = surface.camera;
    const Vec3 to_eye{static_cast<float>(camera.view[8]), static_cast<float>(camera.view[9]),
                      static_cast<float>(camera.view[10])};
    const std::size_t middle = 23 * 61 + 30;
    for (std::size_t p = 0; p < surface.depth.size(); ++p) {
      const bool covered = p != middle || there;
      surface.depth[p] = covered ? 3 : std::numeric_limits<float>::infinity();
      surface.normal[p] = covered ? to_eye : Vec3{};
      layers.count[p] = covered;
      layers.thickness[p] = covered ? (p == middle ? thickness : 1.0f) : 0.0f;
      layers.entry[p] = surface.depth[p];
      layers.exit[p] = surface.depth[p] + 1;
      layers.back_normal[p] = to_eye * -1.0f;
    }
    const std::vector<std::uint8_t> bytes = draw_preview(surface, Preview::glass);
    return std::array<int, 3>{bytes[3 * middle], bytes[3 * middle + 1], bytes[3 * middle + 2]};
  };
  const auto clear = plate(0, true), some = plate(1, true), more = plate(2, true);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_GT(clear[c], some[c]);
    EXPECT_GT(some[c], more[c]);
  }
  EXPECT_GT(clear[0] - more[0], clear[2] - more[2]);  // red is absorbed first

  EXPECT_THROW(draw_preview(sample_surface(sample_camera()), Preview::glass), InvalidArgument);
  Surface wrong = glass;
  wrong.layers.thickness.pop_back();
  EXPECT_THROW(draw_preview(wrong, Preview::glass), InvalidArgument);
}

}  // namespace
}  // namespace meniscus
