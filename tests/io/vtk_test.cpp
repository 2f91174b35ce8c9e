#include <gmock/gmock.h>

#include <cmath>
#include <set>
#include <vector>

#include "io/io_test_support.hpp"

namespace meniscus {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class Vtk : public InputTest {};

/// A file built part by part. It may end after each part without a reader being able to know.
class VtkBytes {
 public:
  explicit VtkBytes(bool binary, const std::string& version = "3.0") : binary_(binary) {
    bytes = "# vtk DataFile Version " + version + "\nPOINTS 9 float\n" +
            (binary ? "BINARY" : "ASCII") + "\nDATASET UNSTRUCTURED_GRID\n";
  }
  VtkBytes& add(const std::string& text) {
    bytes += text;
    after_values_ = false;
    return *this;
  }
  template <class T>
  VtkBytes& values(const std::vector<T>& list) {
    for (const T value : list)
      bytes += binary_ ? stored(value, std::endian::big) : text_of(value) + " ";
    bytes += "\n";
    after_values_ = true;
    return *this;
  }
  VtkBytes& may_end() {
    ends.insert(bytes.size());
    // The line end after values is no part of them: in text each is followed by a blank.
    if (after_values_) ends.insert(bytes.size() - 1);
    return *this;
  }

  std::string bytes;
  std::set<std::size_t> ends;

 private:
  template <class T>
  static std::string text_of(T value) {
    if constexpr (std::is_floating_point_v<T>) {
      char text[40];
      std::snprintf(text, sizeof text, "%.17g", static_cast<double>(value));
      return text;
    } else {
      return std::to_string(value);
    }
  }
  bool binary_;
  bool after_values_ = false;
};

/// Everything that a file before version 5 can have around the points.
VtkBytes classic(bool binary) {
  VtkBytes file(binary);
  file.add("FIELD FieldData 2\nTIME 1 1 double\n").values<double>({0.75});
  file.add("CYCLE 1 1 int\n").values<std::int32_t>({5});
  file.add("POINTS 3 double\n");
  file.values<double>({0.5, 1, 2, -3, 4e-3, 5, 6, NAN, INFINITY}).may_end();
  file.add("CELLS 3 6\n").values<std::int32_t>({1, 0, 1, 1, 1, 2}).may_end();
  file.add("CELL_TYPES 3\n").values<std::int32_t>({1, 1, 1}).may_end();
  file.add("CELL_DATA 3\n").may_end();
  file.add("SCALARS density unsigned_char\nLOOKUP_TABLE default\n");
  file.values<std::uint8_t>({7, 8, 9}).may_end();
  file.add("point_data 3\n").may_end();
  file.add("SCALARS ID long 1\nLOOKUP_TABLE own\n");
  file.values<std::int64_t>({12, -5, 9007199254740993}).may_end();
  file.add("LOOKUP_TABLE own 2\n").values<std::uint8_t>({0, 0, 0, 255, 1, 1, 1, 255}).may_end();
  file.add("COLOR_SCALARS tint 1\n").values<std::uint8_t>({1, 2, 3}).may_end();
  file.add("VECTORS velocity float\n");
  file.values<float>({1, 2, 3, 4, 5, 6, 7, 8, 9}).may_end();
  file.add("NORMALS n float\n").values<float>({0, 0, 1, 0, 0, 1, 0, 0, 1}).may_end();
  file.add("TEXTURE_COORDINATES t 2 float\n").values<float>({0, 0, 1, 0, 0, 1}).may_end();
  file.add("FIELD FieldData 3\ndensity 1 3 short\n").values<std::int16_t>({1000, 999, -1});
  file.add("label 1 3 string\n");
  if (binary)
    file.add(std::string("\xc2") + "ab" + "\xc0" + "\x80\x03" + "xyz" + "\n");
  else
    file.add("ab\n\nxyz\n");
  file.add("pscale 1 3 float\n").values<float>({0.1f, 0.2f, 0.3f}).may_end();
  return file;
}

/// Version 5.1: typed offsets and connectivity, METADATA after arrays, wide sizes, bits.
VtkBytes modern(bool binary) {
  VtkBytes file(binary, "5.1");
  const std::string metadata =
      "METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 1\n\n";
  file.add("POINTS 3 float\n").values<float>({1, 2, 3, 4, 5, 6, 7, 8, 9}).may_end();
  file.add(metadata).may_end();
  file.add("CELLS 4 3\nOFFSETS vtktypeint64\n").values<std::int64_t>({0, 1, 2, 3});
  file.add("CONNECTIVITY vtktypeint64\n").values<std::int64_t>({0, 1, 2}).may_end();
  file.add("CELL_TYPES 3\n").values<std::int32_t>({1, 1, 1}).may_end();
  file.add("POINT_DATA 3\n").may_end();
  file.add("GLOBAL_IDS GlobalIds vtkIdType\n").values<std::int32_t>({3, 4, 5}).may_end();
  file.add("FIELD FieldData 2\nv 3 3 double\n").values<double>({1, 2, 3, 4, 5, 6, 7, 8, 9});
  // Components without a name are empty lines.
  file.add("METADATA\nCOMPONENT_NAMES\nX\n\n\nINFORMATION 0\n\ninside 1 3 bit\n");
  if (binary)
    file.values<std::uint8_t>({0xa0}).may_end();
  else
    file.values<std::uint8_t>({1, 0, 1}).may_end();
  return file;
}

TEST_F(Vtk, ReadsFilesOfASimulator) {
  // Known values as meshio 5.3 reads them.
  const Particles cube = read_particles(test_data("splashsurf/cube_2366_particles.vtk"));
  ASSERT_EQ(cube.size(), 2366u);
  EXPECT_EQ(cube.x[0], 0.85f);
  EXPECT_EQ(cube.y[0], 0.09999019f);
  EXPECT_EQ(cube.x.back(), 1.4000001f);
  EXPECT_EQ(cube.z.back(), 1.45f);
  EXPECT_TRUE(cube.vx.empty() && cube.id.empty());

  const Particles dam =
      read_particles(test_data("splashsurf/double_dam_break_frame_01_4732_particles.vtk"));
  ASSERT_EQ(dam.size(), 4732u);
  ASSERT_EQ(dam.id.size(), 4732u);
  EXPECT_EQ(dam.id[0], 2379);
  EXPECT_EQ(dam.id.back(), 2196);
  EXPECT_EQ(dam.vy[0], -0.009810000658035278f);
  EXPECT_EQ(dam.vz.back(), 0.0f);
  EXPECT_EQ(dam.z.back(), -0.85f);
}

TEST_F(Vtk, ReadsAsciiAndBinary) {
  for (const bool binary : {false, true}) {
    const Particles p = read("a.vtk", classic(binary).bytes);
    ASSERT_EQ(p.size(), 3u);
    EXPECT_THAT(p.x, ElementsAre(0.5f, -3, 6));
    EXPECT_EQ(p.y[1], 4e-3f);
    EXPECT_TRUE(std::isnan(p.y[2]));
    EXPECT_THAT(p.z, ElementsAre(2, 5, INFINITY));
    EXPECT_THAT(p.vx, ElementsAre(1, 4, 7));
    EXPECT_THAT(p.vz, ElementsAre(3, 6, 9));
    EXPECT_THAT(p.id, ElementsAre(12, -5, 9007199254740993));
    EXPECT_THAT(p.density, ElementsAre(1000, 999, -1));
    EXPECT_THAT(p.radius, ElementsAre(0.1f, 0.2f, 0.3f));
    EXPECT_EQ(p.time, 0.75);
  }
}

TEST_F(Vtk, ReadsVersion5) {
  for (const bool binary : {false, true}) {
    const Particles p = read("a.vtk", modern(binary).bytes);
    EXPECT_THAT(p.y, ElementsAre(2, 5, 8));
    EXPECT_THAT(p.vy, ElementsAre(2, 5, 8));
    EXPECT_THAT(p.id, ElementsAre(3, 4, 5));
  }
}

TEST_F(Vtk, ReadsPolydataAndNoPoints) {
  const std::string start = "# vtk DataFile Version 2.0\n\nASCII\nDATASET POLYDATA\n";
  const Particles p = read("a.vtk", start + "POINTS 2 float 1 2 3\n4 5 6\nVERTICES 1 3\n2 0 1\n");
  EXPECT_THAT(p.z, ElementsAre(3, 6));
  EXPECT_EQ(read("a.vtk", start + "POINTS 0 float\nPOINT_DATA 0\n").size(), 0u);
}

TEST_F(Vtk, ACutIsAnErrorOrLosesWholeParts) {
  for (const VtkBytes& file : {classic(false), classic(true), modern(false), modern(true)}) {
    const int accepted =
        cut_everywhere("a.vtk", file.bytes, [&](const Particles& p, std::size_t length) {
          return p.size() == 3 && file.ends.contains(length);
        });
    EXPECT_EQ(accepted + 1u, file.ends.size());  // the whole file is no cut
  }
}

TEST_F(Vtk, DamageIsAnErrorOrReads) {
  for (const VtkBytes& file : {classic(false), classic(true), modern(false), modern(true)})
    flip_bits("a.vtk", file.bytes);
}

TEST_F(Vtk, DoesNotBelieveAHugeCount) {
  for (const bool binary : {false, true}) {
    EXPECT_THAT(
        error_of("a.vtk", VtkBytes(binary).add("POINTS 1152921504606846976 float\n1 ").bytes),
        HasSubstr("wanted 3458764513820540928 values of POINTS"));
    EXPECT_THAT(
        error_of("a.vtk", VtkBytes(binary).add("POINTS 9223372036854775807 float\n1 ").bytes),
        HasSubstr("the size of POINTS is too large"));
  }
}

TEST_F(Vtk, SaysWhatIsWrong) {
  const std::string points = "POINTS 1 float\n1 2 3\n";
  const auto error = [&](const std::string& text) {
    return error_of("a.vtk", VtkBytes(false).add(text).bytes);
  };
  EXPECT_THAT(error_of("a.vtk", "<?xml version=\"1.0\"?>"),
              HasSubstr("line 1: found \"<?xml version=\"1.0\"?>\", wanted \"# vtk DataFile"));
  EXPECT_THAT(error_of("a.vtk", "# vtk DataFile Version 3.0\nt\nTEXT\n"),
              HasSubstr("line 3: found \"text\", wanted ASCII or BINARY"));
  EXPECT_THAT(error("DATASET STRUCTURED_POINTS\n"),
              HasSubstr("found dataset \"structured_points\", wanted POLYDATA"));
  EXPECT_THAT(error(""), HasSubstr("has no POINTS"));
  EXPECT_THAT(error(points + points), HasSubstr("line 7: POINTS appears twice"));
  EXPECT_THAT(error("POINTS 1 half\n1 2 3\n"), HasSubstr("found type \"half\" of POINTS"));
  EXPECT_THAT(error("POINTS -1 float\n"),
              HasSubstr("line 5: found -1 for the number of POINTS, must be >= 0"));
  EXPECT_THAT(error("POINTS 1 float\n1 x 3\n"),
              HasSubstr("line 6: found \"x\", wanted a number for POINTS"));
  EXPECT_THAT(error(points + "POINT_DATA 2\n"),
              HasSubstr("found POINT_DATA for 2 points, wanted 1 as in POINTS"));
  EXPECT_THAT(error(points + "POINT_DATA 1\nFIELD f 1\nrho 1 2 float\n1 2\n"),
              HasSubstr("found 2 tuples of rho, wanted 1"));
  EXPECT_THAT(error(points + "POINT_DATA 1\nSCALARS id float 1\n5\n"),
              HasSubstr("line 9: found \"5\""));
  EXPECT_THAT(error(points + "POINT_DATA 1\nSCALARS id float 1\nLOOKUP_TABLE d\n0.5\n"),
              HasSubstr("found \"0.5\", wanted a whole number of 64 bits for id"));
  EXPECT_THAT(error(points + "POINTDATA 1\n"), HasSubstr("line 7: found \"pointdata\""));
  EXPECT_EQ(error(points + "POINT_DATA 1\nSCALARS radius float 1\nLOOKUP_TABLE d\n-1\n"),
            "a.vtk: point 0: radius is -1, must be > 0 and finite (give particle_radius to "
            "override)");
}

TEST_F(Vtk, NamesInMessagesAreShortAndSteerNoTerminal) {
  const std::string message =
      error_of("a.vtk",
               "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 1 float\n0 0 0\n"
               "POINT_DATA 1\nSCALARS \x1b[2J" +
                   std::string(100'000, 'n') + " float 1\nLOOKUP_TABLE default\nx\n");
  EXPECT_THAT(message, HasSubstr("wanted a number for \\x1b[2Jnnn"));
  EXPECT_LT(message.size(), 300u);
}

}  // namespace
}  // namespace meniscus
