// Notices: codes by name, and settings as each front end calls them.
#include "meniscus/notice.hpp"

#include <gmock/gmock.h>

#include <set>
#include <string>

#include "meniscus/error.hpp"
#include "meniscus/extract.hpp"
#include "meniscus/named_parameters.hpp"
#include "program/wording.hpp"

namespace meniscus {
namespace {

TEST(Notice, EveryCodeHasANameOfItsOwn) {
  std::set<std::string> names;
  const int last = static_cast<int>(Code::extracted_again);
  for (int code = 0; code <= last; ++code) names.insert(to_string(static_cast<Code>(code)));
  EXPECT_EQ(names.size(), static_cast<std::size_t>(last) + 1);
}

TEST(Notice, SettingsAreOptionsInTheProgramAlone) {
  const Notice notice{.text = "give " + setting("particle-radius") + " or " + setting("up")};
  EXPECT_EQ(to_string(notice), "give particle_radius or up");
  EXPECT_EQ(words_of(notice), "give --particle-radius or --up");
  EXPECT_EQ(words_of(InputError(notice)), words_of(notice));
  EXPECT_STREQ(InputError(notice).what(), to_string(notice).c_str());
  EXPECT_EQ(words_of(std::runtime_error("x --y")), "x --y");
}

TEST(Notice, LeavesMarksAloneThatEncloseNoSetting) {
  for (const std::string& text : {std::string("\x01"), std::string("a\x01z"), std::string("\x02"),
                                  std::string("\x01no option\x02"), std::string("")})
    EXPECT_EQ(to_string(Notice{.text = text}), text);
}

TEST(Notice, ErrorsOfParametersHaveTheirNumbers) {
  Parameters parameters;
  try {
    set_parameter(parameters, "support", 51);
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_EQ(error.notice.code, Code::parameter_out_of_range);
    EXPECT_EQ(error.notice.subject, "support");
    EXPECT_EQ(error.notice.found, 51);
    EXPECT_EQ(error.notice.wanted, 50);
    EXPECT_STREQ(error.what(), "support is 51, must be at least 0.1 and at most 50");
    EXPECT_EQ(words_of(error), "--support is 51, must be at least 0.1 and at most 50");
  }
  parameters = {};
  try {
    set_parameter(parameters, "passes", 1.5);
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_EQ(error.notice.code, Code::not_whole);
  }
  try {
    aovs_named("N,normals");
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_EQ(error.notice.code, Code::unknown_map);
    EXPECT_EQ(error.notice.subject, "normals");
  }
}

}  // namespace
}  // namespace meniscus
