// The page and the tables.
#include "kernels/page.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "bench/made_up.hpp"
#include "kernels/table.hpp"
#include "kernels/text.hpp"

namespace meniscus::bench {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(Page, NeedsNothingElse) {
  const BenchRun run = made_up_run();
  const std::string page = to_html(run, pair_sessions(&run, run));
  for (const char* outside : {"http", "//", "src=", "href=", "url(", "@import", "<script", "<link"})
    EXPECT_THAT(page, Not(HasSubstr(outside)));
  EXPECT_THAT(page, testing::StartsWith("<!DOCTYPE html>"));
  EXPECT_THAT(page, HasSubstr("prefers-color-scheme: dark"));
}

TEST(Page, EveryTagIsClosed) {
  const BenchRun run = made_up_run();
  const std::string page = to_html(run, pair_sessions(&run, run));
  std::vector<std::string> open;
  const std::regex tag("<(/?)([a-z0-9]+)[^>]*?(/?)>");
  for (std::sregex_iterator match(page.begin(), page.end(), tag), end; match != end; ++match) {
    const std::string name = (*match)[2];
    if (name == "meta" || (*match)[3] == "/") continue;
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

TEST(Page, SaysHowManyAreFarAndEscapesNames) {
  const std::string page = to_html(made_up_run(), {});
  EXPECT_THAT(page, HasSubstr("1 of 3 kernels are far from the limit"));
  EXPECT_THAT(page, HasSubstr("then 1 that are open"));
  EXPECT_THAT(page, HasSubstr("A &lt;fast&gt; &amp; good device"));
  EXPECT_THAT(page, Not(HasSubstr("<fast>")));
  EXPECT_THAT(page, Not(HasSubstr("<h2>Comparison")));
}

TEST(Page, SaysWhenOtherWorkRanBeside) {
  BenchRun run = made_up_run();
  EXPECT_THAT(to_html(run, {}) + results_table(run), Not(HasSubstr("other work")));
  run.sessions[0].other_work = 1.5;
  EXPECT_THAT(to_html(run, {}), HasSubstr("other work ran beside, on 1.5 processors"));
  EXPECT_THAT(results_table(run), HasSubstr("other work ran beside, on 1.5 processors"));
  EXPECT_THAT(comparison_table(pair_sessions(&run, run)), HasSubstr("other work"));
}

TEST(Plot, EveryDotHasItsNameAndNoTwoNamesOverlap) {
  Session session = made_up_session(2);
  constexpr int kKernels = 12;
  for (int k = 0; k < kKernels; ++k) {
    Result result = made_up_result("kernel_" + std::to_string(k), kDevice, {1.0 + 0.02 * k});
    session.results.push_back(result);
  }
  const std::string plot = roofline_plot(session, {"kernel_3"});
  const std::regex label(
      "<text class=\"dot-label\"[^>]*translate\\(([0-9.]+) ([0-9.]+)\\)[^>]*>([^<]*)<");
  std::vector<std::pair<double, double>> places;
  for (std::sregex_iterator match(plot.begin(), plot.end(), label), end; match != end; ++match)
    places.emplace_back(std::stod((*match)[1]), std::stod((*match)[2]));
  ASSERT_EQ(places.size(), static_cast<std::size_t>(kKernels));
  for (std::size_t a = 0; a < places.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      EXPECT_TRUE(std::abs(places[a].first - places[b].first) > 50 ||
                  std::abs(places[a].second - places[b].second) > 12)
          << a << " and " << b;
  EXPECT_EQ(std::string(plot).find("nan"), std::string::npos);
}

TEST(Plot, WhatComputesNothingIsLeftOut) {
  Session session = made_up_session(2);
  session.results = {made_up_result("mover", kDevice, {1.0})};
  session.results[0].operations = 0;
  EXPECT_THAT(roofline_plot(session, {}), Not(HasSubstr("mover")));
}

TEST(Table, FarthestKernelsComeFirst) {
  const std::string table = verdict_table(made_up_run());
  EXPECT_LT(table.find("slow "), table.find("quick "));
  EXPECT_THAT(table, HasSubstr("far"));
  EXPECT_THAT(table, HasSubstr("near"));
  // Once a device: with the most threads.
  EXPECT_THAT(table, HasSubstr("2 threads"));
  EXPECT_THAT(table, Not(HasSubstr("1 thread\n")));
}

TEST(Table, FitsATerminal) {
  std::istringstream lines(results_table(made_up_run()) + verdict_table(made_up_run()));
  for (std::string line; std::getline(lines, line);)
    EXPECT_TRUE(line.size() <= 120 || line.find("copies") != std::string::npos) << line;
}

TEST(Text, NumbersHaveThreeDigits) {
  EXPECT_EQ(three_digits(0.012345), "0.0123");
  EXPECT_EQ(three_digits(4.5678), "4.57");
  EXPECT_EQ(three_digits(789.4), "789");
  EXPECT_EQ(three_digits(0), "0");
  EXPECT_EQ(with_prefix(634.2e6), "634 M");
  EXPECT_EQ(with_prefix(12), "12.0");
  EXPECT_EQ(grouped(1234567), "1,234,567");
  EXPECT_EQ(grouped(123), "123");
  EXPECT_EQ(size_of(262144), "256 KiB");
  EXPECT_EQ(size_of(1 << 27), "128 MiB");
}

}  // namespace
}  // namespace meniscus::bench
