// What became of each frame of a batch, from the records of all who worked on it, and a page that
// shows it.
#pragma once

#include <string>
#include <vector>

#include "program/batch/record.hpp"

namespace meniscus {

/// A frame over all its attempts.
struct FrameHistory {
  FrameRecord last;  // the last one that is done; else the last of all
  int attempts = 0;  // how often it was worked on; skipping it is none
};

struct BatchReport {
  std::vector<FrameHistory> frames;   // ascending, each once
  std::vector<std::int64_t> missing;  // ascending: expected, but in no record
  double seconds = 0;                 // in which some frame was under way
  std::vector<std::string> notes;     // what the reader should know, one line each

  std::size_t count(FrameStatus status) const;
};

/// Brings records in any order together. `expected` are the frames that there should be; empty:
/// those from the first record's to the last one's, by the step that all of them keep. A record is
/// older than another by when it began, then by its place.
BatchReport merge_records(const std::vector<FrameRecord>& records,
                          std::vector<std::int64_t> expected = {});

/// The report as one page that needs nothing else, with pictures of at most 96 frames, which are
/// made from their PNG or else EXR outputs. Outputs that cannot be read are said to be so.
std::string to_html(const BatchReport& report);

}  // namespace meniscus
