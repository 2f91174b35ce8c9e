// Rows, runs, and what becomes of them.
#include "verify/results.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "cost.hpp"
#include "meniscus/error.hpp"
#include "thrown.hpp"
#include "verify/page.hpp"

namespace meniscus::verify {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

Row row(const char* group, const char* kernel, Result result, double ulp = 0) {
  Row r;
  r.group = group;
  r.device = "PoCL <1>";
  r.kernel = kernel;
  r.variant = "width 8";
  r.size = "block";
  r.result = result;
  r.ulp = ulp;
  r.ms = 1.5;
  return r;
}

VerifyRun two_devices() {
  VerifyRun run;
  run.version = "1.2.3";
  DeviceResults good, bad;
  good.device = {"PoCL <1>", "Portable", "3.1", "OpenCL 3.0"};
  good.rows = {row("kernel", "fit_particles", Result::pass), row("frame", "fit", Result::pass)};
  good.rows[1].reason = "hash 0123456789abcdef";
  good.seconds = 12;
  bad.device = {"Other", "Else", "1", "OpenCL 1.2"};
  bad.rows = {row("kernel", "fit_particles", Result::fail, 3),
              row("frame", "fit", Result::fail, -1),
              row("probe", "64-bit atomics", Result::skip, -1)};
  bad.rows[0].reason = "stage fit, argument quadric";
  bad.rows[1].reason = "hash ffff456789abcdef, wanted 0123456789abcdef";
  bad.rows[2].reason = "no cl_khr_int64_extended_atomics";
  run.devices = {good, bad};
  return run;
}

TEST(VerifyRow, GoesThroughJsonAndBack) {
  Row before = row("kernel", "fit \"groups\"", Result::fail, INFINITY);
  before.required = false;
  before.section = "OpenCL C 1.2, 7.4";
  before.reason = "line\nline";
  const Row after = row_from_json(to_json(before), "here");
  EXPECT_EQ(after.kernel, before.kernel);
  EXPECT_EQ(after.result, before.result);
  EXPECT_EQ(after.ulp, before.ulp);
  EXPECT_EQ(after.reason, before.reason);
  EXPECT_EQ(after.required, before.required);
  EXPECT_EQ(after.section, before.section);
  Row unknown = before;
  unknown.ulp = -1;
  EXPECT_EQ(row_from_json(to_json(unknown), "here").ulp, -1);
}

TEST(VerifyRow, JsonHasTheFieldsThatWerePromised) {
  const auto json = nlohmann::json::parse(to_json(row("kernel", "k", Result::pass)));
  for (const char* field : {"device", "kernel", "variant", "size", "result", "ulp", "reason", "ms"})
    EXPECT_TRUE(json.contains(field)) << field;
  EXPECT_EQ(json["result"], "pass");
}

TEST(VerifyRun, GoesThroughJsonAndBack) {
  const VerifyRun before = two_devices();
  const VerifyRun after = run_from_json(to_json(before), "here");
  ASSERT_EQ(after.devices.size(), 2u);
  EXPECT_EQ(after.version, "1.2.3");
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(after.devices[k].device, before.devices[k].device);
    ASSERT_EQ(after.devices[k].rows.size(), before.devices[k].rows.size());
    EXPECT_EQ(after.devices[k].rows.back().reason, before.devices[k].rows.back().reason);
  }
}

TEST(VerifyRun, AnUnfinishedOneIsNeverGoodAndSaysSoEverywhere) {
  VerifyRun run = two_devices();
  run.devices.resize(1);
  for (Row& row : run.devices[0].rows) row.result = Result::pass;
  ASSERT_TRUE(run.good());
  EXPECT_TRUE(run.finished());
  EXPECT_THAT(to_json(run), Not(HasSubstr("unfinished")));
  const std::string why =
      "stopped by signal 2 (Interrupt) after 3 of 9 parts; not run: 6 of frames";
  run.devices[0].unfinished = why;
  const VerifyRun back = run_from_json(to_json(run), "run.json");
  EXPECT_EQ(back.devices[0].unfinished, why);
  EXPECT_FALSE(back.finished());
  EXPECT_FALSE(back.good());
  EXPECT_STREQ(back.devices[0].verdict(), "INCOMPLETE");
  EXPECT_THAT(table_of(back), HasSubstr("  UNFINISHED: " + why + "\n"));
  EXPECT_THAT(to_junit(back), HasSubstr("<error message=\"" + why + "\"/>"));
  EXPECT_THAT(to_html(back), HasSubstr("<strong>Unfinished:</strong> " + why));
  EXPECT_THAT(comparison_of(two_devices().devices[0], back.devices[0]),
              HasSubstr("   UNFINISHED: " + why + "\n"));
  run.devices[0].rows.clear();
  EXPECT_FALSE(run.devices[0].unusable()) << "nothing is known of it";
  EXPECT_FALSE(run.good());
}

TEST(VerifyRun, PlacesOfDevicesAreWholeNumbers) {
  for (const std::string index : {"1e308", "-1", "0.5", "2", "\"0\""}) {
    std::string text = to_json(two_devices());
    const std::string key = "\"index\":";
    const std::size_t at = text.rfind(key) + key.size();
    text.replace(at, text.find_first_of(",}", at) - at, index);
    EXPECT_THAT(text_of_thrown<InputError>([&] { run_from_json(text, "a.json"); }),
                HasSubstr("must be that of a device"))
        << index;
  }
}

TEST(VerifyRun, SaysWhichFileIsNoRun) {
  for (const char* text : {"", "{}", "[1]", "{\"meniscus\": 3, \"devices\": [], \"rows\": []}",
                           "{\"meniscus\": \"1\", \"devices\": [], \"rows\": [{\"index\": 7}]}"})
    try {
      run_from_json(text, "old.json");
      FAIL() << text;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(),
                  StartsWith("old.json: is not what meniscus verify --json writes: "));
      EXPECT_THAT(error.what(), Not(HasSubstr("json.exception")));
    } catch (const std::exception& error) {
      FAIL() << text << ": " << error.what();
    }
}

TEST(VerifyRun, IsGoodWhenNothingThatIsRequiredFailed) {
  VerifyRun run = two_devices();
  EXPECT_FALSE(run.good());
  run.devices.pop_back();
  EXPECT_TRUE(run.good());
  run.devices[0].rows.push_back(row("probe", "exp", Result::fail, 2));
  EXPECT_FALSE(run.good());
  run.devices[0].rows.back().required = false;
  EXPECT_TRUE(run.good());
  // A device that cannot be used at all is no failure of the others, but alone it is no success.
  DeviceResults unusable;
  unusable.rows = {row("device", "open", Result::skip)};
  run.devices.push_back(unusable);
  EXPECT_TRUE(run.good());
  run.devices.erase(run.devices.begin());
  EXPECT_FALSE(run.good());
  EXPECT_FALSE(VerifyRun{}.good());
}

TEST(VerifyRun, IsIncompleteWhereWhatIsRequiredWasNotTested) {
  DeviceResults device;
  device.rows = {row("kernel", "a", Result::pass), row("kernel", "b", Result::skip)};
  EXPECT_FALSE(device.good());
  EXPECT_STREQ(device.verdict(), "INCOMPLETE");
  VerifyRun run = two_devices();
  run.devices[1] = device;
  EXPECT_FALSE(run.good()) << "beside a device that passed";
  device.rows[1].required = false;
  EXPECT_TRUE(device.good());
  EXPECT_STREQ(device.verdict(), "PASSED");
  device.rows = {row("kernel", "a", Result::skip)};
  EXPECT_STREQ(device.verdict(), "not verified");
  device.rows.push_back(row("kernel", "b", Result::fail));
  EXPECT_STREQ(device.verdict(), "FAILED");
}

TEST(VerifyRun, TableHasRoomForReasonsOfSkips) {
  VerifyRun run;
  run.devices.resize(1);
  for (int k = 0; k < 30; ++k) {
    run.devices[0].rows.push_back(row("kernel", "a", Result::skip));
    run.devices[0].rows.back().reason = "reason " + std::to_string(100 + k / 2);
  }
  EXPECT_THAT(table_of(run), AllOf(HasSubstr("skipped 2: reason 100\n"),
                                   HasSubstr("skipped 2: reason 109\n  skipped 10 for other"),
                                   Not(HasSubstr("reason 110"))));
}

TEST(VerifyRun, TableNamesWhatFailedAndWhy) {
  EXPECT_THAT(
      table_of(two_devices()),
      AllOf(HasSubstr("kernels     1 passed\n"), HasSubstr("1 FAILED"),
            HasSubstr("FAILED kernel fit_particles, width 8, block"), HasSubstr("3.00 ulp"),
            HasSubstr("stage fit, argument quadric"),
            HasSubstr("skipped 1: no cl_khr_int64_extended_atomics"), HasSubstr("PASSED, 12 s")));
}

TEST(VerifyRun, TellsAFailureOfManyKernelsOnce) {
  DeviceResults device;
  for (const char* kernel : {"a", "b", "a", "c"}) {
    device.rows.push_back(row("kernel", kernel, Result::fail));
    device.rows.back().reason = "does not build";
  }
  device.rows[2].reason = "other bits";
  device.rows.push_back(row("kernel", "d", Result::fail));
  device.rows.back().reason = "other bits";
  device.rows.push_back(row("probe", "a", Result::fail));
  device.rows.back().reason = "does not build";
  const std::vector<Failure> failures = device.failures();
  ASSERT_EQ(failures.size(), 2u);
  EXPECT_EQ(failures[0].first, &device.rows[0]);
  EXPECT_EQ(failures[0].cases, 5u);
  EXPECT_EQ(failures[1].first, &device.rows[5]);
}

TEST(VerifyRun, JUnitHasEveryRowOnce) {
  const std::string xml = to_junit(two_devices());
  std::size_t cases = 0;
  for (std::size_t at = 0; (at = xml.find("<testcase", at)) != std::string::npos; ++at) ++cases;
  EXPECT_EQ(cases, 5u);
  EXPECT_THAT(
      xml,
      AllOf(HasSubstr("PoCL &lt;1&gt; (Portable, driver 3.1).kernel\" tests=\"1\" failures=\"0\""),
            HasSubstr("<failure message=\"stage fit, argument quadric\"/>"),
            HasSubstr("<skipped message="), Not(HasSubstr("PoCL <1>"))));
}

TEST(VerifyRun, ComparisonShowsWhatDiffersAndNothingElse) {
  const VerifyRun run = two_devices();
  const Comparison itself = compared(run.devices[0], run.devices[0]);
  EXPECT_TRUE(itself.changes.empty());
  EXPECT_EQ(itself.same, run.devices[0].rows.size());
  const auto changes = compared(run.devices[0], run.devices[1]).changes;
  ASSERT_EQ(changes.size(), 3u);
  EXPECT_EQ(changes[2].before, nullptr);
  EXPECT_EQ(compared(run.devices[1], run.devices[0]).changes.size(), 3u);
  EXPECT_THAT(comparison_of(run.devices[0], run.devices[1]),
              AllOf(HasSubstr("0 rows are the same, 2 differ (2 of them required), 1 only in B\n"),
                    HasSubstr("A  pass, same bits"), HasSubstr("B  fail, 3.00 ulp: stage fit"),
                    Not(HasSubstr("64-bit atomics"))));
  EXPECT_THAT(comparison_of(run.devices[0], run.devices[0]),
              HasSubstr("2 rows are the same, 0 differ"));
}

// Of a kernel with a fault thousands of rows differ, most of them of kernels that it kept from
// running.
TEST(VerifyRun, ComparisonTellsFailuresFirstAndSkipsAsANumber) {
  DeviceResults good, bad;
  for (const char* kernel : {"after", "broken"})
    for (const char* size : {"block", "one", "none"}) {
      good.rows.push_back(row("kernel", kernel, Result::pass));
      good.rows.back().size = size;
    }
  bad = good;
  for (Row& one : bad.rows) {
    one.result = one.kernel == "broken" ? Result::fail : Result::skip;
    one.reason = one.kernel == "broken" ? "other bits" : "the case ended before";
    one.ulp = -1;
  }
  EXPECT_THAT(comparison_of(good, bad),
              AllOf(HasSubstr("0 rows are the same, 6 differ (6 of them required)\n"
                              "kernel broken, width 8, block and on 2 others\n"
                              "  A  pass, same bits\n  B  fail: other bits\n"
                              "skipped in B alone: 3 rows, the first kernel after, width 8, block: "
                              "the case ended before\n")));
  EXPECT_THAT(comparison_of(bad, good), HasSubstr("\nskipped in A alone: 3 rows"));
}

TEST(VerifyRun, DevicesOfOneNameAreToldApart) {
  VerifyRun run = two_devices();
  run.devices[0].device = run.devices[1].device;
  run.devices.push_back(two_devices().devices[0]);
  const VerifyRun back = run_from_json(to_json(run), "a.json");
  EXPECT_EQ(title_of(back.devices[0]), "Other (Else, driver 1), device 0");
  EXPECT_EQ(title_of(back.devices[1]), "Other (Else, driver 1), device 1");
  EXPECT_EQ(title_of(back.devices[2]), "PoCL <1> (Portable, driver 3.1)");
  EXPECT_THAT(table_of(back), AllOf(HasSubstr("Other (Else, driver 1), device 0, OpenCL 1.2\n"),
                                    HasSubstr("Other (Else, driver 1), device 1, OpenCL 1.2\n")));
  EXPECT_THAT(to_junit(back), AllOf(HasSubstr("\"Other (Else, driver 1), device 0.kernel\""),
                                    HasSubstr("\"Other (Else, driver 1), device 1.kernel\"")));
  EXPECT_THAT(to_html(back), AllOf(HasSubstr("Else, driver 1, device 0</small>"),
                                   HasSubstr("<small>Else, driver 1, device 1</small>")));
}

TEST(VerifyRun, SaysWhatToDoAboutFailures) {
  VerifyRun run = two_devices();
  EXPECT_THAT(advice_of(run),
              testing::ElementsAre(HasSubstr("do not use it"),
                                   HasSubstr("verify --kernel fit_particles --repro DIR makes")));
  EXPECT_THAT(to_html(run), HasSubstr("--kernel fit_particles --repro DIR"));
  for (Row& one : run.devices[1].rows) one.required = false;
  EXPECT_THAT(advice_of(run), testing::ElementsAre(StartsWith("Not required is what frames")));
  run.devices.pop_back();
  EXPECT_THAT(advice_of(run), testing::IsEmpty());
}

// Where nothing builds, a row is of a case and names no kernel.
TEST(VerifyRun, ACaseIsNotCalledAKernelNorNamedTwice) {
  VerifyRun run = two_devices();
  Row& one = run.devices[1].rows[0];
  one.kernel = "fit on block";
  one.size = "fit on block, 101 particles, 24x17";
  one.ulp = -1;
  one.reason = "fit.cl did not build";
  EXPECT_EQ(failure_of(one),
            "FAILED case fit on block, width 8, 101 particles, 24x17: fit.cl did not build");
  EXPECT_THAT(advice_of(run), testing::SizeIs(1)) << "it has no reproducer";
}

TEST(VerifyRun, FramesAreComparedWhateverTheVectorWidth) {
  VerifyRun run = two_devices();
  run.devices[1] = run.devices[0];
  run.devices[1].rows[1].variant = "width 1";
  EXPECT_TRUE(compared(run.devices[0], run.devices[1]).changes.empty());
  EXPECT_THAT(to_html(run), Not(HasSubstr("<td class=\"some")));
  // Each as its own program wants it, and yet another.
  run.devices[1].rows[1].reason = "hash 1123456789abcdef";
  EXPECT_THAT(comparison_of(run.devices[0], run.devices[1]),
              AllOf(HasSubstr("1 rows are the same, 1 differ (1 of them required)\n"),
                    HasSubstr("B  pass, same bits: hash 1123")));
  EXPECT_THAT(to_html(run), HasSubstr("<td class=\"some hash\""));
}

TEST(VerifyRun, FramesDrawnBothWaysAreComparedEachWithItsOwn) {
  VerifyRun run = two_devices();
  Row minima = run.devices[0].rows[1];
  minima.variant = "width 8, discs by minima";
  minima.reason = "hash 2223456789abcdef";
  run.devices[0].rows.push_back(minima);
  run.devices[1] = run.devices[0];
  for (Row& row : run.devices[1].rows) row.variant.replace(row.variant.find('8'), 1, "1");
  run.devices[1].rows[0].variant = "width 8";
  const Comparison itself = compared(run.devices[0], run.devices[1]);
  EXPECT_EQ(itself.same, 3u);
  EXPECT_TRUE(itself.changes.empty());
  EXPECT_THAT(to_html(run), AllOf(HasSubstr("0123456789abcdef"), HasSubstr("2223456789abcdef"),
                                  HasSubstr("fit, discs by minima")));
}

TEST(VerifyRun, ComparisonCountsWhatIsRequired) {
  VerifyRun run = two_devices();
  const Comparison all = compared(run.devices[0], run.devices[1]);
  EXPECT_EQ(all.differing(), 2u);
  EXPECT_EQ(all.required(), 2u);
  EXPECT_EQ(all.only_before, 0u);
  EXPECT_EQ(all.only_after, 1u);
  run.devices[0].rows[0].required = run.devices[1].rows[0].required = false;
  EXPECT_EQ(compared(run.devices[0], run.devices[1]).required(), 1u);
}

TEST(VerifyRun, RunsOfOneDeviceAreToldApartByTheirFiles) {
  VerifyRun run = two_devices();
  run.devices[1] = run.devices[0];
  run.devices[0].file = "old.json";
  run.devices[1].file = "new <2>.json";
  EXPECT_THAT(comparison_of(run.devices[0], run.devices[1]),
              AllOf(HasSubstr("A  old.json: PoCL <1> ("), HasSubstr("B  new <2>.json: PoCL")));
  EXPECT_THAT(to_html(run),
              AllOf(HasSubstr("Portable, driver 3.1, old.json"), HasSubstr("new &lt;2&gt;.json")));
}

TEST(VerifyRun, PageShowsDevicesHashesAndFailures) {
  EXPECT_THAT(to_html(two_devices()),
              AllOf(HasSubstr("PoCL &lt;1&gt;"), HasSubstr("0123456789abcdef"),
                    HasSubstr("3.00 ulp"), HasSubstr("What failed"), Not(HasSubstr("PoCL <1>"))));
}

TEST(VerifyRun, SaysWhatFailedInOneLine) {
  const VerifyRun run = two_devices();
  EXPECT_EQ(failure_of(run.devices[1].rows[0]),
            "FAILED kernel fit_particles, width 8, block: 3.00 ulp; stage fit, argument quadric");
}

TEST(VerifyRun, PageOfAKernelOfOthersDoesNotSpeakOfCanonicalBits) {
  VerifyRun run = two_devices();
  EXPECT_THAT(to_html(run), HasSubstr("canonical"));
  for (DeviceResults& device : run.devices) device.rows = {row("program", "mine", Result::pass)};
  EXPECT_THAT(to_html(run), AllOf(HasSubstr("mine, width 8"), Not(HasSubstr("canonical"))));
}

TEST(VerifyRun, PageOfSeveralDevicesSaysWhatDiffers) {
  VerifyRun run = two_devices();
  EXPECT_THAT(to_html(run),
              AllOf(HasSubstr("What differs"),
                    HasSubstr("0 rows the same, <strong>2 other</strong>, 1 only in this one"),
                    HasSubstr("<small>Else, driver 1</small>")));
  run.devices[1] = run.devices[0];
  EXPECT_THAT(to_html(run), HasSubstr("2 rows the same, <strong>0 other"));
  run.devices.pop_back();
  EXPECT_THAT(to_html(run), Not(HasSubstr("What differs")));
}

TEST(VerifyRun, PageShowsInOrangeWhatIsNotRequired) {
  VerifyRun run = two_devices();
  const std::string red = "<td class=\"fail\"", orange = "<td class=\"some\"";
  EXPECT_THAT(to_html(run), AllOf(HasSubstr(red), Not(HasSubstr(orange))));
  run.devices[1].rows[0].required = false;
  EXPECT_THAT(to_html(run), AllOf(HasSubstr(orange), Not(HasSubstr(red))));
}

TEST(VerifyRun, TableTellsLimitsOfOneNameApart) {
  VerifyRun run;
  run.devices.resize(1);
  run.devices[0].rows = {row("limit", "transfer", Result::pass)};
  run.devices[0].rows[0].variant = "upload";
  run.devices[0].rows[0].reason = "10.1 GB/s";
  EXPECT_THAT(table_of(run), HasSubstr("transfer, upload          10.1 GB/s\n"));
}

TEST(VerifyRun, DeepNestingIsAnErrorAndNoCrash) {
  const std::string nested = std::string(200'000, '[') + std::string(200'000, ']');
  EXPECT_THROW(run_from_json("{\"meniscus\": " + nested + "}", "a.json"), InputError);
}

TEST(VerifyRun, TextsOfAFileStayTexts) {
  VerifyRun run = two_devices();
  run.devices[1].rows[0].group = "<script>x</script>";
  run.devices[0].rows[0].group = run.devices[1].rows[0].group;
  EXPECT_THAT(to_html(run), Not(HasSubstr("<script>")));
  run = two_devices();
  run.devices[1].rows[0].reason = "\x1b[2J\x01 \xff";
  run.devices[1].device.name = "a\x07";
  for (const std::string& text : {to_junit(run), to_html(run)})
    EXPECT_THAT(text, AllOf(HasSubstr("\ufffd[2J\ufffd \ufffd"), HasSubstr("a\ufffd"),
                            Not(HasSubstr("\x01")), Not(HasSubstr("\xff"))));
}

TEST(VerifyRun, APageOfMadeUpKernelsHasAnEnd) {
  VerifyRun run = two_devices();
  for (int k = 0; k < 2000; ++k) {
    Row one = run.devices[0].rows[0];
    one.kernel = "k" + std::to_string(k);
    one.variant = "v" + std::to_string(k);
    for (DeviceResults& device : run.devices) device.rows.push_back(one);
  }
  const Cost cost = cost_of([&] {
    if (to_html(run).size() > 10'000'000) _exit(1);
  });
  EXPECT_LT(cost.megabytes, 500);
  EXPECT_THAT(to_html(run), HasSubstr("more lines: too many for one page"));
}

TEST(VerifyRun, OfTooManyDevicesIsRefused) {
  VerifyRun run = two_devices();
  run.devices.resize(65, run.devices[0]);
  EXPECT_THAT(text_of_thrown<InputError>([&] { run_from_json(to_json(run), "a.json"); }),
              AllOf(StartsWith("a.json: "), HasSubstr("65 devices, at most 64")));
}

TEST(VerifyRun, NamesOfDevicesHaveAnEndAndSteerNoTerminal) {
  VerifyRun run = two_devices();
  run.devices[0].device.name = "\x1b]0;title\x07" + std::string(100'000, 'x');
  const VerifyRun back = run_from_json(to_json(run), "a.json");
  EXPECT_THAT(back.devices[0].device.name, StartsWith("\\x1b]0;title\\x07xxx"));
  EXPECT_LT(back.devices[0].device.name.size(), 300u);
}

}  // namespace
}  // namespace meniscus::verify
