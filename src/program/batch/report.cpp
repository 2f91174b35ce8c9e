#include "program/batch/report.hpp"

#include <algorithm>
#include <iterator>

#include "program/batch/frames.hpp"

namespace meniscus {
namespace {

// By the number of the frame, then by age.
std::vector<const FrameRecord*> in_order(const std::vector<FrameRecord>& records) {
  std::vector<const FrameRecord*> order;
  for (const FrameRecord& record : records) order.push_back(&record);
  std::stable_sort(order.begin(), order.end(), [](const FrameRecord* a, const FrameRecord* b) {
    return a->frame != b->frame ? a->frame < b->frame : a->start < b->start;
  });
  // A log that is given twice says nothing new.
  const auto same = [](const FrameRecord* a, const FrameRecord* b) { return *a == *b; };
  order.erase(std::unique(order.begin(), order.end(), same), order.end());
  return order;
}

double busy_seconds(const std::vector<FrameRecord>& records) {
  std::vector<std::pair<double, double>> spans;  // from, to
  for (const FrameRecord& r : records)
    if (r.status != FrameStatus::skipped && r.start > 0) spans.emplace_back(r.start, r.end);
  std::sort(spans.begin(), spans.end());
  double sum = 0, until = 0;
  for (const auto& [from, to] : spans) {
    sum += std::max(0.0, to - std::max(from, until));
    until = std::max(until, to);
  }
  return sum;
}

}  // namespace

std::size_t BatchReport::count(FrameStatus status) const {
  return static_cast<std::size_t>(
      std::count_if(frames.begin(), frames.end(),
                    [&](const FrameHistory& f) { return f.last.status == status; }));
}

BatchReport merge_records(const std::vector<FrameRecord>& records,
                          std::vector<std::int64_t> expected) {
  BatchReport report;
  for (const FrameRecord* record : in_order(records)) {
    if (report.frames.empty() || report.frames.back().last.frame != record->frame)
      report.frames.push_back({*record, 0});
    FrameHistory& frame = report.frames.back();
    if (record->status == FrameStatus::done || frame.last.status != FrameStatus::done)
      frame.last = *record;
    frame.attempts += record->status != FrameStatus::skipped;
  }
  std::vector<std::int64_t> known;
  for (const FrameHistory& f : report.frames) known.push_back(f.last.frame);
  if (expected.empty()) expected = whole_range(known);
  std::sort(expected.begin(), expected.end());
  std::set_difference(expected.begin(), expected.end(), known.begin(), known.end(),
                      std::back_inserter(report.missing));
  report.seconds = busy_seconds(records);
  return report;
}

}  // namespace meniscus
