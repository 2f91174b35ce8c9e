#include <gmock/gmock.h>

#include <cmath>

#include "cost.hpp"
#include "io/io_test_support.hpp"
#include "io/rows.hpp"

namespace meniscus {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class Ply : public InputTest {};

constexpr auto kLittle = std::endian::little;
constexpr auto kBig = std::endian::big;

std::string format_name(std::endian order) {
  return order == kLittle ? "binary_little_endian" : "binary_big_endian";
}

const std::string kAscii =
    "ply\n"
    "format ascii 1.0\n"
    "comment time 0.25 particle_radius 0.05\n"
    "element vertex 3\n"
    "property float x\n"
    "property double y\n"
    "property float z\n"
    "property list uchar int neighbours\n"
    "property float radius\n"
    "property int id\n"
    "element face 1\n"
    "property list uchar int vertex_indices\n"
    "end_header\n"
    "0.5 1 2 2 7 8 0.1 12\n"
    "-1e-3 nan +4 0 0.2 -5\n"
    "inf 1.5 2.5 1 9 0.3 9007199254740993\n"
    "3 0 1 2\n";

/// Every kind of scalar, a list amid the vertex, elements before and after it.
std::string every_type(std::endian order) {
  std::string bytes = "ply\r\nformat " + format_name(order) +
                      " 1.0\r\n"
                      "element camera 2\r\nproperty double fov\r\nproperty uchar on\r\n"
                      "element vertex 2\r\n"
                      "property double X\r\nproperty short y\r\nproperty uint8 z\r\n"
                      "property list ushort double weights\r\n"
                      "property int8 v_x\r\nproperty uint16 v_y\r\nproperty int v_z\r\n"
                      "property uint rho\r\nproperty int64 id\r\nproperty float pscale\r\n"
                      "property uint64 flags\r\n"
                      "element tail 1\r\nproperty list int float values\r\n"
                      "end_header\r\n";
  for (int i = 0; i < 2; ++i) bytes += stored(45.0, order) + stored(std::uint8_t(1), order);
  for (int i = 0; i < 2; ++i) {
    bytes += stored(0.5 + i, order) + stored(std::int16_t(-300 - i), order) +
             stored(std::uint8_t(200 + i), order);
    bytes += stored(std::uint16_t(i), order);
    if (i == 1) bytes += stored(3.25, order);
    bytes += stored(std::int8_t(-7), order) + stored(std::uint16_t(60000), order) +
             stored(std::int32_t(-70000), order) + stored(std::uint32_t(4000000000u), order) +
             stored(std::int64_t(-9007199254740993 - i), order) + stored(0.125f, order) +
             stored(~std::uint64_t(0), order);
  }
  return bytes + stored(std::int32_t(1), order) + stored(2.5f, order);
}

/// n vertices x y z with a radius; the radius of `bad` is -0.01.
std::string with_radius(int n, int bad) {
  std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(n) +
                      "\nproperty float x\nproperty float y\nproperty float z\n"
                      "property float radius\nend_header\n";
  for (int i = 0; i < n; ++i)
    for (float value : {1.0f * i, 2.0f, 3.0f, i == bad ? -0.01f : 0.025f})
      bytes += stored(value, kLittle);
  return bytes;
}

std::string one_vertex(const std::string& header) {
  return "ply\nformat ascii 1.0\n" + header + "end_header\n1 2 3\n";
}

TEST_F(Ply, ReadsAFrameOfASimulator) {
  const Particles p = read_particles(test_data("dam_4913.ply"));
  ASSERT_EQ(p.size(), 4913u);
  EXPECT_EQ(p.time, 0.602865);
  EXPECT_EQ(p.particle_radius, 0.025);
  ASSERT_EQ(p.vz.size(), 4913u);
  EXPECT_TRUE(p.density.empty() && p.radius.empty() && p.id.empty());
  // The last vertex as the file's last 24 bytes have it.
  const std::string bytes = content(test_data("dam_4913.ply"));
  float last[6];
  std::memcpy(last, bytes.data() + bytes.size() - sizeof last, sizeof last);
  EXPECT_EQ(p.x.back(), last[0]);
  EXPECT_EQ(p.vz.back(), last[5]);
}

TEST_F(Ply, ReadsAscii) {
  const Particles p = read("a.ply", kAscii);
  ASSERT_EQ(p.size(), 3u);
  EXPECT_THAT(p.x, ElementsAre(0.5f, -1e-3f, INFINITY));
  EXPECT_TRUE(std::isnan(p.y[1]));
  EXPECT_THAT(p.z, ElementsAre(2, 4, 2.5f));
  EXPECT_THAT(p.radius, ElementsAre(0.1f, 0.2f, 0.3f));
  EXPECT_THAT(p.id, ElementsAre(12, -5, 9007199254740993));
  EXPECT_EQ(p.time, 0.25);
  EXPECT_EQ(p.particle_radius, 0.05);
}

TEST_F(Ply, ReadsEveryTypeInBothByteOrders) {
  for (const std::endian order : {kLittle, kBig}) {
    const Particles p = read("a.PLY", every_type(order));
    EXPECT_THAT(p.x, ElementsAre(0.5f, 1.5f));
    EXPECT_THAT(p.y, ElementsAre(-300, -301));
    EXPECT_THAT(p.z, ElementsAre(200, 201));
    EXPECT_THAT(p.vx, ElementsAre(-7, -7));
    EXPECT_THAT(p.vy, ElementsAre(60000, 60000));
    EXPECT_THAT(p.vz, ElementsAre(-70000, -70000));
    EXPECT_THAT(p.density, ElementsAre(4e9f, 4e9f));
    EXPECT_THAT(p.id, ElementsAre(-9007199254740993, -9007199254740994));
    EXPECT_THAT(p.radius, ElementsAre(0.125f, 0.125f));
  }
}

TEST_F(Ply, ReadsLinesThatEndInALoneReturn) {
  // The first data byte is \n, as the first byte of 10.0f can be.
  std::string header =
      "ply\rformat binary_little_endian 1.0\relement vertex 1\r"
      "property uchar x\rproperty uchar y\rproperty uchar z\rend_header\r";
  const Particles p = read("a.ply", header + "\n\x02\x03");
  EXPECT_THAT(p.x, ElementsAre(10));
  EXPECT_THAT(p.z, ElementsAre(3));
}

TEST_F(Ply, WordsInCommentsAreLeftAlone) {
  const Particles p = read("a.ply", one_vertex("comment made the first time 2nd try\n"
                                               "comment the particle_radius is half the spacing\n"
                                               "element vertex 1\nproperty float x\n"
                                               "property float y\nproperty float z\n"));
  EXPECT_EQ(p.particle_radius, 0);
  EXPECT_EQ(p.time, 0);
}

TEST_F(Ply, FacesMakeItAMesh) {
  const std::string points =
                        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
                        "property float y\nproperty float z\n",
                    list = "property list uchar int vertex_indices\nend_header\n1 2 3\n";
  EXPECT_TRUE(has_faces(write("a.ply", points + "element face 1\n" + list + "3 0 0 0\n")));
  EXPECT_FALSE(has_faces(write("a.ply", points + "element face 0\n" + list)));
  EXPECT_FALSE(has_faces(write("a.ply", points + "end_header\n1 2 3\n")));
  EXPECT_FALSE(has_faces(write("a.xyz", "1 2 3\n")));
  EXPECT_FALSE(has_faces("missing.ply"));
}

TEST_F(Ply, ZeroVerticesAreFine) { EXPECT_EQ(read("a.ply", with_radius(0, -1)).size(), 0u); }

TEST_F(Ply, LeavesOutAVelocityThatLacksAComponent) {
  const Particles p = read("a.ply",
                           "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty "
                           "float y\nproperty float z\nproperty float vx\nend_header\n1 2 3 4\n");
  EXPECT_EQ(p.size(), 1u);
  EXPECT_TRUE(p.vx.empty());
}

TEST_F(Ply, AnyCutIsAnError) {
  const auto nothing = [](const Particles&, std::size_t) { return false; };
  EXPECT_EQ(cut_everywhere("a.ply", kAscii, nothing), 0);
  for (const std::endian order : {kLittle, kBig})
    EXPECT_EQ(cut_everywhere("a.ply", every_type(order), nothing), 0);
}

TEST_F(Ply, DamageIsAnErrorOrReads) {
  flip_bits("a.ply", kAscii);
  flip_bits("a.ply", every_type(kLittle));
  flip_bits("a.ply", every_type(kBig));
}

TEST_F(Ply, SaysWhereARadiusIsWrong) {
  EXPECT_EQ(error_of("wave.ply", with_radius(900, 812)),
            "wave.ply: vertex 812: radius is -0.01, must be > 0 and finite (give "
            "particle_radius to override)");
  const Particles p = read("wave.ply", with_radius(900, 812), 0.03);
  EXPECT_TRUE(p.radius.empty());
  EXPECT_EQ(p.particle_radius, 0.03);
}

TEST_F(Ply, SaysWhereTheFileEnds) {
  const std::string bytes = with_radius(900, -1);
  const std::string message = error_of("a.ply", bytes.substr(0, bytes.size() - 17));
  EXPECT_THAT(message, HasSubstr("a.ply: vertex 898: the file ends at byte"));
  EXPECT_THAT(message, HasSubstr("wanted 900 rows of vertex"));
  EXPECT_THAT(error_of("a.ply", kAscii.substr(0, kAscii.size() - 1)),
              HasSubstr("line 17: the file ends right after \"2\""));
}

TEST_F(Ply, DoesNotBelieveAHugeCount) {
  for (const char* format : {"ascii", "binary_big_endian"})
    EXPECT_THAT(error_of("a.ply", std::string("ply\nformat ") + format +
                                      " 1.0\nelement vertex 1152921504606846976\nproperty float x\n"
                                      "property float y\nproperty float z\nend_header\n1 2 3\n"),
                HasSubstr("wanted 1152921504606846976 rows of vertex from byte"));
  // An element without properties takes no bytes, however many rows it claims.
  EXPECT_EQ(read("a.ply", one_vertex("element nothing 1152921504606846976\nelement vertex 1\n"
                                     "property float x\nproperty float y\nproperty float z\n"))
                .size(),
            1u);
}

TEST_F(Ply, SaysWhatIsWrongInTheHeader) {
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  EXPECT_EQ(error_of("a.ply", "\x89PNG\n"), "a.ply: line 1: found \"\\x89PNG\", wanted \"ply\"");
  EXPECT_THAT(error_of("a.ply", "ply\nformat binary 1.0\n"),
              HasSubstr("line 2: found format \"binary\", wanted ascii"));
  EXPECT_THAT(error_of("a.ply", "ply\nend_header\n"), HasSubstr("has no format line"));
  EXPECT_THAT(error_of("a.ply", one_vertex("")), HasSubstr("has no element vertex"));
  EXPECT_THAT(error_of("a.ply", one_vertex("element vertex -1\n")),
              HasSubstr("line 3: found \"element vertex -1\", wanted \"element NAME COUNT\""));
  EXPECT_THAT(error_of("a.ply", one_vertex("element vertex 1\nproperty float x\n")),
              HasSubstr("has no property y"));
  EXPECT_THAT(error_of("a.ply", one_vertex("element vertex 1\nproperty half x\n")),
              HasSubstr("line 4: unknown type \"half\" of property x"));
  EXPECT_THAT(error_of("a.ply", one_vertex("property float x\n")),
              HasSubstr("line 3: property before any element"));
  EXPECT_THAT(error_of("a.ply", one_vertex("element vertex 1\nproperty float\n")),
              HasSubstr("line 4: wanted \"property TYPE NAME\""));
  EXPECT_THAT(
      error_of("a.ply", one_vertex("element vertex 1\n" + xyz + "property list float int l\n")),
      HasSubstr("line 7: the length of list l must have a whole type"));
  EXPECT_THAT(error_of("a.ply", one_vertex("element vertex 1\n" + xyz + "element vertex 1\n")),
              HasSubstr("appears twice"));
  EXPECT_THAT(error_of("a.ply", one_vertex("elment vertex 1\n")),
              HasSubstr("line 3: unknown header line \"elment vertex 1\""));
  EXPECT_THAT(error_of("a.ply", one_vertex("comment particle_radius -2\nelement vertex 1\n" + xyz)),
              HasSubstr("particle_radius is -2, must be > 0 and finite (give particle_radius"));
  for (const char* const value : {"1e400", "-1e400", "1e-400"})
    EXPECT_THAT(error_of("a.ply", one_vertex(std::string("comment particle_radius ") + value +
                                             "\nelement vertex 1\n" + xyz)),
                HasSubstr(std::string("line 3: found \"") + value +
                          "\" for particle_radius, wanted a number of 64 bits"));
  EXPECT_THAT(error_of("a.ply", one_vertex("comment time 1e400\nelement vertex 1\n" + xyz)),
              HasSubstr("line 3: found \"1e400\" for time, wanted a number of 64 bits"));
}

TEST_F(Ply, SaysWhatIsWrongInTheData) {
  const std::string header =
      "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
  EXPECT_THAT(error_of("a.ply", "ply\nformat ascii 1.0\n" + header + "end_header\n1 2,5 3\n"),
              HasSubstr("line 8: found \"2,5\", wanted a number for property y of element vertex"));
  EXPECT_THAT(error_of("a.ply", one_vertex(header) + "4 5 6\n"),
              HasSubstr("line 9: found \"4\" after the last row"));
  EXPECT_THAT(error_of("a.ply", with_radius(2, -1) + "abc"),
              HasSubstr("3 bytes more than the header says"));
  EXPECT_THAT(error_of("a.ply", one_vertex(header + "property int id\n")
                                    .insert(0, "")
                                    .replace(one_vertex(header + "property int id\n").size() - 1, 1,
                                             " 1.5\n")),
              HasSubstr("found \"1.5\", wanted a whole number of 64 bits for property id"));
  std::string list = "ply\nformat binary_little_endian 1.0\n" + header +
                     "element face 1\nproperty list char int i\nend_header\n" +
                     std::string(12, '\0') + "\xff";
  EXPECT_THAT(error_of("a.ply", list), HasSubstr("face 0: the length of list i"));
}

TEST_F(Ply, LongNamesInTheHeaderTakeNoMoreRoomThanTheFile) {
  std::string bytes = "ply\nformat ascii 1.0\nelement " + std::string(100'000, 'e') + " 1\n";
  for (int k = 0; k < 10'000; ++k) bytes += "property int p" + std::to_string(k) + "\n";
  bytes += "element vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  for (int k = 0; k < 10'000; ++k) bytes += "0 ";
  bytes += "\n1 2 3\n";
  const std::string path = write("a.ply", bytes);
  EXPECT_LT(cost_of([&] { read_particles(path); }).megabytes, 300);  // once it was 1,000
}

TEST_F(Ply, ManyElementsTakeNoTimeToTellApart) {
  std::string bytes = "ply\nformat ascii 1.0\n";
  for (int k = 0; k < 100'000; ++k) bytes += "element e" + std::to_string(k) + " 0\n";
  bytes +=
      "element vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
      "1 2 3\n";
  const std::string path = write("a.ply", bytes);
  EXPECT_LT(cost_of([&] { read_particles(path); }).seconds, 8);  // each against each other: 16
}

TEST_F(Ply, NamesInMessagesAreShortAndSteerNoTerminal) {
  const std::string start = "ply\nformat ascii 1.0\nelement vertex 1\n";
  const std::string message = error_of(
      "a.ply", start + "property nil \x1b[2J" + std::string(100'000, 'n') + "\nend_header\n");
  EXPECT_THAT(message, HasSubstr("of property \\x1b[2Jnnn"));
  EXPECT_LT(message.size(), 300u);
  EXPECT_THAT(error_of("a.ply", start + "property float x\nproperty float y\nproperty float z\n"
                                        "property float \x1b[2J\nend_header\n1 2 3 x\n"),
              HasSubstr("wanted a number for property \\x1b[2J of element vertex"));
}

}  // namespace
}  // namespace meniscus
