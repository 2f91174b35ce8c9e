// Which differences exceed the noise.
#include "kernels/compare.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bench/made_up.hpp"
#include "kernels/page.hpp"
#include "kernels/table.hpp"

namespace meniscus::bench {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

Difference difference(std::vector<double> before, std::vector<double> after) {
  return {made_up_result("k", kDevice, std::move(before)),
          made_up_result("k", kDevice, std::move(after))};
}

TEST(Compare, BothNoisesTogetherAreAllowed) {
  // The fastest is 1, the fastest quarter reaches to 1.05 and 1.04: up to 9 % is noise.
  EXPECT_NEAR(difference({1.0, 1.05, 2, 3}, {1.0, 1.04, 2, 3}).noise(), 0.09, 1e-12);
  EXPECT_STREQ(verdict_on(difference({1.0, 1.05, 2, 3}, {1.08, 1.12, 2, 3})), "within the noise");
  EXPECT_STREQ(verdict_on(difference({1.0, 1.05, 2, 3}, {1.10, 1.14, 2, 3})), "slower");
  EXPECT_STREQ(verdict_on(difference({1.0, 1.05, 2, 3}, {0.90, 0.94, 2, 3})), "faster");
}

TEST(Compare, NoNoiseSeenIsNotNone) {
  EXPECT_STREQ(verdict_on(difference({1.0, 1.0}, {1.015, 1.015})), "within the noise");
  EXPECT_STREQ(verdict_on(difference({1.0, 1.0}, {1.025, 1.025})), "slower");
}

// The native version is the same program in both runs: where it moves, the machine moved.
TEST(Compare, NothingIsDecidedWhereTheControlMoves) {
  const auto verdicts = [](double native_before, double native_after) {
    Session before = made_up_session(2), after = made_up_session(2);
    before.results = {made_up_result("k", kDevice, {1.0}),
                      made_up_result("k", kNative, {native_before}),
                      made_up_result("other", kDevice, {1.0})};
    after.results = {made_up_result("k", kDevice, {1.2}),
                     made_up_result("k", kNative, {native_after}),
                     made_up_result("other", kDevice, {1.2})};
    std::string words;
    for (const Difference& d : compare(before, after)) words += std::string(verdict_on(d)) + "; ";
    return words;
  };
  EXPECT_EQ(verdicts(1.0, 1.01), "slower; within the noise; slower; ");
  EXPECT_EQ(verdicts(1.0, 1.2), "undecided; control moved; undecided; ");
}

TEST(Compare, OnlyWhatBothHaveIsCompared) {
  Session before = made_up_session(2), after = made_up_session(2);
  before.results = {made_up_result("a", kDevice, {1.0}), made_up_result("b", kDevice, {1.0})};
  after.results = {made_up_result("b", kDevice, {2.0}), made_up_result("b", kNative, {1.0}),
                   made_up_result("b", kDevice, {1.0}, 77), made_up_result("c", kDevice, {1.0})};
  const std::vector<Difference> differences = compare(before, after);
  ASSERT_EQ(differences.size(), 1u);
  EXPECT_EQ(differences[0].after.kernel, "b");
  EXPECT_EQ(differences[0].ratio(), 2);
}

TEST(Compare, SessionsArePairedByDeviceAndThreads) {
  BenchRun before{"1", {made_up_session(1), made_up_session(2)}};
  BenchRun after{"1", {made_up_session(2), made_up_session(1)}};
  const auto pairs = pair_sessions(&before, after);
  ASSERT_EQ(pairs.size(), 2u);
  for (const SessionPair& pair : pairs) EXPECT_EQ(pair.before->threads, pair.after->threads);

  // Another device with as many threads, then whatever is left.
  after.sessions[1].device = "other";
  after.sessions[0].device = "third";
  after.sessions[0].threads = 0;
  const auto others = pair_sessions(&before, after);
  ASSERT_EQ(others.size(), 2u);
  EXPECT_EQ(others[0].before, &before.sessions[1]);
  EXPECT_EQ(others[1].before, &before.sessions[0]);
}

TEST(Compare, DevicesOfOneRunAreComparedWithTheFirst) {
  BenchRun run{"1", {made_up_session(2), made_up_session(1), made_up_session(0)}};
  run.sessions[2].device = "other";
  const auto pairs = pair_sessions(nullptr, run);
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].before, &run.sessions[0]);
  EXPECT_EQ(pairs[0].after, &run.sessions[2]);
}

TEST(Compare, DevicesOfOneNameAreDevices) {
  BenchRun run{"1", {made_up_session(0), made_up_session(0)}};
  ASSERT_EQ(pair_sessions(nullptr, run).size(), 1u);
  EXPECT_EQ(pair_sessions(nullptr, run)[0].after, &run.sessions[1]);
}

TEST(Compare, DevicesAreComparedOnAsManyThreads) {
  BenchRun run{"1",
               {made_up_session(2), made_up_session(1), made_up_session(2), made_up_session(1),
                made_up_session(8), made_up_session(4)}};
  const auto pairs = pair_sessions(nullptr, run);
  ASSERT_EQ(pairs.size(), 3u);
  EXPECT_EQ(pairs[0].before, &run.sessions[0]);
  EXPECT_EQ(pairs[0].after, &run.sessions[2]);
  EXPECT_EQ(pairs[1].before, &run.sessions[1]);
  EXPECT_EQ(pairs[1].after, &run.sessions[3]);
  EXPECT_EQ(pairs[2].before, &run.sessions[0]);  // with all it has
  EXPECT_EQ(pairs[2].after, &run.sessions[4]);
}

TEST(Compare, KnowsBeforeAMeasurementWhatARunHas) {
  const BenchRun run = made_up_run();
  EXPECT_TRUE(has_any(run, {"other", "slow"}, {4000}, 64, 48));
  EXPECT_FALSE(has_any(run, {"quick"}, {4000}, 64, 48));
  EXPECT_FALSE(has_any(run, {"slow"}, {4000}, 64, 49));
  EXPECT_EQ(sizes_of(run), "1,000 particles at 64x48, 4,000 particles at 64x48");
}

TEST(Compare, RunsOfOneDeviceAreToldApartByTheirFiles) {
  const BenchRun before = from_json(to_json(made_up_run()), "old.json"), after = made_up_run();
  EXPECT_THAT(comparison_table(pair_sessions(&before, after)),
              AllOf(HasSubstr("before: old.json: A <fast>"), HasSubstr("after:  A <fast>")));
}

TEST(Compare, SaysWhenRunsHaveNothingInCommon) {
  const BenchRun before = made_up_run();
  BenchRun after = made_up_run();
  for (Session& session : after.sessions)
    for (Result& result : session.results) result.width = 65;
  const auto pairs = pair_sessions(&before, after);
  for (const std::string& text : {comparison_table(pairs), to_html(after, pairs)})
    EXPECT_THAT(text, AllOf(HasSubstr("Nothing to compare"), HasSubstr("--particles"),
                            Not(HasSubstr("changed by")), Not(HasSubstr("before, ms"))));
}

TEST(Compare, TheTableCountsWhatExceedsTheNoise) {
  const BenchRun before = made_up_run();
  BenchRun after = made_up_run();
  for (Result& result : after.sessions[0].results)
    if (result.kernel == "lonely") result.ms = {3.0, 3.0};
  const std::string table = comparison_table(pair_sessions(&before, after));
  EXPECT_THAT(table, HasSubstr("1 of 4 kernel times changed by more than the noise\n"));
  EXPECT_THAT(table, HasSubstr("0 of 4 kernel times changed by more than the noise\n"));
  EXPECT_THAT(table, HasSubstr("roofline, after / before: copies 1.00, 1.00; arithmetic 1.00;"));
  const std::size_t slower = table.find("slower\n");
  EXPECT_NE(slower, std::string::npos);
  EXPECT_LT(slower, table.find("within the noise\n")) << "what changed comes first";
}

}  // namespace
}  // namespace meniscus::bench
