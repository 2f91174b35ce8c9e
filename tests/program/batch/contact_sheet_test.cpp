#include "program/batch/contact_sheet.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>

#include "io/preview.hpp"
#include "io/sample_surface.hpp"
#include "io/temporary_folder.hpp"
#include "meniscus/io.hpp"
#include "program/page/tags.hpp"

namespace meniscus {
namespace {

using testing::Each;
using testing::HasSubstr;

double light(std::uint8_t srgb) {
  const double s = srgb / 255.0;
  return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

// Bytes of no order.
RgbImage noise(int width, int height) {
  RgbImage image{width, height, {}};
  std::uint32_t state = 1;
  for (int k = 0; k < 3 * width * height; ++k)
    image.bytes.push_back(static_cast<std::uint8_t>((state = state * 1664525 + 1013904223) >> 24));
  return image;
}

TEST(Shrunk, KeepsAnEvenColour) {
  for (const int value : {0, 1, 77, 128, 254, 255}) {
    const RgbImage image{37, 23,
                         std::vector<std::uint8_t>(3 * 37 * 23, static_cast<std::uint8_t>(value))};
    for (const int width : {1, 2, 10, 36}) {
      const RgbImage small = shrunk(image, width);
      EXPECT_EQ(small.width, width);
      EXPECT_EQ(small.height, std::max(1l, std::lround(23.0 * width / 37)));
      EXPECT_EQ(small.bytes.size(), static_cast<std::size_t>(3 * width * small.height));
      EXPECT_THAT(small.bytes, Each(value)) << width;
    }
  }
}

TEST(Shrunk, IsTheMeanLightOfTheAreaOfEachPixel) {
  const RgbImage image = noise(30, 20);
  for (const int width : {15, 12}) {  // 2 and 2.5 pixels wide
    const RgbImage small = shrunk(image, width);
    const double scale = 30.0 / width;
    ASSERT_EQ(small.height, 20 / scale);
    // The same by samples in the middle of tenths of pixels, which no border cuts.
    const int samples = static_cast<int>(10 * scale);
    for (int row = 0; row < small.height; ++row)
      for (int column = 0; column < width; ++column)
        for (int c = 0; c < 3; ++c) {
          double sum = 0;
          for (int j = 0; j < samples; ++j)
            for (int i = 0; i < samples; ++i) {
              const int x = static_cast<int>(column * scale + (i + 0.5) / 10),
                        y = static_cast<int>(row * scale + (j + 0.5) / 10);
              sum += light(image.bytes[static_cast<std::size_t>(3 * (30 * y + x) + c)]);
            }
          const double mean = sum / (samples * samples);
          const auto byte = small.bytes[static_cast<std::size_t>(3 * (width * row + column) + c)];
          // The nearest byte: half a step away, give or take the rounding of floats.
          ASSERT_GE(mean, light(static_cast<std::uint8_t>(byte - 1)));
          ASSERT_LE(mean, light(static_cast<std::uint8_t>(byte + 1)));
        }
  }
}

TEST(Shrunk, NeverEnlarges) {
  const RgbImage image = noise(8, 6);
  for (const int width : {8, 9, 100}) {
    EXPECT_EQ(shrunk(image, width).width, 8);
    EXPECT_EQ(shrunk(image, width).bytes, image.bytes);
  }
}

class ContactSheet : public testing::Test {
 protected:
  FrameRecord frame(std::int64_t number, const std::vector<std::string>& outputs) {
    FrameRecord r;
    r.frame = number;
    for (const std::string& name : outputs) r.outputs.push_back(folder / name);
    return r;
  }
  Tile tile_of(const FrameRecord& record) {
    const auto tiles = contact_sheet(merge_records({record}), 96, 32);
    EXPECT_EQ(tiles.size(), 1u);
    return tiles.at(0);
  }
  TemporaryFolder folder;
  Surface surface = sample_surface(sample_camera(64, 48));
  RgbImage lit = shrunk({64, 48, draw_preview(surface, Preview::lit)}, 32);
};

TEST_F(ContactSheet, DrawsTheExrWhereThereIsNoPng) {
  write_exr(folder / "a.exr", surface, {});
  write_png(folder / "a.png", surface, Preview::depth);
  EXPECT_EQ(tile_of(frame(1, {"a.exr"})).picture.value().bytes, lit.bytes);
  EXPECT_EQ(tile_of(frame(1, {"a.exr", "a.png"})).picture.value().bytes,
            shrunk({64, 48, draw_preview(surface, Preview::depth)}, 32).bytes);
}

TEST_F(ContactSheet, SaysWhyThereIsNoPicture) {
  const auto expect = [&](const FrameRecord& record, const char* why, const char* details) {
    const Tile tile = tile_of(record);
    EXPECT_FALSE(tile.picture);
    EXPECT_EQ(tile.why_none, why);
    EXPECT_THAT(tile.details, HasSubstr(details));
  };
  expect(frame(1, {"a.exr"}), "cannot be read", "a.exr: cannot be opened");
  expect(frame(1, {"a.png"}), "cannot be read", "a.png: cannot be opened");
  expect(frame(1, {"a.ply"}), "no picture", "neither");
  Surface depth = surface;
  depth.normal.clear();
  write_exr(folder / "depth.exr", depth, {});
  expect(frame(1, {"depth.exr"}), "no picture", "depth.exr has no normals");
  FrameRecord failed = frame(1, {"a.exr"});
  failed.status = FrameStatus::failed;
  failed.error = "in.ply: is empty";
  expect(failed, "failed", "in.ply: is empty");
  for (const char* name : {"a.exr", "a.png"}) {
    name == std::string("a.exr") ? write_exr(folder / name, surface, {})
                                 : write_png(folder / name, surface);
    const std::string bytes = file_bytes(folder / name);
    std::ofstream(folder / name, std::ios::binary) << bytes.substr(0, bytes.size() / 2);
    expect(frame(1, {name}), "cannot be read", name);
  }
}

TEST_F(ContactSheet, SpreadsFramesEvenlyFromTheFirstToTheLast) {
  std::vector<FrameRecord> records;
  for (std::int64_t number = 1; number <= 1000; ++number)
    if (number != 500) records.push_back(frame(number, {}));
  const BatchReport report = merge_records(records);
  for (const std::size_t most : {1, 2, 3, 96, 999, 1000, 2000}) {
    const auto tiles = contact_sheet(report, most, 32);
    ASSERT_EQ(tiles.size(), std::min<std::size_t>(most, 1000));
    EXPECT_EQ(tiles.front().frame, 1);
    if (most > 1) {
      EXPECT_EQ(tiles.back().frame, 1000);
    }
    const double apart = most > 1 ? 999.0 / static_cast<double>(tiles.size() - 1) : 0;
    for (std::size_t k = 0; k < tiles.size(); ++k)
      EXPECT_NEAR(static_cast<double>(tiles[k].frame), 1 + apart * static_cast<double>(k), 0.51);
  }
  EXPECT_EQ(contact_sheet(report, 1000, 32)[499].why_none, "missing");
  EXPECT_TRUE(contact_sheet(merge_records({}), 96, 32).empty());
}

TEST_F(ContactSheet, ManyPicturesThatPackBadlyStayASmallPage) {
  const std::vector<std::uint8_t> png = encode_png(noise(640, 480));
  std::ofstream(folder / "a.png", std::ios::binary)
      .write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
  std::vector<FrameRecord> records;
  for (std::int64_t number = 1; number <= 300; ++number)
    records.push_back(frame(number, {"a.png"}));
  const std::string page = to_html(merge_records(records));
  expect_whole_page(page.substr(0, page.find("<h2>Frames")) + "</main></body></html>");
  EXPECT_LT(page.size(), 3'000'000u);
  EXPECT_GT(page.size(), 1'000'000u);
  std::size_t images = 0;
  for (std::size_t at = 0; (at = page.find("<img ", at)) != std::string::npos; ++at) ++images;
  EXPECT_EQ(images, 96u);
}

}  // namespace
}  // namespace meniscus
