// What a batch says about each frame: one JSON object a line in its log.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace meniscus {

enum class FrameStatus { done, failed, skipped };

/// "done", "failed" or "skipped".
const char* to_string(FrameStatus status);

/// One attempt at one frame. What is not known stays empty or zero.
struct FrameRecord {
  std::int64_t frame = 0;
  FrameStatus status = FrameStatus::done;
  std::string input;
  std::vector<std::string> outputs;
  std::string version;  // of Meniscus
  std::string method, device, host;
  std::string size;   // of the image, pixels: "1024x768"; empty: without a camera
  double radius = 0;  // of the particles, world units
  std::string shard;  // "1/2"; empty: all frames
  std::string again;  // what was wrong with outputs that were there; empty: nothing, or none were
  double start = 0;   // seconds since 1970
  double end = 0;     // the same, when it was over; between its steps it may have waited
  double read_ms = 0, extract_ms = 0, write_ms = 0;
  std::optional<bool> velocities;                            // whether the particles carry them
  double disorder = 0;                                       // of the particles, 0 .. 1
  std::vector<std::pair<std::string, double>> stages;        // host time, ms, in order
  std::vector<std::pair<std::string, std::int64_t>> counts;  // particles, visible ...
  std::optional<double> residual;  // mean over the pixels with surface, particle radii
  std::string hash;                // content_hash as 16 hex digits
  std::uint64_t bytes = 0;         // of all outputs
  std::vector<std::string> warnings;
  std::string error;  // of a failed one

  bool operator==(const FrameRecord&) const = default;
};

/// The record as one line of JSON without its end. Bytes that are no UTF-8 are replaced.
std::string to_json(const FrameRecord& record);

/// A log that is open for more records.
class BatchLog {
 public:
  /// Begins the log or continues it. Throws OutputError, also where the file is no log.
  explicit BatchLog(const std::string& path);
  ~BatchLog();
  BatchLog(const BatchLog&) = delete;
  BatchLog& operator=(const BatchLog&) = delete;

  /// Adds a line in one piece, or, on a full disk, nothing; safe from several threads and processes
  /// at once. A last line without an end, left by a killed process, is removed first. Throws
  /// OutputError.
  void add(const FrameRecord& record);

 private:
  void drop_half_line();

  std::string path_;
  std::mutex mine_;  // of this process's threads, which share one lock on the file
  int descriptor_ = -1;
};

/// Reads a log. A bad last line without an end is left out and `note` says so. Unknown keys are
/// left out, too. Throws InputError that names the line (from 1).
std::vector<FrameRecord> read_log(const std::string& path, std::string* note);

}  // namespace meniscus
