#include <gmock/gmock.h>
#include <zlib.h>

#include <vector>

#include "io/io_test_support.hpp"

namespace meniscus {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class Bgeo : public InputTest {};

std::string packed(const std::string& bytes) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string result(deflateBound(&stream, bytes.size()) + 64, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(result.data());
  stream.avail_out = static_cast<uInt>(result.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  result.resize(stream.total_out);
  deflateEnd(&stream);
  return result;
}

template <class T>
std::string big(T value) {
  return stored(value, std::endian::big);
}

std::string text(const std::string& value) {
  return big(static_cast<std::uint16_t>(value.size())) + value;
}

std::string header(std::int32_t points, std::int32_t attributes, std::int32_t version = 5) {
  std::string bytes = "BgeoV" + big(version) + big(points);
  for (std::int32_t count : {0, 0, 0, attributes, 0, 0, 0}) bytes += big(count);
  return bytes;
}

std::string attribute(const std::string& name, int size, int type) {
  std::string bytes = text(name) + big(static_cast<std::uint16_t>(size)) + big(type);
  for (int i = 0; i < size; ++i) bytes += big(0);
  return bytes;
}

/// Three points with all kinds of attributes; the second radius is `radius`.
std::string three_points(float radius = 0.2f) {
  std::string bytes = header(3, 6) + attribute("id", 1, 1) + text("material") +
                      big(std::uint16_t(1)) + big(4) + big(2) + text("water") + text("") +
                      attribute("v", 3, 5) + attribute("pscale", 1, 0) + attribute("Cd", 3, 0) +
                      attribute("density", 1, 0);
  for (int i = 0; i < 3; ++i) {
    const float f = static_cast<float>(i);
    for (float value : {f, 10 + f, 20 + f, 1.0f}) bytes += big(value);
    bytes += big(i - 1) + big(0);
    for (float value : {f, 2 * f, 3 * f, i == 1 ? radius : 0.1f, 0.f, 0.f, 1.f, 1000 - f})
      bytes += big(value);
  }
  return bytes + std::string("\x00\xff", 2);
}

TEST_F(Bgeo, ReadsAFileOfASimulator) {
  // Known values as a decoder of a few lines in another language reads them.
  const Particles p = read_particles(test_data("splashsurf/dam_break_frame_9_6859_particles.bgeo"));
  ASSERT_EQ(p.size(), 6859u);
  EXPECT_EQ(p.x[0], -1.910224199295044f);
  EXPECT_EQ(p.y[0], 0.05864475294947624f);
  EXPECT_EQ(p.id[0], 30);
  EXPECT_EQ(p.density[0], 1000.1286010742188f);
  EXPECT_EQ(p.vx[0], 0.3670507073402405f);
  EXPECT_EQ(p.z.back(), 0.05060062184929848f);
  EXPECT_EQ(p.id.back(), 6489);
  EXPECT_EQ(p.vy.back(), -2.4216198921203613f);
  EXPECT_TRUE(p.radius.empty());
}

TEST_F(Bgeo, ReadsPlainAndPacked) {
  const std::string plain = three_points();
  for (const auto& [name, bytes] :
       {std::pair<std::string, std::string>{"a.bgeo", plain},
        {"a.bgeo", packed(plain)},
        {"a.bgeo.gz", packed(plain)},
        {"a.bgeo.gz", packed(plain.substr(0, 100)) + packed(plain.substr(100))}}) {
    const Particles p = read(name, bytes);
    EXPECT_THAT(p.x, ElementsAre(0, 1, 2));
    EXPECT_THAT(p.z, ElementsAre(20, 21, 22));
    EXPECT_THAT(p.vz, ElementsAre(0, 3, 6));
    EXPECT_THAT(p.id, ElementsAre(-1, 0, 1));
    EXPECT_THAT(p.radius, ElementsAre(0.1f, 0.2f, 0.1f));
    EXPECT_THAT(p.density, ElementsAre(1000, 999, 998));
  }
}

TEST_F(Bgeo, AVelocityOfWholeNumbersIsNotReadAsFloats) {
  std::string bytes = header(1, 1) + attribute("v", 3, 1);
  for (const float value : {1.0f, 2.0f, 3.0f, 1.0f}) bytes += big(value);
  for (const std::int32_t value : {4, -5, 6}) bytes += big(value);
  const Particles p = read("a.bgeo", bytes + std::string("\x00\xff", 2));
  EXPECT_THAT(p.z, ElementsAre(3));
  EXPECT_THAT(p.vx, ElementsAre(4));
  EXPECT_THAT(p.vy, ElementsAre(-5));
  EXPECT_THAT(p.vz, ElementsAre(6));
}

TEST_F(Bgeo, ZeroPointsAreFine) {
  EXPECT_EQ(read("a.bgeo", header(0, 0) + std::string("\x00\xff", 2)).size(), 0u);
}

TEST_F(Bgeo, ACutOfTheDataIsAnError) {
  const std::string plain = three_points();
  const Particles whole = read("a.bgeo", plain);
  // The last two bytes close the file and belong to no point.
  EXPECT_EQ(cut_everywhere("a.bgeo", plain,
                           [&](const Particles& p, std::size_t length) {
                             return length >= plain.size() - 2 && same(p, whole);
                           }),
            2);
  EXPECT_EQ(
      cut_everywhere("a.bgeo", packed(plain), [](const Particles&, std::size_t) { return false; }),
      0);
}

TEST_F(Bgeo, DamageIsAnErrorOrReads) {
  flip_bits("a.bgeo", three_points());
  flip_bits("a.bgeo.gz", packed(three_points()));
}

TEST_F(Bgeo, SaysWhatIsWrong) {
  EXPECT_EQ(error_of("a.bgeo", "Bgeo5 no"),
            "a.bgeo: byte 0: found \"Bgeo5\", wanted \"BgeoV\" (classic bgeo)");
  EXPECT_THAT(error_of("a.bgeo", "\x7fNSJb"), HasSubstr("the data ends here"));
  EXPECT_THAT(error_of("a.bgeo", "[\"fileversion\""), HasSubstr("is Houdini's JSON as text"));
  EXPECT_THAT(error_of("a.bgeo.sc", "Bgeo5"), HasSubstr("wanted \"scf1\""));
  EXPECT_THAT(error_of("a.bgeo", header(0, 0, 4)), HasSubstr("found version 4, wanted 5"));
  EXPECT_THAT(error_of("a.bgeo", header(-1, 0)),
              HasSubstr("found -1 for the number of points, must be >= 0"));
  EXPECT_THAT(error_of("a.bgeo", header(2000000000, 0) + "1234"),
              HasSubstr("point 0: the data ends at byte 45, wanted 2000000000 points of 16 bytes"));
  EXPECT_THAT(error_of("a.bgeo", header(0, 2000000000)),
              HasSubstr("the file ends inside the name of a point attribute"));
  EXPECT_THAT(error_of("a.bgeo", header(1, 1) + attribute("path", 4, 2)),
              HasSubstr("found type 2 of point attribute \"path\""));
  EXPECT_THAT(error_of("a.bgeo", packed(three_points()).substr(0, 60)),
              HasSubstr("byte 60: the file ends inside its gzip data"));
  EXPECT_THAT(error_of("a.bgeo", packed(three_points()) + "garbage"), HasSubstr("gzip data"));
  EXPECT_THAT(error_of("a.bgeo", packed(three_points().substr(0, 80))),
              HasSubstr("of the unpacked data"));
  EXPECT_EQ(error_of("a.bgeo", three_points(0)),
            "a.bgeo: point 1: radius is 0, must be > 0 and finite (give particle_radius to "
            "override)");
}

TEST_F(Bgeo, RefusesWhatUnpacksToAThousandTimesItsSize) {
  const std::string bomb = packed(header(3'000'000, 0) + std::string(48'000'000, '\0'));
  ASSERT_LT(bomb.size(), 60'000u);
  EXPECT_THAT(error_of("a.bgeo.gz", bomb), HasSubstr("unpacks to more than 100 times its size"));
}

// Houdini's binary JSON.
std::string json_number(std::int32_t value) { return "\x13" + stored(value, std::endian::little); }
std::string json_text(const std::string& value) {
  return "\x27" + std::string(1, static_cast<char>(value.size())) + value;
}
std::string json_list(const std::vector<std::string>& items) {
  std::string bytes = "[";
  for (const std::string& item : items) bytes += item;
  return bytes + "]";
}
std::string json_geometry(std::int32_t points, const std::vector<std::string>& attributes) {
  return "\x7fNSJb" +
         json_list({json_text("pointcount"), json_number(points), json_text("attributes"),
                    json_list({json_text("pointattributes"), json_list(attributes)})});
}
std::string json_attribute(const std::string& name, std::int32_t size, const std::string& kind,
                           const std::string& values) {
  return json_list(
      {json_list({json_text("name"), json_text(name), json_text("type"), json_text("numeric")}),
       json_list({json_text("size"), json_number(size), json_text("values"),
                  json_list({json_text(kind), values})})});
}
std::string json_position() {
  return json_attribute("P", 3, "tuples",
                        json_list({json_list({json_number(1), json_number(2), json_number(3)})}));
}

TEST_F(Bgeo, ATextThatIsUsedOftenIsKeptOnce) {
  constexpr std::uint32_t kLong = 1 << 20;
  std::string bytes = std::string("\x7fNSJb\x2b\x00\xf4", 8) + stored(kLong, std::endian::little) +
                      std::string(kLong, 'a');
  std::vector<std::string> uses(500, std::string("\x26\x00", 2));
  bytes += json_list(uses);
  const Cost cost = cost_of([&] { EXPECT_THAT(error_of("a.bgeo", bytes), HasSubstr("points")); });
  EXPECT_LT(cost.megabytes, 200);  // 500 without
}

TEST_F(Bgeo, ConstantPagesMakeNoGigabytesOfAFewBytes) {
  const std::string numbers = json_list(std::vector<std::string>(64, json_number(1)));
  const std::string wide = json_list(
      {json_list({json_text("name"), json_text("w"), json_text("type"), json_text("numeric")}),
       json_list({json_text("size"), json_number(64), json_text("values"),
                  json_list({json_text("rawpagedata"), numbers, json_text("constantpageflags"),
                             json_list({json_list({json_number(1)})})})})});
  EXPECT_THAT(error_of("a.bgeo", json_geometry(60000, {wide})),
              HasSubstr("attribute w: states that it has 30720000 bytes"));
  // Each alone would be fine.
  EXPECT_THAT(error_of("a.bgeo", json_geometry(20000, {wide, wide})),
              HasSubstr("attribute w: states that it has 20480000 bytes"));
}

TEST_F(Bgeo, AttributesWithLongNamesAreFound) {
  const std::string name(50, 'n');
  const std::string path =
      write("a.bgeo", json_geometry(1, {json_position(),
                                        json_attribute(name, 1, "arrays",
                                                       json_list({json_list({json_number(7)})}))}));
  const Particles p = read_particles(path, ReadOptions{.attributes = {name}});
  ASSERT_EQ(p.attributes.size(), 1u);
  EXPECT_EQ(p.attributes[0].name, name);
  EXPECT_THAT(p.attributes[0].values, ElementsAre(7));
}

}  // namespace
}  // namespace meniscus
