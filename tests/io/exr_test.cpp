#include <ImfChannelList.h>
#include <ImfDoubleAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfMatrixAttribute.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfThreading.h>
#include <gmock/gmock.h>
#include <half.h>

#include <cmath>

#include "io/sample_surface.hpp"
#include "io/temporary_folder.hpp"
#include "meniscus/error.hpp"
#include "meniscus/extract.hpp"
#include "same_bits.hpp"
#include "thrown.hpp"

namespace meniscus {
namespace {

using testing::HasSubstr;

// Reads one channel as it is stored.
template <typename Value>
std::vector<Value> read_channel(Imf::InputFile& file, const char* name, Imf::PixelType type) {
  const Imath::Box2i window = file.header().dataWindow();
  const int width = window.max.x - window.min.x + 1, height = window.max.y - window.min.y + 1;
  std::vector<Value> values(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const Imf::Channel* channel = file.header().channels().findChannel(name);
  if (channel == nullptr || channel->type != type) {
    ADD_FAILURE() << "channel " << name << " is missing or has another type";
    return values;
  }
  Imf::FrameBuffer frame;
  frame.insert(name, Imf::Slice(type, reinterpret_cast<char*>(values.data()), sizeof(Value),
                                sizeof(Value) * static_cast<std::size_t>(width)));
  file.setFrameBuffer(frame);
  file.readPixels(window.min.y, window.max.y);
  return values;
}

std::vector<float> component(const std::vector<Vec3>& vectors, float Vec3::*member) {
  std::vector<float> values;
  for (const Vec3& v : vectors) values.push_back(v.*member);
  return values;
}

// A surface with motion.
Surface moving_surface() {
  Surface surface = sample_surface(sample_camera());
  surface.forward.frames_per_second = 24000.0 / 1001;
  for (std::size_t k = 0; k < surface.depth.size(); ++k) {
    const bool there = surface.kind[k] != Kind::none;
    const float s = static_cast<float>(k);
    surface.velocity.push_back(there ? Vec3{0.1f * s, -1e-7f, 1e20f} : Vec3{});
    surface.forward.pixels.push_back(there ? std::array{-0.37f * s, 1e6f} : std::array<float, 2>{});
  }
  return surface;
}

const char* const kCompressions[] = {"none", "rle", "zips", "zip", "piz", "pxr24"};

class ExrCompression : public testing::TestWithParam<Compression> {};

TEST_P(ExrCompression, KeepsEveryChannel) {
  const TemporaryFolder folder;
  const Surface surface = sample_surface(sample_camera());
  write_exr(folder / "a.exr", surface, {}, GetParam());
  Imf::InputFile file((folder / "a.exr").c_str());
  EXPECT_EQ(static_cast<int>(file.header().compression()), static_cast<int>(GetParam()));

  // PXR24 keeps 15 of 23 bits of a float and rounds; everything else is lossless.
  const float relative = GetParam() == Compression::pxr24 ? std::ldexp(1.0f, -16) : 0.0f;
  const auto compare = [&](const char* name, const std::vector<float>& expected) {
    const auto actual = read_channel<float>(file, name, Imf::FLOAT);
    ASSERT_EQ(actual.size(), expected.size());
    for (std::size_t k = 0; k < actual.size(); ++k) {
      if (std::isinf(expected[k]))
        ASSERT_EQ(actual[k], expected[k]) << name << " " << k;
      else
        ASSERT_LE(std::abs(actual[k] - expected[k]), relative * std::abs(expected[k]))
            << name << " " << k;
    }
  };
  compare("Z", surface.depth);
  compare("N.X", component(surface.normal, &Vec3::x));
  compare("N.Y", component(surface.normal, &Vec3::y));
  compare("N.Z", component(surface.normal, &Vec3::z));
  compare("P.X", component(surface.position, &Vec3::x));
  compare("P.Y", component(surface.position, &Vec3::y));
  compare("P.Z", component(surface.position, &Vec3::z));
  compare("residual", surface.residual);
  EXPECT_EQ(read_channel<std::uint32_t>(file, "id", Imf::UINT), surface.group);

  const auto kind = read_channel<std::uint32_t>(file, "kind", Imf::UINT);
  const auto alpha = read_channel<float>(file, "A", Imf::FLOAT);
  std::array<int, 3> seen{};
  for (std::size_t k = 0; k < kind.size(); ++k) {
    ASSERT_EQ(kind[k], static_cast<std::uint32_t>(surface.kind[k]));
    ASSERT_EQ(alpha[k], kind[k] == 0 ? 0.0f : 1.0f);
    ++seen.at(kind[k]);
  }
  for (const int count : seen) EXPECT_GT(count, 0);
}

INSTANTIATE_TEST_SUITE_P(All, ExrCompression,
                         testing::Values(Compression::none, Compression::rle, Compression::zips,
                                         Compression::zip, Compression::piz, Compression::pxr24),
                         [](const auto& info) {
                           return kCompressions[static_cast<int>(info.param)];
                         });

TEST(Exr, MapsThatAreNotThereAreLeftOut) {
  const TemporaryFolder folder;
  const Surface all = sample_surface(sample_camera());
  Surface some = all;
  some.normal.clear();
  some.kind.clear();
  some.residual.clear();
  write_exr(folder / "a.exr", some, {});
  Imf::InputFile file((folder / "a.exr").c_str());
  std::vector<std::string> names;
  for (auto c = file.header().channels().begin(); c != file.header().channels().end(); ++c)
    names.push_back(c.name());
  EXPECT_THAT(names, testing::UnorderedElementsAre("Z", "A", "P.X", "P.Y", "P.Z", "id"));
  const auto alpha = read_channel<float>(file, "A", Imf::FLOAT);
  for (std::size_t k = 0; k < alpha.size(); ++k)
    ASSERT_EQ(alpha[k], all.kind[k] == Kind::none ? 0.0f : 1.0f);
  const Surface read = read_exr(folder / "a.exr");
  EXPECT_EQ(read.depth, all.depth);
  EXPECT_EQ(read.position, all.position);
  EXPECT_EQ(read.group, all.group);
  EXPECT_TRUE(read.normal.empty());
  EXPECT_TRUE(read.kind.empty());
  EXPECT_TRUE(read.residual.empty());
}

TEST(Exr, AttributesAreChannelsOf32Bits) {
  const TemporaryFolder folder;
  Surface surface = sample_surface(sample_camera());
  const std::vector<float> values(surface.depth.size(), 12345.678f);
  surface.attributes = {{"heat", values}, {"force.X", surface.depth}, {"id", values}};
  for (float& value : surface.attributes[1].values)
    if (!std::isfinite(value)) value = 0;
  write_exr(folder / "a.exr", surface, {}, Compression::zip, true);  // half does not touch them
  Imf::InputFile file((folder / "a.exr").c_str());
  EXPECT_EQ(read_channel<float>(file, "heat", Imf::FLOAT), values);
  EXPECT_EQ(read_channel<float>(file, "force.X", Imf::FLOAT), surface.attributes[1].values);
  EXPECT_EQ(read_channel<float>(file, "particle.id", Imf::FLOAT), values);
  EXPECT_EQ(read_channel<std::uint32_t>(file, "id", Imf::UINT), surface.group);
  const Surface read = read_exr(folder / "a.exr");
  ASSERT_EQ(read.attributes.size(), 3u);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(read.attributes[k].name, surface.attributes[k].name);
    EXPECT_EQ(read.attributes[k].values, surface.attributes[k].values);
  }
  surface.attributes[0].values.pop_back();
  EXPECT_THROW(write_exr(folder / "b.exr", surface, {}), InvalidArgument);
}

TEST(Exr, MotionIsAddedAndChangesNothingElse) {
  const TemporaryFolder folder;
  const Surface moving = moving_surface();
  Surface still = moving;
  still.velocity.clear();
  still.forward = {};
  write_exr(folder / "still.exr", still, {});
  write_exr(folder / "a.exr", moving, {});
  Imf::InputFile file((folder / "a.exr").c_str());
  EXPECT_EQ(read_channel<float>(file, "V.X", Imf::FLOAT), component(moving.velocity, &Vec3::x));
  EXPECT_EQ(read_channel<float>(file, "V.Y", Imf::FLOAT), component(moving.velocity, &Vec3::y));
  EXPECT_EQ(read_channel<float>(file, "V.Z", Imf::FLOAT), component(moving.velocity, &Vec3::z));
  std::vector<float> u, v;
  for (const auto& pixel : moving.forward.pixels) {
    u.push_back(pixel[0]);
    v.push_back(pixel[1]);
  }
  EXPECT_EQ(read_channel<float>(file, "forward.u", Imf::FLOAT), u);
  EXPECT_EQ(read_channel<float>(file, "forward.v", Imf::FLOAT), v);
  ASSERT_TRUE(Imf::hasFramesPerSecond(file.header()));
  EXPECT_EQ(Imf::framesPerSecond(file.header()).n, 24000);
  EXPECT_EQ(Imf::framesPerSecond(file.header()).d, 1001u);
  EXPECT_THAT(Imf::comments(file.header()), HasSubstr("world units per second"));
  EXPECT_THAT(Imf::comments(file.header()), HasSubstr("pixels to the right and down"));

  Surface back = read_exr(folder / "a.exr");
  EXPECT_EQ(back.velocity, moving.velocity);
  EXPECT_EQ(back.forward.pixels, moving.forward.pixels);
  EXPECT_DOUBLE_EQ(back.forward.frames_per_second, moving.forward.frames_per_second);
  const Surface plain = read_exr(folder / "still.exr");
  EXPECT_TRUE(plain.velocity.empty());
  EXPECT_TRUE(plain.forward.pixels.empty());
  EXPECT_EQ(back.depth, plain.depth);
  EXPECT_EQ(back.normal, plain.normal);
  EXPECT_EQ(back.position, plain.position);
  EXPECT_EQ(back.group, plain.group);
  EXPECT_EQ(back.residual, plain.residual);

  Surface wrong = moving;
  wrong.velocity.pop_back();
  EXPECT_THROW(write_exr(folder / "b.exr", wrong, {}), InvalidArgument);
  wrong = moving;
  wrong.forward.pixels.pop_back();
  EXPECT_THROW(write_exr(folder / "b.exr", wrong, {}), InvalidArgument);
}

TEST_P(ExrCompression, HalfKeepsElevenBitsOfWhatNeedsNoMore) {
  const TemporaryFolder folder;
  Surface surface = moving_surface();
  for (Vec3& v : surface.velocity) v.z = 0.3f;  // forward.v has values of a million
  write_exr(folder / "a.exr", surface, {}, GetParam(), true);
  Imf::InputFile file((folder / "a.exr").c_str());
  for (const char* name : {"N.X", "N.Y", "N.Z", "residual", "V.X", "V.Y", "V.Z"})
    EXPECT_EQ(file.header().channels().findChannel(name)->type, Imf::HALF) << name;
  for (const char* name : {"A", "Z", "P.X", "P.Y", "P.Z", "forward.u", "forward.v"})
    EXPECT_EQ(file.header().channels().findChannel(name)->type, Imf::FLOAT) << name;

  const Surface back = read_exr(folder / "a.exr");
  EXPECT_EQ(back.group, surface.group);
  EXPECT_EQ(back.kind, surface.kind);
  const float least = HALF_MIN;  // smaller ones keep less
  const auto near = [&](float found, float wanted) {
    return std::abs(found - wanted) <= std::max(std::abs(wanted), least) / 2048;
  };
  ASSERT_EQ(back.normal.size(), surface.normal.size());
  std::size_t rounded = 0;
  for (std::size_t k = 0; k < surface.normal.size(); ++k) {
    EXPECT_TRUE(near(back.normal[k].x, surface.normal[k].x)) << k;
    EXPECT_TRUE(near(back.normal[k].z, surface.normal[k].z)) << k;
    EXPECT_TRUE(near(back.velocity[k].x, surface.velocity[k].x)) << k;
    EXPECT_TRUE(near(back.velocity[k].y, surface.velocity[k].y)) << k;
    EXPECT_TRUE(near(back.residual[k], surface.residual[k])) << k;
    rounded += back.velocity[k].x != surface.velocity[k].x;
  }
  EXPECT_GT(rounded, 0u);
  if (GetParam() == Compression::pxr24) return;  // which rounds floats
  EXPECT_EQ(back.depth, surface.depth);
  EXPECT_EQ(back.position, surface.position);
  EXPECT_EQ(back.forward.pixels, surface.forward.pixels);
}

TEST(Exr, HeaderSaysWhatItHolds) {
  const TemporaryFolder folder;
  const Surface surface = sample_surface(sample_camera());
  Parameters parameters;
  parameters.method = Method::stable;
  parameters.fit.tau = 0.5;
  write_exr(folder / "a.exr", surface, parameters);
  const Imf::InputFile file((folder / "a.exr").c_str());
  const Imf::Header& header = file.header();

  std::vector<std::string> names;
  for (auto c = header.channels().begin(); c != header.channels().end(); ++c)
    names.push_back(c.name());
  EXPECT_THAT(names, testing::UnorderedElementsAre("Z", "A", "N.X", "N.Y", "N.Z", "P.X", "P.Y",
                                                   "P.Z", "id", "kind", "residual"));
  const Imath::Box2i window({0, 0}, {60, 46});
  EXPECT_EQ(header.dataWindow(), window);
  EXPECT_EQ(header.displayWindow(), window);
  EXPECT_EQ(header.lineOrder(), Imf::INCREASING_Y);
  EXPECT_EQ(header.compression(), Imf::ZIP_COMPRESSION);

  const auto text = [&](const char* name) {
    return header.typedAttribute<Imf::StringAttribute>(name).value();
  };
  EXPECT_EQ(text("software"), "Meniscus " + version());
  EXPECT_EQ(text("meniscus.method"), "stable");
  EXPECT_EQ(text("meniscus.parameters"), describe(parameters));
  for (const char* word : {"Z:", "N.X N.Y N.Z:", "P.X P.Y P.Z:", "id:", "kind:", "residual:", "A:",
                           "world space", "world units", "infinity", "particle radii"})
    EXPECT_THAT(text("comments"), HasSubstr(word));
  EXPECT_EQ(header.typedAttribute<Imf::DoubleAttribute>("meniscus.particleRadius").value(), 0.05);
  const auto& view = header.typedAttribute<Imf::M44dAttribute>("meniscus.view").value();
  const auto& projection = header.typedAttribute<Imf::M44dAttribute>("meniscus.projection").value();
  for (int k = 0; k < 16; ++k) {
    EXPECT_EQ(view[k / 4][k % 4], surface.camera.view[k]);
    EXPECT_EQ(projection[k / 4][k % 4], surface.camera.projection[k]);
  }
}

// A projection of an image twice as wide as high, on as many rows as columns.
TEST(Exr, HeaderSaysHowWidePixelsAre) {
  const TemporaryFolder folder;
  const auto ratio_of = [&](double columns) {
    Camera camera = sample_camera(64, 64);
    camera.projection = {1, 0, 0, 0, 0, columns, 0, 0, 0, 0, -1.1, -0.2, 0, 0, -1, 0};
    write_exr(folder / "a.exr", sample_surface(camera), {});
    return Imf::InputFile((folder / "a.exr").c_str()).header().pixelAspectRatio();
  };
  EXPECT_EQ(ratio_of(1), 1);
  EXPECT_EQ(ratio_of(1.01), 1) << "sides are rounded to pixels";
  EXPECT_EQ(ratio_of(2), 2);
  EXPECT_EQ(ratio_of(0.5), 0.5f);
  EXPECT_EQ(ratio_of(-2), 2) << "upside down";
}

// The standard matrices as OpenEXR defines them: row vectors; camera space left-handed, +z forward,
// y up; NDC (0, 0) upper left, (1, 1) lower right.
void expect_standard_matrices(const Camera& camera) {
  const TemporaryFolder folder;
  const Surface surface = sample_surface(camera);
  write_exr(folder / "a.exr", surface, {});
  const Imf::InputFile file((folder / "a.exr").c_str());
  const Imath::M44f to_camera = Imf::worldToCamera(file.header());
  const Imath::M44f to_ndc = Imf::worldToNDC(file.header());
  EXPECT_LT(to_camera.determinant(), 0);  // a rigid view, mirrored
  int checked = 0;
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column) {
      const std::size_t k = static_cast<std::size_t>(row) * camera.width + column;
      if (surface.kind[k] == Kind::none) continue;
      const Vec3& p = surface.position[k];
      Imath::V3f eye, ndc;
      to_camera.multVecMatrix(Imath::V3f(p.x, p.y, p.z), eye);
      to_ndc.multVecMatrix(Imath::V3f(p.x, p.y, p.z), ndc);
      // Floats of size up to 4 (positions, entries, sums): a dozen roundings of 2^-24 * 4 each,
      // below 4e-6; for NDC the same over w >= 1.
      ASSERT_NEAR(eye.z, surface.depth[k], 4e-6);
      ASSERT_NEAR(ndc.x * camera.width, column + 0.5, 4e-6 * camera.width);
      ASSERT_NEAR(ndc.y * camera.height, row + 0.5, 4e-6 * camera.height);
      const auto& m = camera.view;
      ASSERT_NEAR(eye.x, m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3], 4e-6);
      ASSERT_NEAR(eye.y, m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7], 4e-6);
      ++checked;
    }
  EXPECT_GT(checked, 500);
}

TEST(Exr, StandardMatricesMapPositionsToPixelsAndDepth) {
  expect_standard_matrices(sample_camera());
}

TEST(Exr, StandardMatricesOfAnOrthographicCamera) {
  Camera camera = sample_camera(64, 48);
  camera.projection = {0.7, 0, 0, 0.1, 0, 0.9, 0, -0.05, 0, 0, -0.2, -1, 0, 0, 0, 1};
  expect_standard_matrices(camera);
}

TEST(Exr, SameBytesWithAnyNumberOfThreads) {
  const TemporaryFolder folder;
  const Surface surface = sample_surface(sample_camera(200, 150));
  const int threads = Imf::globalThreadCount();
  for (const auto compression : {Compression::zip, Compression::piz}) {
    Imf::setGlobalThreadCount(0);
    write_exr(folder / "a.exr", surface, {}, compression);
    Imf::setGlobalThreadCount(3);
    write_exr(folder / "b.exr", surface, {}, compression);
    EXPECT_TRUE(file_bytes(folder / "a.exr") == file_bytes(folder / "b.exr"));
  }
  Imf::setGlobalThreadCount(threads);
}

TEST(Exr, AnEmptySurfaceIsAValidFile) {
  const TemporaryFolder folder;
  Camera away = sample_camera(5, 3);
  away.view[11] += 100;  // everything is behind the eye
  const Surface surface = sample_surface(away);
  write_exr(folder / "a.exr", surface, {});
  Imf::InputFile file((folder / "a.exr").c_str());
  EXPECT_THAT(read_channel<float>(file, "Z", Imf::FLOAT),
              testing::Each(std::numeric_limits<float>::infinity()));
  EXPECT_THAT(read_channel<float>(file, "A", Imf::FLOAT), testing::Each(0.0f));
}

TEST(Exr, RefusesMapsOfAnotherSize) {
  const TemporaryFolder folder;
  Surface surface = sample_surface(sample_camera());
  surface.residual.pop_back();
  EXPECT_THROW(write_exr(folder / "a.exr", surface, {}), InvalidArgument);
  EXPECT_THROW(write_exr(folder / "a.exr", Surface{}, {}), InvalidArgument);
  EXPECT_THAT(folder.entries(), testing::IsEmpty());
}

// --- reading it back

TEST(ExrReader, ReturnsEveryMapTheCameraAndTheTexts) {
  const TemporaryFolder folder;
  Surface surface = sample_surface(sample_camera());
  surface.disorder = 0.25;
  Parameters parameters;
  parameters.fit.tau = 0.5;
  for (const auto compression : {Compression::none, Compression::rle, Compression::zips,
                                 Compression::zip, Compression::piz}) {
    write_exr(folder / "a.exr", surface, parameters, compression);
    std::map<std::string, std::string> texts;
    const Surface back = read_exr(folder / "a.exr", &texts);
    EXPECT_TRUE(same_bits(back.depth, surface.depth));
    EXPECT_TRUE(same_bits(back.normal, surface.normal));
    EXPECT_TRUE(same_bits(back.position, surface.position));
    EXPECT_EQ(back.group, surface.group);
    EXPECT_EQ(back.kind, surface.kind);
    EXPECT_TRUE(same_bits(back.residual, surface.residual));
    EXPECT_EQ(back.camera.width, surface.camera.width);
    EXPECT_EQ(back.camera.height, surface.camera.height);
    EXPECT_EQ(back.camera.view, surface.camera.view);
    EXPECT_EQ(back.camera.projection, surface.camera.projection);
    EXPECT_EQ(back.particle_radius, surface.particle_radius);
    EXPECT_EQ(back.disorder, surface.disorder);
    EXPECT_EQ(texts["software"], "Meniscus " + version());
    EXPECT_EQ(texts["meniscus.parameters"], describe(parameters));
  }
}

TEST(ExrReader, NoBeginningOfAFileIsRead) {
  const TemporaryFolder folder;
  write_exr(folder / "a.exr", sample_surface(sample_camera(9, 37)), {});
  const std::string bytes = file_bytes(folder / "a.exr");
  for (std::size_t size = 0; size < bytes.size(); size += 11) {
    std::ofstream(folder / "b.exr", std::ios::binary) << bytes.substr(0, size);
    ASSERT_THROW(read_exr(folder / "b.exr"), InputError) << size << " of " << bytes.size();
  }
}

std::string reading_error(const std::string& path) {
  return text_of_thrown<InputError>([&] { read_exr(path); });
}

TEST(ExrReader, SaysWhereAFileIsCutOff) {
  const TemporaryFolder folder;
  write_exr(folder / "a.exr", sample_surface(sample_camera(40, 40)), {}, Compression::none);
  const std::string bytes = file_bytes(folder / "a.exr");
  // A row is 11 channels of 4 bytes, its number and its size.
  const std::size_t row = 40 * 11 * 4 + 8;
  std::ofstream(folder / "b.exr", std::ios::binary) << bytes.substr(0, bytes.size() - 5 * row - 1);
  EXPECT_THAT(reading_error(folder / "b.exr"),
              testing::AllOf(testing::StartsWith((folder / "b.exr") + ": row 34: "),
                             HasSubstr("ends at byte")));
}

TEST(ExrReader, SurvivesAnyDamage) {
  const TemporaryFolder folder;
  write_exr(folder / "a.exr", sample_surface(sample_camera(9, 20)), {});
  const std::string bytes = file_bytes(folder / "a.exr");
  for (std::size_t at = 0; at < bytes.size(); at += 13)
    for (const int flip : {0x01, 0x80}) {
      std::string damaged = bytes;
      damaged[at] = static_cast<char>(damaged[at] ^ flip);
      std::ofstream(folder / "b.exr", std::ios::binary) << damaged;
      reading_error(folder / "b.exr");  // nothing but InputError leaves it
    }
}

TEST(ExrReader, RefusesForeignFiles) {
  const TemporaryFolder folder;
  EXPECT_THAT(reading_error(folder / "none.exr"), HasSubstr("none.exr: cannot be opened"));
  std::ofstream(folder / "a.exr") << "not an EXR";
  EXPECT_THAT(reading_error(folder / "a.exr"), HasSubstr("no EXR"));
  {
    Imf::Header header(4, 3);
    header.channels().insert("R", Imf::Channel(Imf::FLOAT));
    const std::vector<float> red(12);
    Imf::FrameBuffer frame;
    frame.insert(
        "R", Imf::Slice(Imf::FLOAT, const_cast<char*>(reinterpret_cast<const char*>(red.data())),
                        sizeof(float), 4 * sizeof(float)));
    Imf::OutputFile file((folder / "a.exr").c_str(), header);
    file.setFrameBuffer(frame);
    file.writePixels(3);
  }
  EXPECT_THAT(reading_error(folder / "a.exr"), HasSubstr("wanted an EXR of Meniscus"));
}

TEST(ExrReader, RefusesPixelsThatTheFileCannotHold) {
  const TemporaryFolder folder;
  write_exr(folder / "a.exr", sample_surface(sample_camera(9, 20)), {});
  std::string bytes = file_bytes(folder / "a.exr");
  for (const char* window : {"dataWindow", "displayWindow"}) {
    const std::size_t at =
        bytes.find(std::string(window) + '\0' + "box2i") + std::strlen(window) + 11;
    for (const std::size_t side : {at + 8, at + 12}) bytes.replace(side, 4, "\xff\x3f\0\0", 4);
  }
  std::ofstream(folder / "b.exr", std::ios::binary) << bytes;
  EXPECT_THAT(reading_error(folder / "b.exr"),
              HasSubstr("bytes cannot hold the 16384x16384 pixels of its header"));
}

TEST(ExrReader, RefusesAnAttributeThatTheFileCannotHold) {
  const TemporaryFolder folder;
  write_exr(folder / "a.exr", sample_surface(sample_camera(9, 20)), {});
  std::string bytes = file_bytes(folder / "a.exr");
  const std::string name("software\0string", 15);
  bytes.replace(bytes.find(name) + name.size() + 1, 4, "\xf0\xff\xff\x7f");
  std::ofstream(folder / "b.exr", std::ios::binary) << bytes;
  EXPECT_THAT(reading_error(folder / "b.exr"), HasSubstr("ends in an attribute of its header"));
}

// OpenEXR reads as many bytes as the type has, whatever the file states, and takes what follows for
// the next attribute.
TEST(ExrReader, RefusesAnAttributeThatIsNotOfTheSizeOfItsType) {
  const TemporaryFolder folder;
  write_exr(folder / "a.exr", sample_surface(sample_camera(9, 20)), {});
  const std::string bytes = file_bytes(folder / "a.exr");
  const auto refused = [&](const std::string& type, const std::string& size) {
    std::string other = bytes;
    const std::size_t at = bytes.find(type + '\0') + type.size() + 1;
    other.replace(at, 4, size);
    std::ofstream(folder / "b.exr", std::ios::binary) << other;
    EXPECT_THAT(reading_error(folder / "b.exr"), HasSubstr("has type \"" + type)) << type;
  };
  for (const char* type : {"box2i", "double", "m44d"}) refused(type, std::string("\x10\1\0\0", 4));
  refused("chlist", std::string("\x05\0\0\0", 4));
}

TEST(ExrReader, ReadsALargeImageWithoutASurface) {
  const TemporaryFolder folder;  // nothing packs better
  Surface surface = sample_surface(sample_camera(2048, 2048));
  std::fill(surface.depth.begin(), surface.depth.end(), INFINITY);
  for (auto* map : {&surface.normal, &surface.position})
    std::fill(map->begin(), map->end(), Vec3{});
  std::fill(surface.group.begin(), surface.group.end(), 0);
  std::fill(surface.kind.begin(), surface.kind.end(), Kind::none);
  std::fill(surface.residual.begin(), surface.residual.end(), 0.0f);
  for (const auto compression : {Compression::rle, Compression::zips, Compression::zip,
                                 Compression::piz, Compression::pxr24}) {
    write_exr(folder / "a.exr", surface, {}, compression);
    EXPECT_EQ(read_exr(folder / "a.exr").depth.size(), 2048u * 2048);
  }
}

TEST(Exr, WhitewaterIsAddedAndChangesNothingElse) {
  const TemporaryFolder folder;
  Surface surface = sample_surface(sample_camera());
  surface.mesh = {};
  const std::size_t pixels = surface.depth.size();
  for (const WhitewaterType type : {WhitewaterType::foam, WhitewaterType::bubble}) {
    WhitewaterMaps& maps = surface.whitewater.emplace_back();
    maps.type = type;
    const float first = type == WhitewaterType::foam ? 0 : 0.5f;
    for (std::size_t p = 0; p < pixels; ++p) {
      const float value = first + 0.4f * static_cast<float>(p) / static_cast<float>(pixels);
      maps.coverage.push_back(value);
      maps.density.push_back(2 * value);
      maps.depth.push_back(p % 3 == 0 ? INFINITY : 3 + value);
      if (type == WhitewaterType::foam) maps.velocity.push_back({value, -value, 1});
      if (type == WhitewaterType::bubble) maps.behind.push_back(7 * value);
    }
  }
  write_exr(folder / "a.exr", surface, {});
  Imf::InputFile file((folder / "a.exr").c_str());
  const WhitewaterMaps &foam = surface.whitewater[0], &bubble = surface.whitewater[1];
  EXPECT_EQ(read_channel<float>(file, "foam.coverage", Imf::FLOAT), foam.coverage);
  EXPECT_EQ(read_channel<float>(file, "foam.density", Imf::FLOAT), foam.density);
  EXPECT_EQ(read_channel<float>(file, "foam.Z", Imf::FLOAT), foam.depth);
  EXPECT_EQ(read_channel<float>(file, "foam.V.Y", Imf::FLOAT), component(foam.velocity, &Vec3::y));
  EXPECT_EQ(read_channel<float>(file, "bubble.behind", Imf::FLOAT), bubble.behind);
  EXPECT_EQ(file.header().channels().findChannel("foam.behind"), nullptr);
  EXPECT_EQ(file.header().channels().findChannel("bubble.V.X"), nullptr);
  for (const char* word : {"*.coverage:", "*.density:", "bubble.behind:"})
    EXPECT_THAT(Imf::comments(file.header()), HasSubstr(word));
  const Surface read = read_exr(folder / "a.exr");
  EXPECT_TRUE(same_bits(read, surface));
  ASSERT_EQ(read.whitewater.size(), 2u);
  EXPECT_TRUE(same_bits(read.whitewater[0], foam));
  EXPECT_TRUE(same_bits(read.whitewater[1], bubble));

  surface.whitewater[1].behind.pop_back();
  EXPECT_THROW(write_exr(folder / "b.exr", surface, {}), InvalidArgument);
}

TEST(Exr, LayersAreAddedAndChangeNothingElse) {
  const TemporaryFolder folder;
  const Surface layered = layered_surface(sample_camera(), 2);
  write_exr(folder / "a.exr", layered, {});
  Imf::InputFile file((folder / "a.exr").c_str());
  const std::size_t pixels = layered.depth.size();
  const std::vector<float> back(layered.layers.exit.begin(),
                                layered.layers.exit.begin() + static_cast<std::ptrdiff_t>(pixels));
  EXPECT_TRUE(same_bits(read_channel<float>(file, "Z.back", Imf::FLOAT), back));
  EXPECT_EQ(read_channel<float>(file, "N.back.Z", Imf::FLOAT),
            component(layered.layers.back_normal, &Vec3::z));
  EXPECT_EQ(read_channel<float>(file, "thickness", Imf::FLOAT), layered.layers.thickness);
  EXPECT_EQ(read_channel<std::uint32_t>(file, "layers", Imf::UINT), layered.layers.count);
  EXPECT_EQ(read_channel<float>(file, "Z", Imf::FLOAT), layered.depth);
  for (const char* word : {"Z.back:", "N.back.X", "thickness:", "layers:"})
    EXPECT_THAT(Imf::comments(file.header()), HasSubstr(word));

  const Surface read = read_exr(folder / "a.exr");
  Surface maps = layered;
  maps.mesh = {};
  EXPECT_TRUE(same_bits(read, maps));
  EXPECT_EQ(read.layers.most, 1);
  EXPECT_TRUE(same_bits(read.layers.exit, back));
  EXPECT_TRUE(same_bits(read.layers.entry, layered.depth));
  EXPECT_TRUE(same_bits(read.layers.back_normal, layered.layers.back_normal));
  EXPECT_TRUE(same_bits(read.layers.thickness, layered.layers.thickness));
  EXPECT_TRUE(same_bits(read.layers.count, layered.layers.count));

  Surface wrong = layered;
  wrong.layers.exit.pop_back();
  EXPECT_THROW(write_exr(folder / "b.exr", wrong, {}), InvalidArgument);
  EXPECT_THROW(write_deep_exr(folder / "b.deep.exr", wrong, {}), InvalidArgument);
  EXPECT_THROW(write_deep_exr(folder / "b.deep.exr", sample_surface(sample_camera()), {}),
               InvalidArgument);
}

}  // namespace
}  // namespace meniscus
