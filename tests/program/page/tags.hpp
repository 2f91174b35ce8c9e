// Looks at the tags of a page.
#pragma once

#include <gtest/gtest.h>

#include <regex>
#include <string>
#include <vector>

namespace meniscus {

/// Expects that every tag is closed, in order, and that nothing is fetched from outside the page.
inline void expect_whole_page(const std::string& page) {
  EXPECT_TRUE(page.starts_with("<!DOCTYPE html>"));
  for (const char* outside : {"http", "://", "href=", "url(", "@import", "<script", "<link"})
    EXPECT_EQ(page.find(outside), std::string::npos) << outside;
  const std::regex source("src=\"([^\"]{0,22})");
  for (std::sregex_iterator match(page.begin(), page.end(), source), end; match != end; ++match)
    EXPECT_EQ((*match)[1], "data:image/png;base64,");
  std::vector<std::string> open;
  const std::regex tag("<(/?)([a-z0-9]+)((\"[^\"]*\"|[^>\"])*)>");
  for (std::sregex_iterator match(page.begin(), page.end(), tag), end; match != end; ++match) {
    const std::string name = (*match)[2], rest = (*match)[3];
    if (name == "meta" || name == "img" || rest.ends_with("/")) continue;
    if ((*match)[1] == "/") {
      ASSERT_FALSE(open.empty()) << name;
      ASSERT_EQ(open.back(), name) << match->position();
      open.pop_back();
    } else {
      open.push_back(name);
    }
  }
  EXPECT_TRUE(open.empty());
}

}  // namespace meniscus
