#include <gmock/gmock.h>

#include <cmath>

#include "cost.hpp"
#include "io/fields.hpp"
#include "io/io_test_support.hpp"

namespace meniscus {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class Xyz : public InputTest {};
class Csv : public InputTest {};

const std::string kRows =
    "# a comment\n"
    "0.5 1 2\n"
    "\n"
    "\t-1e-3\t+4  nan   # behind a row\r\n"
    "inf 6.25 7.75\n";
const std::string kCounted = "3\nframe 7 of 0.1 0.2 0.3\n0.5 1 2\n3 4 5\n6 7 8.25\n";
const std::string kTable =
    "\xef\xbb\xbf\"Velocity:0\",\"Velocity:1\",\"Velocity:2\",\"Points:0\",\"Points:1\","
    "\"Points:2\",\"a, b\",rho,radius,id\n"
    "1,2,3,0.5,1,2,\"x, y\",1000,0.1,9007199254740993\n"
    "\n"
    "4, 5 ,\"6\",-3,4,nan,,999,0.2,-5\n";

/// Whether all rows but the last are those of the whole file: a cut last number cannot be known.
bool begins_alike(const Particles& part, const Particles& whole) {
  if (part.size() > whole.size()) return false;
  for (std::size_t i = 0; i + 1 < part.size(); ++i) {
    const auto equal = [&](const std::vector<float>& a, const std::vector<float>& b) {
      return a[i] == b[i] || (std::isnan(a[i]) && std::isnan(b[i]));
    };
    if (!equal(part.x, whole.x) || !equal(part.y, whole.y) || !equal(part.z, whole.z)) return false;
  }
  return true;
}

TEST_F(Xyz, ReadsRows) {
  const Particles p = read("a.xyz", kRows);
  EXPECT_THAT(p.x, ElementsAre(0.5f, -1e-3f, INFINITY));
  EXPECT_THAT(p.y, ElementsAre(1, 4, 6.25f));
  EXPECT_TRUE(std::isnan(p.z[1]));
  EXPECT_TRUE(p.vx.empty());
}

TEST_F(Xyz, ReadsTheClassicForm) {
  EXPECT_THAT(read("a.xyz", kCounted).z, ElementsAre(2, 5, 8.25f));
  EXPECT_THAT(read("a.xyz", "2\n\nH 1 2 3\nO 4 5 6\n").x, ElementsAre(1, 4));
  // A byte order mark made the first number the name of an element, and shifted all columns.
  EXPECT_THAT(read("a.xyz",
                   "\xef\xbb\xbf"
                   "1 2 3 4 5 6\n")
                  .x,
              ElementsAre(1));
  EXPECT_EQ(read("a.xyz", "0\nnothing\n").size(), 0u);
}

TEST_F(Xyz, SixColumnsArePositionAndVelocity) {
  EXPECT_THAT(read("a.xyz", "1 2 3 4 5 6\n").vz, ElementsAre(6));
  EXPECT_TRUE(read("a.xyz", "1 2 3 4 5\n").vx.empty());
  EXPECT_TRUE(read("a.xyz", "1 2 3 4 5 6 red\n").vx.empty());
}

TEST_F(Xyz, ACutIsAnErrorWhereTheCountIsKnown) {
  EXPECT_EQ(cut_everywhere("a.xyz", kCounted, [](const Particles&, std::size_t) { return false; }),
            0);
  const Particles whole = read("a.xyz", kRows);
  EXPECT_GT(cut_everywhere("a.xyz", kRows,
                           [&](const Particles& p, std::size_t length) {
                             const bool between_lines = std::string(kRows)[length - 1] == '\n';
                             return p.size() > 0 ? begins_alike(p, whole) : between_lines;
                           }),
            0);
}

TEST_F(Xyz, DamageIsAnErrorOrReads) {
  flip_bits("a.xyz", kRows);
  flip_bits("a.xyz", kCounted);
}

TEST_F(Xyz, NoRowsAreAnEmptyFrame) {
  EXPECT_EQ(read("a.xyz", "# nothing\n\n").size(), 0u);
  EXPECT_EQ(read("a.xyz", "\n").size(), 0u);
  EXPECT_THAT(error_of("a.xyz", "# noth"), HasSubstr("line 1: the file ends in a comment"));
}

TEST_F(Xyz, SaysWhatIsWrong) {
  EXPECT_EQ(error_of("a.xyz", "1 2 3\n1 2\n"),
            "a.xyz: line 2: found 2 columns, wanted 3 as in the first row (truncated?)");
  EXPECT_EQ(error_of("a.xyz", "1 2 3\n1 two 3\n"),
            "a.xyz: line 2: found \"two\", wanted a number for y");
  EXPECT_EQ(error_of("a.xyz", "1 2 1e999\n"),
            "a.xyz: line 1: found \"1e999\", wanted a number for z");
  EXPECT_EQ(error_of("a.xyz", "1 2\n"), "a.xyz: line 1: found 2 columns, wanted at least 3: x y z");
  EXPECT_EQ(error_of("a.xyz", "-2\n\n1 2 3\n"),
            "a.xyz: line 1: found \"-2\", wanted x y z or the number of particles");
  EXPECT_THAT(error_of("a.xyz", "1152921504606846976\n\n1 2 3\n"),
              HasSubstr("the file ends after 1 rows, wanted 1152921504606846976"));
  EXPECT_THAT(error_of("a.xyz", "1\n\n1 2 3\n4 5 6\n"),
              HasSubstr("line 4: found more rows than the 1 that the first line states"));
  // Raw floats under this ending, as one program writes them.
  EXPECT_THAT(error_of("a.xyz", std::string(24, '\0')), HasSubstr("line 1: found \"\\x00\\x00"));
}

TEST_F(Csv, ReadsNamedColumns) {
  const Particles p = read("a.csv", kTable);
  EXPECT_THAT(p.x, ElementsAre(0.5f, -3));
  EXPECT_TRUE(std::isnan(p.z[1]));
  EXPECT_THAT(p.vy, ElementsAre(2, 5));
  EXPECT_THAT(p.vz, ElementsAre(3, 6));
  EXPECT_THAT(p.density, ElementsAre(1000, 999));
  EXPECT_THAT(p.radius, ElementsAre(0.1f, 0.2f));
  EXPECT_THAT(p.id, ElementsAre(9007199254740993, -5));
}

TEST_F(Csv, ReadsOtherSeparatorsAndNames) {
  const Particles p = read("a.csv",
                           "Pos.x [m];Pos.y [m];Pos.z [m];Idp;Vel.x [m/s];Vel.y [m/s];Vel.z "
                           "[m/s];Rhop [kg/m^3]\n1;2;3;7;4;5;6;1000\n");
  EXPECT_THAT(p.y, ElementsAre(2));
  EXPECT_THAT(p.vz, ElementsAre(6));
  EXPECT_THAT(p.id, ElementsAre(7));
  EXPECT_THAT(p.density, ElementsAre(1000));
  EXPECT_THAT(read("a.csv", "X\tY\tZ\tvelocity_x\tvelocity_y\tvelocity_z\n1\t2\t3\t4\t5\t6\n").vx,
              ElementsAre(4));
}

TEST_F(Csv, ACellInQuotesIsRefusedUnlessItIsWhole) {
  EXPECT_THAT(read("a.csv", "x,y,z,name\n\"1\" , 2,3,\"a \"\"b\"\", c\"\n").x, ElementsAre(1));
  EXPECT_EQ(error_of("a.csv", "x,y,z\n\"1\"5,2,3\n"),
            "a.csv: line 2: found \"5\" after a cell in quotes, wanted a separator");
  EXPECT_EQ(error_of("a.csv", "x,y,z\n\"1\"\"5\",2,3\n"),
            "a.csv: line 2: found \"1\"\"5\", wanted a number for x");
  // A cell that goes on in the next line would be a particle of its own.
  EXPECT_EQ(
      error_of("a.csv", "name,x,y,z\n\"a,1,2,3\nb\",1,2,3\n"),
      "a.csv: line 2: a cell in quotes does not end in its line, wanted one line for each row");
}

TEST_F(Csv, ReadsColumnsWithoutNames) {
  EXPECT_THAT(read("a.csv", "1,2,3\n4,5,6").z, ElementsAre(3, 6));
  EXPECT_THAT(read("a.csv", "1,2,3,4,5,6\n").vx, ElementsAre(4));
}

TEST_F(Csv, ZeroRowsAreFine) { EXPECT_EQ(read("a.csv", "x,y,z\n").size(), 0u); }

TEST_F(Csv, ACutLosesRowsOrIsAnError) {
  const Particles whole = read("a.csv", kTable);
  // Between the rows, or inside the last cell of one.
  EXPECT_GT(cut_everywhere("a.csv", kTable,
                           [&](const Particles& p, std::size_t length) {
                             return length > kTable.find('\n') && begins_alike(p, whole);
                           }),
            0);
}

TEST_F(Csv, DamageIsAnErrorOrReads) { flip_bits("a.csv", kTable); }

TEST_F(Csv, ReadsWhatSpreadsheetsAndDualSphysicsWrite) {
  Particles p = read("a.csv", "x;y;z\n0,5;-1,25;2\n");
  EXPECT_EQ(p.x, (std::vector<float>{0.5f}));
  EXPECT_EQ(p.y, (std::vector<float>{-1.25f}));
  EXPECT_EQ(p.z, (std::vector<float>{2}));
  p = read("a.csv", "0,5;-1,25;2\n1;2;3\n");
  EXPECT_EQ(p.x, (std::vector<float>{0.5f, 1}));
  p = read("a.csv", "Time [s];Np\n0.1;1\n\nPos.x [m];Pos.y [m];Pos.z [m];Idp\n1;2;3;9\n");
  EXPECT_EQ(p.x, (std::vector<float>{1}));
  EXPECT_EQ(p.id, (std::vector<std::int64_t>{9}));
}

TEST_F(Csv, SaysWhatIsWrong) {
  EXPECT_EQ(error_of("a.csv", "\n\n"), "a.csv: has no rows, wanted columns x, y, z");
  EXPECT_EQ(error_of("a.csv", "x,y,density\n1,2,3\n"),
            "a.csv: line 1: found \"x,y,density\" without a column z, wanted columns x, y, z "
            "separated by comma, semicolon or tab");
  EXPECT_EQ(error_of("a.csv", "x,y,z"),
            "a.csv: line 1: the file ends in the row of names (truncated?)");
  EXPECT_EQ(error_of("a.csv", "x,y,z\n1,2,3\n1,2\n"),
            "a.csv: line 3: found 2 columns, wanted 3 as in the first row (truncated?)");
  EXPECT_EQ(error_of("a.csv", "x\ty\tz\n0,5\t1\t2\n"),
            "a.csv: line 2: found \"0,5\", wanted a number for x");
  EXPECT_EQ(error_of("a.csv", "x;y;z\n0,5,1;1;2\n"),
            "a.csv: line 2: found \"0,5,1\", wanted a number for x");
  EXPECT_EQ(error_of("a.csv", "x,y,z,id\n0,1,2,3.5\n"),
            "a.csv: line 2: found \"3.5\", wanted a whole number of 64 bits for id");
  EXPECT_EQ(error_of("a.csv", "x,y,z\n0,,2\n"), "a.csv: line 2: found \"\", wanted a number for y");
  EXPECT_EQ(error_of("a.csv", "x,y,z,radius\n0,1,2,nan\n"),
            "a.csv: particle 0: radius is nan, must be > 0 and finite (give particle_radius to "
            "override)");
}

TEST(FieldsOfColumns, ManyColumnsTakeNoTimeToTellApart) {
  std::vector<std::string> names(400'000, "x");
  std::fill_n(names.begin(), 200'000, "other");
  std::vector<Field> fields;
  // Each against each other: 10 s and more.
  EXPECT_LT(cost_of([&] { fields_of_columns(names); }).seconds, 2);
  fields = fields_of_columns(names);
  EXPECT_EQ(fields[199'999], Field::none);
  EXPECT_EQ(fields[200'000], Field::x);
  EXPECT_EQ(fields[200'001], Field::none);
}

}  // namespace
}  // namespace meniscus
