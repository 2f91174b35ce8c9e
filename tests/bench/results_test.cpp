// What follows from the times, and the JSON.
#include "kernels/results.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "bench/made_up.hpp"
#include "meniscus/error.hpp"
#include "thrown.hpp"

namespace meniscus::bench {
namespace {

TEST(Results, TheFastestLaunchCountsAndTheFastestQuarterIsTheNoise) {
  const Result result = made_up_result("k", kDevice, {1.5, 1.0, 9.0, 1.25, 2.0, 3.0, 2.5, 4.0});
  EXPECT_EQ(result.best_ms(), 1.0);
  EXPECT_EQ(result.noise_ms(), 0.5);
  EXPECT_DOUBLE_EQ(result.rate(), 1e6);    // 1000 in a millisecond
  EXPECT_DOUBLE_EQ(result.gb_per_s(), 1);  // 1e6 bytes in a millisecond
  EXPECT_DOUBLE_EQ(result.gflops(), 2);
  EXPECT_DOUBLE_EQ(result.intensity(), 2);
}

TEST(Results, ShareIsThatOfTheNearestLimit) {
  Roofline roofline;
  roofline.copy = {{1, 10.0}};
  roofline.fused_gflops = 8;
  roofline.plain_gflops = 5;
  roofline.spread_atomics = 0.1;
  Result result = made_up_result("k", kDevice, {1.0});
  EXPECT_DOUBLE_EQ(share_of_roofline(result, roofline).value, 0.25);  // 2 of 8 GFLOP/s
  EXPECT_EQ(share_of_roofline(result, roofline).limit, "arithmetic");
  result.bytes = 9e6;
  EXPECT_DOUBLE_EQ(share_of_roofline(result, roofline).value, 0.9);
  EXPECT_EQ(share_of_roofline(result, roofline).limit, "memory");
  result.atomics = 95e3;
  EXPECT_DOUBLE_EQ(share_of_roofline(result, roofline).value, 0.95);
  EXPECT_EQ(share_of_roofline(result, roofline).limit, "atomics");
  roofline.empty_kernel_us = 970;
  EXPECT_DOUBLE_EQ(share_of_roofline(result, roofline).value, 0.97);
  EXPECT_EQ(share_of_roofline(result, roofline).limit, "launch");
  EXPECT_EQ(share_of_roofline(result, roofline).ceiling, 970);
}

TEST(Results, WhatIsNotCountedHasNoShare) {
  const Roofline& roofline = made_up_session(2).roofline;
  Result result = made_up_result("k", kDevice, {1.0});
  EXPECT_TRUE(share_of_roofline(result, roofline).counted());
  result.whole_stage = true;
  EXPECT_FALSE(share_of_roofline(result, roofline).counted());
  result.whole_stage = false;
  result.operations = 0;
  EXPECT_FALSE(share_of_roofline(result, roofline).counted());
}

TEST(Results, TheBetterOfTwoRooflinesCounts) {
  Roofline a, b;
  a.copy = {{1, 10}, {2, 30}};
  b.copy = {{1, 20}, {2, 20}};
  a.fused_gflops = 200, b.fused_gflops = 100;
  a.launch_us = 5, b.launch_us = 4;
  a.empty_kernel_us = 1, b.empty_kernel_us = 2;
  const Roofline better = better_of(a, b);
  EXPECT_EQ(better.copy[0].gb_per_s, 20);
  EXPECT_EQ(better.copy[1].gb_per_s, 30);
  EXPECT_EQ(better.fused_gflops, 200);
  EXPECT_EQ(better.launch_us, 4);
  EXPECT_EQ(better.empty_kernel_us, 1);
}

TEST(Results, VerdictsAreOnTheLargestSizeWithAllThreads) {
  const BenchRun run = made_up_run();
  const std::vector<Verdict> verdicts = judge(run);
  ASSERT_EQ(verdicts.size(), 3u);
  for (const Verdict& verdict : verdicts) EXPECT_EQ(verdict.session, &run.sessions[0]);
  EXPECT_EQ(verdicts[0].result->kernel, "quick");
  EXPECT_DOUBLE_EQ(verdicts[0].against_one, 0.9);
  EXPECT_DOUBLE_EQ(verdicts[0].against_all, 0.9);
  EXPECT_TRUE(verdicts[0].near_limit());
  EXPECT_EQ(verdicts[1].result->kernel, "slow");
  EXPECT_EQ(verdicts[1].result->particles, 4000);
  EXPECT_DOUBLE_EQ(verdicts[1].against_all, 0.5);
  EXPECT_FALSE(verdicts[1].near_limit());
  EXPECT_EQ(verdicts[2].against_one, 0);
  EXPECT_FALSE(verdicts[2].near_limit());
  EXPECT_TRUE(verdicts[2].open());  // nothing to compare with
  EXPECT_FALSE(verdicts[1].open());
}

TEST(Results, BothNumbersOfThreadsMustBeNearTheNativeVersion) {
  BenchRun run = made_up_run();
  for (Result& result : run.sessions[1].results)  // one thread
    if (result.kernel == "quick" && result.variant == kDevice) result.ms = {1.2};
  EXPECT_DOUBLE_EQ(judge(run)[0].against_one, 0.75);
  EXPECT_FALSE(judge(run)[0].near_limit());
  // ... unless the roofline is near: 1e6 bytes a millisecond of 1.4 GB/s.
  run.sessions[0].roofline.copy = {{1e6, 1.4}};
  EXPECT_TRUE(judge(run)[0].near_limit());
}

TEST(Results, VerdictsAreDrawnFromWhatWasMeasured) {
  BenchRun run = made_up_run();
  run.sessions.pop_back();  // no session with one thread
  EXPECT_TRUE(judge(run)[0].near_limit());
  EXPECT_DOUBLE_EQ(judge(run)[0].against_native(), 0.9);
  EXPECT_FALSE(judge(run)[1].near_limit());
  EXPECT_FALSE(judge(run)[1].open());
  // Native versions that are not compiled for the processor tell nothing.
  run.sessions[0].native_flags = false;
  for (const Verdict& verdict : judge(run)) EXPECT_TRUE(verdict.open()) << verdict.result->kernel;
}

TEST(Results, ABusyMachineIsSaidToBe) {
  Session session = made_up_session(2);
  session.other_work = 0.2;
  EXPECT_FALSE(session.disturbed());
  session.other_work = 0.3;
  EXPECT_TRUE(session.disturbed());
  session.threads = 1;
  EXPECT_FALSE(session.disturbed()) << "there are two processors";
  session.other_work = 1.3;
  EXPECT_TRUE(session.disturbed());
  session.kind = "GPU";
  EXPECT_FALSE(session.disturbed());
}

TEST(Results, JsonComesBackAsItWas) {
  BenchRun run = made_up_run();
  run.sessions[0].results[2].note = "a note";
  run.sessions[0].results[2].atomics = 12;
  const std::string text = to_json(run);
  const BenchRun again = from_json(text, "old.json");
  EXPECT_EQ(to_json(again), text);
  EXPECT_EQ(again.sessions[0].results[2].note, "a note");
  EXPECT_EQ(again.sessions[1].threads, 1);
  EXPECT_EQ(again.sessions[1].results[0].ms, run.sessions[1].results[0].ms);
}

TEST(Results, JsonHoldsTheDerivedFiguresUnderTheirNames) {
  const auto json = nlohmann::json::parse(to_json(made_up_run()));
  EXPECT_EQ(json.at("kernel_benchmarks"), 1);
  EXPECT_EQ(json.at("meniscus"), "1.2.3");
  const auto& session = json.at("sessions").at(0);
  for (const char* key : {"device", "kind", "platform", "driver", "compute_units", "processors",
                          "threads", "other_work", "native_benchmarks"})
    EXPECT_TRUE(session.contains(key)) << key;
  for (const char* key : {"copy", "fused_gflops", "plain_gflops", "launch_us", "batched_launch_us",
                          "empty_kernel_us", "spread_atomics_g_per_s", "contended_atomics_g_per_s"})
    EXPECT_TRUE(session.at("roofline").contains(key)) << key;
  const auto& result = session.at("results").at(0);
  EXPECT_EQ(result.at("kernel"), "quick");
  EXPECT_DOUBLE_EQ(result.at("best_ms"), 1.0);
  EXPECT_NEAR(result.at("noise_ms"), 0.1, 1e-12);
  EXPECT_DOUBLE_EQ(result.at("against_native"), 0.9);
  EXPECT_DOUBLE_EQ(result.at("rate"), 1e6);
  EXPECT_EQ(result.at("limit"), "memory");
  EXPECT_FALSE(session.at("results").at(1).contains("against_native"));
}

void expect_refused(const std::string& text, const std::string& part) {
  const std::string said = text_of_thrown<InputError>([&] { from_json(text, "old.json"); });
  EXPECT_THAT(said, testing::StartsWith("old.json: "));
  EXPECT_THAT(said, testing::HasSubstr(part));
  EXPECT_THAT(said, testing::Not(testing::HasSubstr("json.exception")));
}

TEST(Results, OtherFilesAreRefused) {
  expect_refused("", "meniscus bench --json");
  expect_refused("[1, 2", "meniscus bench --json");
  expect_refused("{}", "kernel_benchmarks");
  expect_refused(R"({"kernel_benchmarks": 7})", "kernel_benchmarks is 7");
  auto json = nlohmann::json::parse(to_json(made_up_run()));
  json["sessions"][0]["results"][0]["ms"] = nlohmann::json::array();
  expect_refused(json.dump(), "quick");
  json["sessions"][0]["results"][0]["ms"] = {0.0};
  expect_refused(json.dump(), "quick");
  const auto good = nlohmann::json::parse(to_json(made_up_run()));
  for (const char* const key : {"particles", "width", "height"})
    for (const nlohmann::json& value : {nlohmann::json(1e300), nlohmann::json(-1e300),
                                        nlohmann::json(2.5), nlohmann::json(UINT64_MAX)}) {
      json = good;
      json["sessions"][0]["results"][0][key] = value;
      expect_refused(json.dump(), std::string(key) + " is " + value.dump());
    }
  json = good;
  json["sessions"][0]["threads"] = 1e10;
  expect_refused(json.dump(), "threads is 10000000000.0");
  json = good;
  json["sessions"][0]["results"][0].erase("kernel");
  expect_refused(json.dump(), "kernel");
}

TEST(Results, DeepNestingIsAnErrorAndNoCrash) {
  expect_refused(
      "{\"kernel_benchmarks\": " + std::string(200'000, '[') + std::string(200'000, ']') + "}",
      "nests deeper than 32 levels");
}

}  // namespace
}  // namespace meniscus::bench
