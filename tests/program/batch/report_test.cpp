#include "program/batch/report.hpp"

#include <gmock/gmock.h>

#include <regex>

#include "meniscus/extract.hpp"
#include "program/page/tags.hpp"

namespace meniscus {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

FrameRecord record(std::int64_t frame, FrameStatus status = FrameStatus::done, double start = 100) {
  FrameRecord r;
  r.frame = frame;
  r.status = status;
  r.method = "fit";
  r.start = start;
  r.end = start + 1;
  r.host = "node1";
  if (status == FrameStatus::done) {
    r.device = "cpu";
    r.read_ms = 10;
    r.extract_ms = 200;
    r.write_ms = 50;
    r.stages = {{"project", 120}, {"fit", 60}};
    r.counts = {{"particles", 4913}, {"visible", 800}, {"fits", 700}};
    r.residual = 0.05;
    r.hash = "00000000000000aa";
    r.bytes = 1 << 20;
  }
  if (status == FrameStatus::failed) r.error = "dam.ply: is empty (0 bytes)";
  return r;
}

std::vector<FrameRecord> records(std::int64_t count) {
  std::vector<FrameRecord> all;
  for (std::int64_t frame = 1; frame <= count; ++frame)
    all.push_back(record(frame, FrameStatus::done, 100.0 + static_cast<double>(frame)));
  return all;
}

std::size_t occurrences(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size())
    ++count;
  return count;
}

// --- merging ------------------------------------------------------------------------------------

TEST(MergeRecords, TheLastDoneAttemptCountsWhateverTheOrder) {
  const FrameRecord first = record(7, FrameStatus::failed, 10),
                    second = record(7, FrameStatus::done, 20),
                    third = record(7, FrameStatus::done, 30),
                    late = record(7, FrameStatus::failed, 40),
                    skipped = record(7, FrameStatus::skipped, 50);
  std::vector<FrameRecord> all{first, second, third, late, skipped};
  std::vector<std::size_t> order{0, 1, 2, 3, 4};
  do {
    std::vector<FrameRecord> shuffled;
    for (const std::size_t k : order) shuffled.push_back(all[k]);
    const BatchReport report = merge_records(shuffled);
    ASSERT_EQ(report.frames.size(), 1u);
    EXPECT_EQ(report.frames[0].last, third);
    EXPECT_EQ(report.frames[0].attempts, 4) << "skipping is no attempt";
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(MergeRecords, WithoutADoneOneTheLastOfAllCounts) {
  EXPECT_EQ(merge_records({record(1, FrameStatus::skipped, 20), record(1, FrameStatus::failed, 10)})
                .count(FrameStatus::skipped),
            1u)
      << "made by a run whose log is not here";
  EXPECT_EQ(merge_records({record(1, FrameStatus::skipped, 10), record(1, FrameStatus::failed, 20)})
                .count(FrameStatus::failed),
            1u);
}

TEST(MergeRecords, ALogGivenTwiceChangesNothing) {
  std::vector<FrameRecord> twice = records(3);
  for (const FrameRecord& r : records(3)) twice.push_back(r);
  const BatchReport once = merge_records(records(3)), report = merge_records(twice);
  EXPECT_EQ(report.frames.size(), 3u);
  EXPECT_EQ(report.frames[0].attempts, 1);
  EXPECT_EQ(report.seconds, once.seconds);
}

TEST(MergeRecords, MissingFramesAreThoseExpected) {
  EXPECT_THAT(merge_records({record(4), record(1), record(2)}).missing, ElementsAre(3));
  EXPECT_THAT(merge_records({record(10), record(4), record(6)}).missing, ElementsAre(8))
      << "every second";
  EXPECT_THAT(merge_records({record(5), record(1)}).missing, IsEmpty());
  EXPECT_THAT(merge_records({record(2)}, {3, 1, 2}).missing, ElementsAre(1, 3));
  EXPECT_THAT(merge_records({record(2), record(9)}, {2}).missing, IsEmpty());
  EXPECT_THAT(merge_records({record(1), record(2), record(1'000'000'000'000)}).missing, IsEmpty())
      << "a stray number";
  EXPECT_THAT(merge_records({}).missing, IsEmpty());
}

TEST(MergeRecords, SecondsAreThoseInWhichAFrameWasUnderWay) {
  auto at = [](double start, double end, FrameStatus status = FrameStatus::done) {
    FrameRecord r = record(static_cast<std::int64_t>(start), status, start);
    r.end = end;
    return r;
  };
  // 10 to 14 in three that overlap, 20 to 21; the next day is far away, and skipping is no work.
  EXPECT_DOUBLE_EQ(merge_records({at(20, 21), at(10, 13), at(11, 12), at(12, 14),
                                  at(30, 40, FrameStatus::skipped)})
                       .seconds,
                   5);
}

// --- the page -----------------------------------------------------------------------------------

TEST(BatchPage, IsWholeAndNeedsNothingElse) {
  std::vector<FrameRecord> all = records(9);
  all[3] = record(4, FrameStatus::failed);
  all[4] = record(5, FrameStatus::skipped);
  all[5].warnings = {"a", "b"};
  all[8].host = "node2";
  BatchReport report = merge_records(all, {1, 2, 3, 4, 5, 6, 7, 8, 9, 12});
  report.notes = {"a.jsonl: line 3 is cut off"};
  const std::string page = to_html(report);
  expect_whole_page(page);
  for (const char* part :
       {"8 of 10 frames are done", "<b>7</b><span>done", "<b>1</b><span>failed",
        "<b>1</b><span>missing", "<b>1</b><span>there already", "a.jsonl: line 3 is cut off",
        "dam.ply: is empty", "2 devices", "2 hosts", "00000000000000aa", "Who did the work"})
    EXPECT_THAT(page, HasSubstr(part));
}

TEST(BatchPage, FailuresThatDifferInTheirNumbersShareARow) {
  std::vector<FrameRecord> all = records(20);
  for (std::size_t k = 4; k < 14; ++k) {
    all[k] = record(all[k].frame, FrameStatus::failed);
    all[k].error = "dam." + std::to_string(k + 1) + ".ply: is empty (0 bytes)";
  }
  all[17] = record(18, FrameStatus::failed);
  all[17].error = "dam.18.ply: is no PLY";
  const std::string page = to_html(merge_records(all));
  EXPECT_THAT(page, HasSubstr("<td>5-14</td>"));
  EXPECT_THAT(page, HasSubstr("dam.5.ply: is empty (0 bytes) (the first; the others differ"));
  EXPECT_THAT(page, Not(HasSubstr("dam.6.ply")));
  EXPECT_THAT(page, HasSubstr("dam.18.ply: is no PLY</td>"));
}

// What made the frames, whatever program makes the page.
TEST(BatchPage, NamesTheVersionsThatMadeTheFrames) {
  std::vector<FrameRecord> all = records(2);
  EXPECT_THAT(to_html(merge_records(all)), HasSubstr("Meniscus " + version()));
  all[0].version = "0.1.2";
  all[1].version = "0.1.3";
  EXPECT_THAT(to_html(merge_records(all)), HasSubstr("Meniscus 0.1.2, 0.1.3: frames"));
}

TEST(BatchPage, EscapesEveryTextOfARecord) {
  const std::string evil = "<script>alert(\"&\")</script>";
  FrameRecord good = record(1), bad = record(2, FrameStatus::failed);
  for (FrameRecord* r : {&good, &bad})
    for (std::string* text : {&r->input, &r->method, &r->device, &r->host, &r->shard, &r->hash})
      *text = evil + (r == &good ? "1" : "2");
  good.outputs = {evil + ".png"};
  good.stages = {{evil, 3}};
  good.counts.emplace_back(evil, 3);
  good.warnings = {evil};
  bad.error = evil;
  BatchReport report = merge_records({good, bad});
  report.notes = {evil};
  const std::string page = to_html(report);
  expect_whole_page(page);
  EXPECT_THAT(page, HasSubstr("&lt;script&gt;alert(&quot;&amp;&quot;)&lt;/script&gt;"));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
}

TEST(BatchPage, IsWholeForAnyFewRecords) {
  FrameRecord bare;  // an old or foreign log may have no more
  bare.frame = -3;
  FrameRecord zero = record(2);
  zero.extract_ms = zero.read_ms = zero.write_ms = 0;
  zero.counts = {{"particles", 0}};
  zero.residual = 0;
  for (const std::vector<FrameRecord>& all : {std::vector<FrameRecord>{},
                                              {bare},
                                              {zero},
                                              {bare, zero},
                                              {record(1)},
                                              {record(1, FrameStatus::failed)},
                                              {record(1, FrameStatus::skipped)},
                                              {record(1), record(1'000'000'000'000)}}) {
    const std::string page = to_html(merge_records(all));
    expect_whole_page(page);
    EXPECT_FALSE(std::regex_search(page, std::regex("[\" >-](nan|inf)")));
  }
  EXPECT_THAT(to_html(merge_records({})), HasSubstr("No frames"));
  EXPECT_THAT(to_html(merge_records({record(1)})), HasSubstr("The frame is done"));
  EXPECT_THAT(to_html(merge_records(records(3))), HasSubstr("All 3 frames are done"));
}

TEST(BatchPage, TimesBeyondAnyCalendarAreUnknown) {
  FrameRecord late = record(1);
  late.start = 1e38;
  late.end = 1e308;
  EXPECT_THAT(to_html(merge_records({late})), HasSubstr("an unknown time"));
}

TEST(BatchPage, WarningsThatDifferInNumbersAreOneRow) {
  std::vector<FrameRecord> all = records(4);
  all[0].warnings = {"3 particles were dropped", "no radius"};
  all[1].warnings = {"12 particles were dropped"};
  all[3].warnings = {"no radius"};
  const std::string page = to_html(merge_records(all));
  EXPECT_THAT(page, HasSubstr("3 particles were dropped (the first"));
  EXPECT_THAT(page, Not(HasSubstr("12 particles were dropped")));
  EXPECT_EQ(occurrences(page, "no radius"), 1u);
  EXPECT_THAT(page, HasSubstr("<td>1,4</td>"));
  EXPECT_EQ(to_html(merge_records(records(4))).find("What went wrong"), std::string::npos);
}

TEST(BatchPage, AttemptsAreCounted) {
  const std::string page = to_html(merge_records(
      {record(1, FrameStatus::failed, 1), record(1, FrameStatus::failed, 2), record(2)}));
  EXPECT_THAT(page, HasSubstr("is empty (0 bytes) (2 attempts)"));
  EXPECT_THAT(page, HasSubstr("<b>1</b><span>further attempts"));
}

TEST(BatchPage, ThousandsOfFramesStayASmallPage) {
  std::vector<FrameRecord> all = records(5000);
  for (std::size_t k = 0; k < all.size(); k += 7) {
    all[k] = record(all[k].frame, FrameStatus::failed);
    std::string word;  // so that no two are of one kind
    for (std::size_t rest = k; rest > 0; rest /= 26) word += static_cast<char>('a' + rest % 26);
    all[k].error = "/a/rather/long/path/to/a/frame/of/" + word + ".ply: is empty (0 bytes)";
  }
  const std::string page = to_html(merge_records(all));
  EXPECT_LT(page.size(), 3'000'000u);
  EXPECT_THAT(page, HasSubstr("and 215 frames more"));
  EXPECT_THAT(page, HasSubstr("<b>715</b><span>failed"));
}

// --- plots --------------------------------------------------------------------------------------

TEST(BatchPlots, CurvesHaveGapsWhereFramesHaveNoValue) {
  std::vector<FrameRecord> all = records(10);
  all[3] = record(4, FrameStatus::failed);
  all.erase(all.begin() + 6);  // frame 7
  const std::string page = to_html(merge_records(all));
  const std::size_t at = page.find("<path class=\"curve\" d=\"");
  ASSERT_NE(at, std::string::npos);
  const std::string path = page.substr(at, page.find("/>", at) - at);
  EXPECT_EQ(occurrences(path, "M"), 3u) << path;  // 1-3, 5-6, 8-10
  EXPECT_EQ(occurrences(path, "L"), 2u + 1u + 2u) << path;
}

TEST(BatchPlots, EverythingDrawnLiesInsideItsDrawing) {
  std::vector<FrameRecord> all = records(700);
  for (std::size_t k = 0; k < all.size(); ++k) {
    all[k].extract_ms = static_cast<double>(k * k % 977);
    all[k].residual = 1.0 / static_cast<double>(k + 1);
    if (k % 50 == 0) all[k] = record(all[k].frame, FrameStatus::failed);
  }
  const std::string page = to_html(merge_records(all));
  const std::regex drawing("<svg viewBox=\"0 0 (\\d+) (\\d+)\"");
  const std::regex place("[ML]([0-9.-]+) ([0-9.-]+)"), bar("V([0-9.-]+)");
  int checked = 0;
  for (std::sregex_iterator d(page.begin(), page.end(), drawing), end; d != end; ++d) {
    const double width = std::stod((*d)[1]), height = std::stod((*d)[2]);
    const auto begin = static_cast<std::size_t>(d->position());
    const std::string svg = page.substr(begin, page.find("</svg>", begin) - begin);
    for (std::sregex_iterator p(svg.begin(), svg.end(), place); p != end; ++p, ++checked) {
      ASSERT_GE(std::stod((*p)[1]), 0);
      ASSERT_LE(std::stod((*p)[1]), width);
      ASSERT_GE(std::stod((*p)[2]), 0);
      ASSERT_LE(std::stod((*p)[2]), height);
    }
    for (std::sregex_iterator p(svg.begin(), svg.end(), bar); p != end; ++p) {
      ASSERT_GE(std::stod((*p)[1]), 0);
      ASSERT_LE(std::stod((*p)[1]), height);
    }
  }
  EXPECT_GT(checked, 2000);
}

}  // namespace
}  // namespace meniscus
