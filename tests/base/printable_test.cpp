// Text that may hold anything, shown on terminals and in pages.
#include "base/printable.hpp"

#include <gtest/gtest.h>

namespace meniscus {
namespace {

TEST(Printable, KeepsWhatPeopleRead) {
  EXPECT_EQ(printable("Größe of 水.ply", 80), "Größe of 水.ply");
  EXPECT_EQ(printable("😀", 80), "😀");
  EXPECT_EQ(printable("", 80), "");
}

TEST(Printable, SpellsOutWhatSteersATerminal) {
  EXPECT_EQ(printable("a\x1b[2Jb\r\n\t\x7f", 80), "a\\x1b[2Jb\\x0d\\x0a\\x09\\x7f");
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m",
                      80),
            "\\xc2\\x9b31m");                                         // CSI as one character
  EXPECT_EQ(printable("\xe2\x80\xaegnp", 80), "\\xe2\\x80\\xaegnp");  // right to left from here
  EXPECT_EQ(printable(std::string("\0", 1), 80), "\\x00");
}

TEST(Printable, SpellsOutWhatIsNoUtf8) {
  EXPECT_EQ(printable("\xff", 80), "\\xff");
  EXPECT_EQ(printable("caf\xe9.ply", 80), "caf\\xe9.ply");               // Latin-1
  EXPECT_EQ(printable("\xc0\xaf", 80), "\\xc0\\xaf");                    // longer than it need be
  EXPECT_EQ(printable("\xed\xa0\x80", 80), "\\xed\\xa0\\x80");           // half of a pair
  EXPECT_EQ(printable("\xf4\x90\x80\x80", 80), "\\xf4\\x90\\x80\\x80");  // beyond U+10FFFF
  EXPECT_EQ(printable("\xe6\xb0", 80), "\\xe6\\xb0");                    // cut off
}

TEST(Printable, HasAnEnd) {
  EXPECT_EQ(printable("水水水", 3), "水水水");
  EXPECT_EQ(printable("水水水水", 3), "水水水...");
  EXPECT_EQ(printable(std::string(20'000'000, '\x1b'), 2), "\\x1b\\x1b...");
}

TEST(WellFormed, ReplacesWhatXmlDoesNotAllow) {
  EXPECT_EQ(well_formed("a\tb\n<ü>"), "a\tb\n<ü>");
  EXPECT_EQ(well_formed("a\x01\x1b"
                        "b\xff\xef\xbf\xbe"),
            "a\ufffd\ufffdb\ufffd\ufffd");
}

TEST(Escaped, HoldsNoMarkupAndIsWellFormed) {
  EXPECT_EQ(escaped("<a href=\"b\"> & ü"), "&lt;a href=&quot;b&quot;&gt; &amp; ü");
  EXPECT_EQ(escaped("a\xff<"), "a\ufffd&lt;");
}

}  // namespace
}  // namespace meniscus
