#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineInputFile.h>
#include <ImfHeader.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "io/sample_surface.hpp"
#include "io/temporary_folder.hpp"
#include "meniscus/error.hpp"
#include "meniscus/extract.hpp"

namespace meniscus {
namespace {

// Read by OpenEXR: of each pixel the samples that are kept, A = 1, Z where the ray enters, ZBack
// where it leaves.
TEST(Exr, DeepImagesHoldAllIntervals) {
  const TemporaryFolder folder;
  for (const int most : {1, 2, 5}) {
    const Surface surface = layered_surface(sample_camera(61, 150), most);
    write_deep_exr(folder / "a.deep.exr", surface, {});
    Imf::DeepScanLineInputFile file((folder / "a.deep.exr").c_str());
    EXPECT_EQ(file.header().dataWindow(), Imath::Box2i({0, 0}, {60, 149}));
    EXPECT_EQ(file.header().compression(), Imf::ZIPS_COMPRESSION);
    const std::size_t pixels = surface.depth.size();
    std::vector<std::uint32_t> counts(pixels);
    std::vector<std::array<float, 3>> samples(2 * pixels);  // A, Z, ZBack; two a pixel at most
    std::vector<float*> first[3];
    Imf::DeepFrameBuffer frame;
    frame.insertSampleCountSlice(
        Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data()), 4, 4 * 61));
    const char* const names[] = {"A", "Z", "ZBack"};
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t p = 0; p < pixels; ++p) first[c].push_back(&samples[2 * p][c]);
      frame.insert(names[c],
                   Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(first[c].data()),
                                  sizeof(float*), sizeof(float*) * 61, sizeof samples[0]));
    }
    file.setFrameBuffer(frame);
    file.readPixelSampleCounts(0, 149);
    std::size_t two = 0;
    for (std::size_t p = 0; p < pixels; ++p) {
      ASSERT_EQ(counts[p], std::min(surface.layers.count[p], static_cast<std::uint32_t>(most)));
      two += counts[p] == 2;
    }
    EXPECT_EQ(two > 0, most > 1);
    file.readPixels(0, 149);
    for (std::size_t p = 0; p < pixels; ++p)
      for (std::size_t k = 0; k < counts[p]; ++k) {
        ASSERT_EQ(samples[2 * p + k][0], 1.0f);
        ASSERT_EQ(samples[2 * p + k][1], surface.layers.entry[k * pixels + p]);
        ASSERT_EQ(samples[2 * p + k][2], surface.layers.exit[k * pixels + p]);
        if (k == 0) {
          ASSERT_EQ(samples[2 * p][1], surface.depth[p]);
        }
      }
  }
  EXPECT_THROW(read_exr(folder / "a.deep.exr"), InputError);
}

}  // namespace
}  // namespace meniscus
