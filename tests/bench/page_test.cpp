// The page and the tables.
#include "kernels/page.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "base/printed.hpp"
#include "bench/made_up.hpp"
#include "kernels/table.hpp"
#include "program/page/tags.hpp"

namespace meniscus::bench {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

TEST(Page, IsWholeAndNeedsNothingElse) {
  const BenchRun run = made_up_run();
  expect_whole_page(to_html(run, pair_sessions(&run, run)));
}

TEST(Page, SaysHowManyAreFarAndEscapesNames) {
  const std::string page = to_html(made_up_run(), {});
  EXPECT_THAT(page, HasSubstr("Far from the limit: 1 of 3 kernels; open: 1."));
  EXPECT_THAT(page, HasSubstr("the largest frame, 4,000 particles at 64x48"));
  EXPECT_THAT(page, HasSubstr("A &lt;fast&gt; &amp; good device"));
  EXPECT_THAT(page, Not(HasSubstr("<fast>")));
  EXPECT_THAT(page, Not(HasSubstr("<h2>Comparison")));
}

TEST(Page, SaysWhenOtherWorkRanBeside) {
  BenchRun run = made_up_run();
  EXPECT_THAT(to_html(run, {}) + results_table(run), Not(HasSubstr("arning: ")));
  run.sessions[0].other_work = 1.5;
  const char* const warning =
      "other programs kept 1.5 processors busy: times and roofline may be off";
  EXPECT_THAT(to_html(run, {}), HasSubstr(warning));
  EXPECT_THAT(results_table(run), HasSubstr(warning));
  EXPECT_THAT(comparison_table(pair_sessions(&run, run)), HasSubstr(warning));
}

TEST(Page, SaysWhenThreadsDidNotRunAtOnce) {
  BenchRun run = made_up_run();
  run.sessions[0].roofline.fused_gflops = run.sessions[0].roofline.plain_gflops = 60;
  const char* const warning = "2 threads computed only 1.20 times as fast as one";
  EXPECT_THAT(to_html(run, {}), HasSubstr(warning));
  EXPECT_THAT(results_table(run), HasSubstr(warning));
}

TEST(Page, SaysWhenNativeVersionsAreNoMeasure) {
  BenchRun run = made_up_run();
  run.sessions[0].native_flags = false;
  const char* const warning = "native versions are not compiled for this processor";
  EXPECT_THAT(to_html(run, {}), HasSubstr(warning));
  EXPECT_THAT(results_table(run), HasSubstr(warning));
  EXPECT_THAT(verdict_table(run), testing::ContainsRegex("quick .*  open\n"));
  run.sessions[1].native_flags = false;
  for (const std::string& text : {results_table(run), verdict_table(run)})
    EXPECT_THAT(text, Not(HasSubstr("x native")));
  EXPECT_THAT(to_html(run, {}),
              AllOf(Not(HasSubstr("against native C++")), Not(HasSubstr("0.90 times"))));
  EXPECT_THAT(results_table(run), HasSubstr("native* "));
  EXPECT_THAT(to_json(run), Not(HasSubstr("against_native")));
}

TEST(Page, SaysWhenNativeVersionsWereLeftOut) {
  BenchRun run = made_up_run();
  const char* const warning = "native versions were left out: they are not compiled for this";
  EXPECT_THAT(results_table(run), Not(HasSubstr(warning)));
  for (Session& session : run.sessions) {
    session.native_flags = false;
    session.without_native = true;
    std::erase_if(session.results, [](const Result& r) { return r.variant == kNative; });
  }
  for (const std::string& text : {to_html(run, {}), results_table(run)})
    EXPECT_THAT(text, AllOf(HasSubstr(warning), Not(HasSubstr("native*"))));
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
      "<text class=\"dot-label\"[^>]*x=\"([0-9.]+)\" y=\"([0-9.]+)\"[^>]*>([^<]*)<");
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

TEST(Plot, WhatComputesNothingAndWholeStagesAreLeftOut) {
  Session session = made_up_session(2);
  session.results = {made_up_result("mover", kDevice, {1.0}),
                     made_up_result("stage", kDevice, {1.0}),
                     made_up_result("adder", kDevice, {1.0})};
  session.results[0].operations = 0;
  session.results[1].whole_stage = true;
  const std::string plot = roofline_plot(session, {});
  EXPECT_THAT(plot, HasSubstr("adder"));
  EXPECT_THAT(plot, Not(HasSubstr("mover")));
  EXPECT_THAT(plot, Not(HasSubstr("stage")));
}

TEST(Table, WhatIsNotCountedIsNoZero) {
  BenchRun run{"1.2.3", {made_up_session(2)}};
  run.sessions[0].results = {made_up_result("mover", kDevice, {1.0})};
  run.sessions[0].results[0].operations = 0;
  EXPECT_THAT(results_table(run), testing::ContainsRegex("mover .* 1\\.00 +- "));
  EXPECT_THAT(to_html(run, {}), HasSubstr("<td>1.00</td><td>-</td><td>-</td>"));
  EXPECT_THAT(results_table(run), testing::ContainsRegex("mover .* not counted\n"));
}

TEST(Table, NamesTheCeilingOrWhyThereIsNone) {
  BenchRun run{"1.2.3", {made_up_session(2)}};
  Session& session = run.sessions[0];
  session.results = {made_up_result("mover", kDevice, {1.0}),
                     made_up_result("stage", kDevice, {1.0}),
                     made_up_result("adder", kDevice, {1.0})};
  session.results[0].operations = 0;
  session.results[1].whole_stage = true;
  session.results[2].operations = 50e6;
  const std::string table = verdict_table(run);
  EXPECT_THAT(table, testing::ContainsRegex("adder .* 50% of 100 GFLOP/s"));
  EXPECT_THAT(table, testing::ContainsRegex("mover .* not counted .* open\n"));
  EXPECT_THAT(table, testing::ContainsRegex("stage .* stage, wall time .* open\n"));
  EXPECT_LT(table.find("adder "), table.find("mover ")) << "what tells nothing comes last";
  EXPECT_THAT(to_html(run, {}), HasSubstr("<td class=\"word\">stage, wall time</td>"));
}

TEST(Table, SaysWhatIsFasterThanItsNativeVersion) {
  BenchRun run{"1.2.3", {made_up_session(2)}};
  run.sessions[0].results = {made_up_result("quick", kDevice, {1.0}),
                             made_up_result("quick", kNative, {7.9})};
  EXPECT_THAT(verdict_table(run), testing::ContainsRegex("quick .* 7.90  faster than native\n"));
}

TEST(Table, FarthestKernelsComeFirst) {
  const std::string table = verdict_table(made_up_run());
  EXPECT_LT(table.find("slow "), table.find("quick "));
  EXPECT_THAT(table, testing::ContainsRegex("slow .*  slower\n"));
  EXPECT_THAT(table, testing::ContainsRegex("quick .* 3% of .*  as native\n"));
  EXPECT_THAT(table, testing::ContainsRegex("lonely .*  open\n"));
  // Once a device: with the most threads.
  EXPECT_THAT(table, HasSubstr("2 threads"));
  EXPECT_THAT(table, Not(HasSubstr("1 thread\n")));
}

TEST(Table, FitsATerminal) {
  std::istringstream lines(results_table(made_up_run()) + verdict_table(made_up_run()));
  for (std::string line; std::getline(lines, line);)
    EXPECT_TRUE(line.size() <= 120 || line.find("copies") != std::string::npos) << line;
}

}  // namespace
}  // namespace meniscus::bench
