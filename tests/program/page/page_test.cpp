#include "program/page/page.hpp"

#include <gmock/gmock.h>

#include <vector>

#include "program/page/svg.hpp"
#include "program/page/tags.hpp"

namespace meniscus {
namespace {

using testing::HasSubstr;

TEST(HtmlPage, IsOnePageForLightAndDark) {
  Svg svg(10, 20, "a <drawing>");
  svg.line("grid", 0, 1, 2, 3);
  svg.words("tick", 1, 2, "end", "a < b", -90);
  const std::string page = html_page("A & B", ".x { color: red }", "<p>text</p>\n" + svg.text());
  expect_whole_page(page);
  for (const char* part : {"<title>A &amp; B</title>", ".x { color: red }", "<p>text</p>",
                           "a &lt;drawing&gt;", ">a &lt; b<", "prefers-color-scheme: dark"})
    EXPECT_THAT(page, HasSubstr(part));
}

TEST(HtmlPage, EscapesWhatHtmlWouldTakeForItsOwn) {
  EXPECT_EQ(escaped("<a href=\"x\">&amp;</a>"), "&lt;a href=&quot;x&quot;&gt;&amp;amp;&lt;/a&gt;");
  EXPECT_EQ(escaped("Größe 'x'"), "Größe 'x'");
}

TEST(Base64, IsThatOfTheStandard) {  // RFC 4648, section 10
  const auto encoded = [](const std::string& text) {
    return base64(std::vector<std::uint8_t>(text.begin(), text.end()));
  };
  EXPECT_EQ(encoded(""), "");
  EXPECT_EQ(encoded("f"), "Zg==");
  EXPECT_EQ(encoded("fo"), "Zm8=");
  EXPECT_EQ(encoded("foobar"), "Zm9vYmFy");
}

}  // namespace
}  // namespace meniscus
