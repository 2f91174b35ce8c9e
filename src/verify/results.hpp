// What a run of verify found, and its JSON, JUnit XML and tables.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "verify/row.hpp"

namespace meniscus::verify {

/// A device as the results name it.
struct DeviceName {
  std::string name, platform, driver, version;
  bool operator==(const DeviceName&) const = default;
};

/// How many rows passed, failed and were skipped.
struct Tally {
  std::size_t passed = 0, failed = 0, skipped = 0;
  std::size_t all() const { return passed + failed + skipped; }
  void add(Result result);
  /// "1,020 passed, 2 FAILED, 3 skipped".
  std::string words() const;
};

/// A failure in several sizes, or in several kernels for the very same reason.
struct Failure {
  const Row* first;
  std::size_t cases;
};

/// All that was found on one device.
struct DeviceResults {
  DeviceName device;
  std::string file;  // that it was read from, as --compare names it; empty: none
  int number = -1;   // its place among the devices, where another one has its name; see title_of
  std::vector<Row> rows;
  double seconds = 0;
  std::string unfinished;  // why, and what was not run; empty: the run came to its end

  /// Of the rows of each group, in the order of a report; groups without rows are left out.
  std::vector<std::pair<std::string, Tally>> tallies() const;
  /// Failures by group, kernel and variant, in the order of their first rows. Those of a group with
  /// the same reason, as where nothing builds, are one.
  std::vector<Failure> failures() const;
  /// Whether it could not be opened: there is nothing to judge.
  bool unusable() const;
  /// Whether it was finished, something passed, and every row that is required did.
  bool good() const;
  /// "PASSED", "FAILED", "INCOMPLETE" (required rows were skipped, or not run) or "not verified"
  /// (nothing that is required was tested).
  const char* verdict() const;
};

/// What one call of `verify` found.
struct VerifyRun {
  std::string version;  // of Meniscus
  std::vector<DeviceResults> devices;
  bool good() const;
  /// Whether it came to its end on all devices.
  bool finished() const;
  /// Devices that have the same name, as two GPUs of one kind, get their places as numbers.
  void number_namesakes();
};

const char* to_string(Result result);

/// One row as a JSON object in one line, and back. Throws InputError, naming `name`.
std::string to_json(const Row& row);
Row row_from_json(const std::string& text, const std::string& name);

/// {"meniscus", "devices": [{"name", "platform", "driver", "version", "seconds"}], "rows":
/// [{"device", "kernel", "variant", "size", "result", "ulp", "reason", "ms", "group", "required",
/// "section"}]}; "device" in a row is the device's name, "index" its place in "devices". A device
/// whose run did not come to its end has "unfinished", in words.
std::string to_json(const VerifyRun& run);
VerifyRun run_from_json(const std::string& text, const std::string& name);

/// A test suite a device and group, a test case a row; an error of its own where a run was not
/// finished.
std::string to_junit(const VerifyRun& run);

/// What failed, in one line, for when it happens.
std::string failure_of(const Row& row);

/// For the terminal: what passed by group, then every row that failed, and why rows were skipped.
std::string table_of(const VerifyRun& run);

/// What failures mean, and what to do about them, a line each; empty where nothing failed.
std::vector<std::string> advice_of(const VerifyRun& run);

/// Rows that differ between two devices, side by side.
struct Change {
  const Row *before, *after;  // null: there is none
};
struct Comparison {
  std::size_t same = 0;  // rows
  std::vector<Change> changes;
  std::size_t only_before = 0, only_after = 0;  // of the changes: rows of one run alone
  std::size_t differing() const { return changes.size() - only_before - only_after; }
  /// Of those that differ, the ones that must pass on a device.
  std::size_t required() const;
};
/// Rows of the same variant are compared. That of a whole frame is without the vector width, with
/// which its hash does not change: "" or "discs by minima".
std::string compared_variant(const Row& row);
Comparison compared(const DeviceResults& before, const DeviceResults& after);

/// How many rows are the same, and what differs: first where a row failed, the first case of each
/// kernel and variant, then how many were skipped on one device alone.
std::string comparison_of(const DeviceResults& before, const DeviceResults& after);

/// "PoCL device (driver 3.1)"; of results from a file "old.json: PoCL device (driver 3.1)"; of one
/// of two with this name "PoCL device (driver 3.1), device 1".
std::string title_of(const DeviceName& device);
std::string title_of(const DeviceResults& results);

/// ", device 1" of one of two with the same name; else nothing.
std::string number_words(const DeviceResults& results);

/// "3 ulp", "same bits" or empty.
std::string error_of(const Row& row);

}  // namespace meniscus::verify
