#include "program/batch/record.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>

#include "io/input_file.hpp"
#include "io/json_number.hpp"
#include "io/json_text.hpp"
#include "io/output_file.hpp"
#include "meniscus/io.hpp"

namespace meniscus {
namespace {

using Json = nlohmann::ordered_json;

constexpr FrameStatus kStatuses[] = {FrameStatus::done, FrameStatus::failed, FrameStatus::skipped};

// What is wrong with a line, in words.
struct BadLine {
  std::string what;
};

[[noreturn]] void wanted(const std::string& key, const Json& found, const char* what) {
  throw BadLine{"\"" + key + "\" is " + in_quotes_of(found) + ", wanted " + what};
}

void take(const std::string& key, const Json& value, std::string& text) {
  if (!value.is_string()) wanted(key, value, "text");
  text = value.get<std::string>();
}

void take(const std::string& key, const Json& value, double& number) {
  if (!value.is_number()) wanted(key, value, "a number");
  number = value.get<double>();
}

void take(const std::string& key, const Json& value, bool& yes) {
  if (!value.is_boolean()) wanted(key, value, "true or false");
  yes = value.get<bool>();
}

template <std::integral Integer>
void take(const std::string& key, const Json& value, Integer& number) {
  const auto whole = whole_number<Integer>(value);
  if (!whole) wanted(key, value, "a whole number");
  number = *whole;
}

template <class Value>
void take(const std::string& key, const Json& value, std::optional<Value>& known) {
  if (!value.is_null()) take(key, value, known.emplace());
}

template <class Value>
void take(const std::string& key, const Json& value, std::vector<Value>& list) {
  if (!value.is_array()) wanted(key, value, "a list");
  for (const Json& entry : value) take(key, entry, list.emplace_back());
}

template <class Value>
void take(const std::string& key, const Json& value,
          std::vector<std::pair<std::string, Value>>& table) {
  if (!value.is_object()) wanted(key, value, "{\"name\": number, ...}");
  for (const auto& [name, entry] : value.items()) {
    table.emplace_back(name, Value{});
    take(key, entry, table.back().second);
  }
}

void take(const std::string& key, const Json& value, FrameStatus& status) {
  for (const FrameStatus known : kStatuses)
    if (value == to_string(known)) {
      status = known;
      return;
    }
  wanted(key, value, "done, failed or skipped");
}

// All entries of a record with their names, in the order in which they are written.
template <class Record, class Visit>
void for_each_entry(Record& r, const Visit& visit) {
  visit("frame", r.frame);
  visit("status", r.status);
  visit("input", r.input);
  visit("outputs", r.outputs);
  visit("version", r.version);
  visit("method", r.method);
  visit("device", r.device);
  visit("host", r.host);
  visit("shard", r.shard);
  visit("again", r.again);
  visit("size", r.size);
  visit("radius", r.radius);
  visit("start", r.start);
  visit("end", r.end);
  visit("read_ms", r.read_ms);
  visit("extract_ms", r.extract_ms);
  visit("write_ms", r.write_ms);
  visit("velocities", r.velocities);
  visit("disorder", r.disorder);
  visit("stages", r.stages);
  visit("counts", r.counts);
  visit("residual", r.residual);
  visit("hash", r.hash);
  visit("bytes", r.bytes);
  visit("warnings", r.warnings);
  visit("error", r.error);
}

Json json_of(FrameStatus status) { return to_string(status); }
Json json_of(const std::string& text) { return text; }
Json json_of(std::integral auto number) { return number; }
Json json_of(const std::vector<std::string>& list) { return list; }
Json json_of(double number) {
  // Whole microseconds are more than enough, and keep the lines short.
  return std::round(number * 1e6) / 1e6;
}
template <class Value>
Json json_of(const std::optional<Value>& known) {
  return known ? json_of(*known) : Json(nullptr);
}
template <class Value>
Json json_of(const std::vector<std::pair<std::string, Value>>& table) {
  Json result = Json::object();
  for (const auto& [name, value] : table) result[name] = json_of(value);
  return result;
}

FrameRecord record_of(const std::string& line) {
  Json root;
  try {
    root = parse_json<Json>(line);
  } catch (const InputError&) {
    throw BadLine{"is not JSON, wanted what --log writes: " + in_quotes(line)};
  }
  if (!root.is_object()) throw BadLine{"is " + in_quotes(line) + ", wanted {\"frame\": ...}"};
  FrameRecord record;
  for (const char* key : {"frame", "status"})
    if (!root.contains(key)) throw BadLine{std::string("has no \"") + key + "\""};
  for_each_entry(record, [&](const char* key, auto& value) {
    const auto found = root.find(key);
    if (found != root.end()) take(key, *found, value);
  });
  if (record.frame < -kLastFrame || record.frame > kLastFrame)
    wanted("frame", root["frame"], "a whole number of at most 18 digits");
  return record;
}

}  // namespace

const char* to_string(FrameStatus status) {
  switch (status) {
    case FrameStatus::done:
      return "done";
    case FrameStatus::failed:
      return "failed";
    case FrameStatus::skipped:
      return "skipped";
  }
  throw InvalidArgument("unknown status of a frame");
}

std::string to_json(const FrameRecord& record) {
  Json root = Json::object();
  for_each_entry(record, [&](const char* key, const auto& value) { root[key] = json_of(value); });
  if (record.status != FrameStatus::failed) root.erase("error");
  for (const char* text : {"version", "size", "again"})
    if (root[text] == "") root.erase(text);
  if (record.radius == 0)
    root.erase("radius");
  else
    root["radius"] = record.radius;  // all digits: units may be of any size
  if (!record.velocities) root.erase("velocities");
  if (record.disorder == 0) root.erase("disorder");
  return root.dump(-1, ' ', false, Json::error_handler_t::replace);
}

BatchLog::BatchLog(const std::string& path) : path_(path) {
  const auto refuse = [&](int error) {
    if (descriptor_ >= 0) close(descriptor_);
    throw OutputError(cannot_be_written(path, error));
  };
  descriptor_ =
      open(behind_links(path).c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0666);
  if (descriptor_ < 0) refuse(errno);
  struct stat status {};
  if (fstat(descriptor_, &status) == 0 && S_ISFIFO(status.st_mode)) {
    close(descriptor_);
    throw OutputError(path + ": is a pipe, wanted a file (give --log another name)");
  }
  const off_t size = lseek(descriptor_, 0, SEEK_END);
  // Nothing is cut off from, or added to, a file that is something else.
  const std::string wanted = "{\"frame\"";
  std::string begin(wanted.size(), ' ');
  begin.resize(static_cast<std::size_t>(
      std::max<ssize_t>(0, pread(descriptor_, begin.data(), begin.size(), 0))));
  if (size > 0 && !wanted.starts_with(begin)) {
    close(descriptor_);
    throw OutputError(path + ": is no log: wanted a file of lines that begin with " + wanted +
                      ", or none (give --log another name)");
  }
}

BatchLog::~BatchLog() { close(descriptor_); }

// Cuts the log after its last line that is whole. Under the lock.
void BatchLog::drop_half_line() {
  const off_t size = lseek(descriptor_, 0, SEEK_END);
  off_t end = size;
  char last = '\n';
  while (end > 0 && pread(descriptor_, &last, 1, end - 1) == 1 && last != '\n') --end;
  if (end < size && ftruncate(descriptor_, end) != 0)
    throw OutputError(cannot_be_written(path_, errno));
}

void BatchLog::add(const FrameRecord& record) {
  const std::string line = to_json(record) + "\n";
  const std::scoped_lock threads(mine_);
  // Processes take turns, so that a line without an end is nobody's who still writes. File systems
  // without locks do as well as they can.
  flock(descriptor_, LOCK_EX);
  const std::unique_ptr<int, void (*)(int*)> processes(&descriptor_,
                                                       [](int* file) { flock(*file, LOCK_UN); });
  drop_half_line();
  const ssize_t count = write(descriptor_, line.data(), line.size());
  if (count == static_cast<ssize_t>(line.size())) return;
  const int error = count < 0 ? errno : ENOSPC;
  if (count > 0) drop_half_line();
  throw OutputError(cannot_be_written(path_, error));
}

std::vector<FrameRecord> read_log(const std::string& path, std::string* note) {
  std::vector<FrameRecord> records;
  std::error_code ignored;
  if (std::filesystem::file_size(path, ignored) == 0) return records;  // no frame is over
  const InputFile file = read_file(path);
  std::size_t number = 1;
  for (std::size_t begin = 0; begin < file.size(); ++number) {
    const std::size_t end = std::min(file.bytes.find('\n', begin), file.size());
    const std::string line = file.bytes.substr(begin, end - begin);
    begin = end + 1;
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    const std::string place = "line " + std::to_string(number);
    try {
      records.push_back(record_of(line));
    } catch (const BadLine& bad) {
      if (end < file.size()) fail(file, place, bad.what);
      *note = path + ": " + place + " is cut off and left out: the process was stopped in it";
    }
  }
  return records;
}

}  // namespace meniscus
