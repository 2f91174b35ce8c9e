#include "verify/devices.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <thread>
#include <tuple>
#include <utility>

#include "base/elapsed.hpp"
#include "base/grouped.hpp"
#include "meniscus/error.hpp"
#include "meniscus/extract.hpp"
#include "program/child_process.hpp"
#include "verify/child_plan.hpp"
#include "verify/program.hpp"

namespace meniscus::verify {
namespace {

using Json = nlohmann::json;

constexpr int kMostCrashes = 25;  // of one device; then it is given up
constexpr int kPatience = 2;      // failures of a kernel; then the others go on without it
constexpr double kLeastBuildSeconds = 60;
constexpr char kBuilding[] = "building";  // see LaunchGuard

struct Found {
  int index = 0;
  DeviceName name;
  std::string problem;  // why it cannot be used; empty: it can
};

enum class Heard { line, end, late, stop };

// The next line of ours, when it comes within `seconds` and before `stop` asks to stop.
Heard next(ChildProcess& child, Json& line, double seconds, const std::function<int()>& stop) {
  constexpr double kSlice = .1;  // seconds
  auto heard = std::chrono::steady_clock::now();
  for (std::string text;;) {
    if (stop() != 0) return Heard::stop;
    const double left = seconds - seconds_since(heard);
    if (left <= 0) return Heard::late;
    const ChildProcess::Read read = child.read_line(text, std::min(left, kSlice));
    if (read == ChildProcess::Read::late) continue;
    if (read == ChildProcess::Read::end) return Heard::end;
    heard = std::chrono::steady_clock::now();
    if (!text.starts_with(kMark)) continue;
    line = Json::parse(text.substr(kMark.size()));
    return Heard::line;
  }
}

// Whether a process that ended early did so because it was told what we are told, too: a terminal
// sends Ctrl-C to both. Ours may come a moment later.
bool told_to_stop(const std::string& how, const std::function<int()>& stop) {
  constexpr int kSlices = 100;
  constexpr std::chrono::milliseconds kSlice{10};
  bool by_signal = false;
  for (const int signal : {SIGHUP, SIGINT, SIGTERM})
    by_signal = by_signal || how.starts_with("signal " + std::to_string(signal) + " ") ||
                how == "exit code " + std::to_string(128 + signal);
  for (int k = 0; by_signal && stop() == 0 && k < kSlices; ++k) std::this_thread::sleep_for(kSlice);
  return stop() != 0;
}

// How a process ended that should not have, in words; empty where both were told to stop.
std::string how_it_ended(ChildProcess& child, Heard heard, double seconds,
                         const std::function<int()>& stop) {
  std::string how;
  if (heard == Heard::stop) return how;
  if (heard == Heard::late) {
    child.kill();
    child.wait();
    how = "the process gave no sign for " + std::to_string(static_cast<int>(seconds)) +
          " s and was ended";
  } else {
    how = child.wait();
    if (told_to_stop(how, stop)) return "";
    how = how.empty() ? "the process ended early" : "the process was ended by " + how;
  }
  // Of its end it says only what is known here (cli/signals.cpp).
  if (const std::string words = child.last_words();
      !words.empty() && !words.starts_with("meniscus: error: ended by "))
    how += "; its last words: " + words;
  return how;
}

std::string stopped_by(int signal) { return "stopped by " + name_of_signal(signal); }

// Not even the list of devices is asked for in this process. Told to stop, it finds none.
std::vector<Found> find_devices(const std::string& selector, double seconds,
                                const std::function<int()>& stop) {
  ChildProcess child({"verify", "--child-list", "--device", selector}, true);
  std::vector<Found> devices;
  Json line;
  for (;;) {
    const Heard heard = next(child, line, seconds, stop);
    if (heard == Heard::line && line.contains("end")) return devices;
    if (heard == Heard::line && line.contains("error"))
      throw DeviceError(line.at("error").get<std::string>());
    if (heard != Heard::line) {
      const std::string how = how_it_ended(child, heard, seconds, stop);
      if (how.empty()) return {};
      throw DeviceError("listing the OpenCL devices: " + how +
                        " (an OpenCL platform that is installed crashes: name another one in "
                        "OCL_ICD_VENDORS)");
    }
    devices.push_back(
        {line.at("index"),
         {line.at("name"), line.at("platform"), line.at("driver"), line.at("version")},
         line.at("problem")});
  }
}

// How many there are of each group, in the order in which they come: "2 of kernels, 12 of frames".
class GroupCounts {
 public:
  void add(const std::string& group) {
    if (counts_.empty() || counts_.back().first != group) counts_.emplace_back(group, 0);
    ++counts_.back().second;
  }
  std::string words() const {
    std::string text;
    for (const auto& [group, count] : counts_)
      text += (text.empty() ? "" : ", ") + grouped(count) + " of " + group + "s";
    return text;
  }

 private:
  std::vector<std::pair<std::string, std::size_t>> counts_;
};

// What a process was about when it ended.
struct UnderWay {
  Item item;  // no name: none yet
  std::size_t number = 0;
  std::string kernel, doing;  // empty: no launch
  std::size_t launch = 0;
  bool alone = true;  // no launch before it can have been under way, too
};

// Verifies one device, process after process.
class DeviceRun {
 public:
  DeviceRun(const Found& device, const DeviceResults& named, const Request& request, int output,
            const Watch& watch)
      : results(named), watch_(watch) {
    plan_.device = device.index;
    plan_.request = request;
    plan_.output = output;
    const auto begin = std::chrono::steady_clock::now();
    if (device.problem.empty())
      run();
    else
      add_of_device(Result::skip, device.problem);
    results.seconds = seconds_since(begin);
  }

  DeviceResults results;

 private:
  void run() {
    int crashes = 0;
    if (watch_.stop() != 0) return stop_before(0);
    while (!run_process())
      if (++crashes == kMostCrashes)
        return add_of_device(Result::fail,
                             "given up after " + std::to_string(crashes) + " crashes");
  }

  // Whether all is done.
  bool run_process() {
    ChildProcess child({"verify", "--child", to_text(plan_)}, true);
    UnderWay at;
    for (Json line;;) {
      const double seconds = at.doing == kBuilding
                                 ? std::max(plan_.request.seconds, kLeastBuildSeconds)
                                 : plan_.request.seconds;
      const Heard heard = next(child, line, seconds, watch_.stop);
      if (heard != Heard::line) {
        const std::string how = how_it_ended(child, heard, seconds, watch_.stop);
        if (how.empty()) {
          add_unnamed();
          stop_before(at.item.name.empty() ? plan_.from : at.number);
          return true;
        }
        if (!at.item.name.empty()) {
          take_end(at, how);
          return false;
        }
        add_of_device(Result::fail, how);
        return true;
      }
      if (line.contains("end")) {
        add_unnamed();
        return true;
      }
      if (line.contains("error")) {
        add_of_device(Result::fail, line.at("error"));
        return true;
      }
      if (line.contains("plan")) {
        groups_ = line.at("plan").get<std::vector<std::string>>();
      } else if (line.contains("row")) {
        take_row(at, row_from_json(line.at("row").get<std::string>(), "verify's child"));
      } else if (line.contains("kernel")) {
        at.kernel = line.at("kernel");
        at.doing = line.at("doing");
        at.launch = line.at("launch");
        at.alone = line.at("alone");
      } else {
        begin_item(at, line);
      }
    }
  }

  void begin_item(UnderWay& at, const Json& line) {
    at = {};
    at.number = line.at("item");
    at.item = {line.at("group"), line.at("name"),     line.at("variant"),
               line.at("size"),  line.at("required"), {}};
    if (at.number != plan_.from) {
      plan_.ended.clear();
      add_unnamed();
    }
    first_row_ = results.rows.size();
    watch_.step(
        {results.device.name, results.number, at.number + 1, line.at("items"), at.item.name});
  }

  // Of a kernel that ended an earlier process in this item there is a row already.
  void take_row(const UnderWay& at, Row row) {
    if (at.number == plan_.from && row.group == "kernel")
      for (const Ended& ended : plan_.ended)
        if (ended.kernel == row.kernel) return;
    add(std::move(row));
  }

  // After a process that ended too early: a row, and where the next one begins.
  void take_end(const UnderWay& at, const std::string& how) {
    const bool again = at.number == plan_.from;
    if (!again) plan_.ended.clear();
    if (!at.kernel.empty() && !at.alone && !plan_.waits) {
      // Kernels run behind the host's back: the next process waits for each and so can name it.
      unnamed_ = row_of(at.item, at.item.name, Result::fail,
                        how + "; not where each launch is waited for. The last was " + at.kernel);
      plan_.waits = true;
      return begin_at(at.number, first_row_);
    }
    unnamed_.reset();
    if (at.kernel.empty()) {
      add(row_of(at.item, at.item.name, Result::fail, how));
      plan_.ended.clear();
      return begin_at(at.number + 1, results.rows.size());
    }
    const std::string what =
        std::string("while it ") + (at.doing == kBuilding ? "was built" : "ran") + ", " + how;
    count_failure(at);
    const bool known = std::any_of(plan_.ended.begin(), plan_.ended.end(),
                                   [&](const Ended& ended) { return ended.kernel == at.kernel; });
    // The others in the case can be judged where canonical values take the place of this one's.
    const bool once_more = at.item.group == "kernel" && !known;
    if (once_more) results.rows.resize(first_row_);  // they are told again
    add(row_of(at.item, at.kernel, Result::fail, what));
    if (once_more) {
      plan_.ended.push_back({at.kernel, at.launch, what});
      return begin_at(at.number, results.rows.size());
    }
    plan_.ended.clear();
    begin_at(at.number + 1, results.rows.size());
  }

  // What is required is tried once, whatever happened where it is not.
  void count_failure(const UnderWay& at) {
    Failures& failures = failures_[at.kernel];
    ++failures.all;
    failures.any_required = failures.any_required || at.item.required;
    if (failures.all < kPatience) return;
    plan_.without_where_not_required.insert(at.kernel);
    if (failures.any_required) plan_.without.insert(at.kernel);
  }

  void begin_at(std::size_t item, std::size_t rows) {
    plan_.from = item;
    results.rows.resize(rows);
  }

  // Told to stop: which items from this one on were not run to their end.
  void stop_before(std::size_t item) {
    std::string& what = results.unfinished;
    what = stopped_by(watch_.stop());
    if (groups_.empty()) {
      what += " before anything was compared";
      return;
    }
    GroupCounts left;
    for (std::size_t k = item; k < groups_.size(); ++k) left.add(groups_[k]);
    what += " after " + std::to_string(item) + " of " + counted(groups_.size(), "part") +
            "; not run: " + left.words();
  }

  // What ended a process could not be found again.
  void add_unnamed() {
    if (unnamed_) add(*std::exchange(unnamed_, std::nullopt));
  }

  void add(Row row) {
    row.device = results.device.name;
    if (row.result == Result::fail && told_.insert({row.group, row.kernel, row.variant}).second)
      watch_.failed(row);
    results.rows.push_back(std::move(row));
  }

  void add_of_device(Result result, const std::string& reason) {
    add({.group = "device", .kernel = "open", .result = result, .reason = reason});
  }

  const Watch& watch_;
  ChildPlan plan_;                   // of the next process
  std::size_t first_row_ = 0;        // of the item under way
  std::vector<std::string> groups_;  // of all items, once a process has told them
  struct Failures {
    int all = 0;
    bool any_required = false;
  };
  std::map<std::string, Failures> failures_;  // of kernels
  std::optional<Row> unnamed_;
  std::set<std::tuple<std::string, std::string, std::string>> told_;
};

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

// A file without a name, which children inherit.
File nameless_file() {
  File file(std::tmpfile(), &std::fclose);
  if (!file)
    throw Error(std::string("no temporary file for what devices compute: ") + std::strerror(errno) +
                " (name another folder in TMPDIR)");
  return file;
}

Bytes all_of(std::FILE* file) {
  Bytes bytes;
  std::rewind(file);
  std::uint8_t part[1 << 16];
  while (const std::size_t count = std::fread(part, 1, sizeof part, file))
    bytes.insert(bytes.end(), part, part + count);
  return bytes;
}

// Adds whether the devices agree on what a program computes.
void add_agreement(VerifyRun& run, const Program& program,
                   const std::vector<std::vector<Bytes>>& left, const Watch& watch) {
  std::vector<std::string> names;
  for (const DeviceResults& device : run.devices) names.push_back(title_of(device));
  compare_devices(program, names, left, [&](std::size_t d, Row row) {
    row.device = run.devices[d].device.name;
    if (row.result == Result::fail) watch.failed(row);
    run.devices[d].rows.push_back(std::move(row));
  });
  for (DeviceResults& device : run.devices) {
    if (!device.rows.empty()) continue;
    device.rows.push_back({.group = "program",
                           .device = device.device.name,
                           .kernel = program.kernel,
                           .result = Result::skip,
                           .reason = "it ran, and there is nothing to compare with: give "
                                     "\"repeat\", \"expected\" or another device"});
  }
}

}  // namespace

VerifyRun verify_devices(const Request& request, const Watch& watch) {
  VerifyRun run;
  run.version = version();
  std::optional<Program> program;
  if (!request.program.empty()) program = read_program(request.program, request.manifest);
  std::vector<std::vector<Bytes>> left;  // by the program, on each device
  const std::vector<Found> found = find_devices(request.selector, request.seconds, watch.stop);
  for (const Found& device : found) run.devices.emplace_back().device = device.name;
  run.number_namesakes();
  for (std::size_t k = 0; k < found.size(); ++k) {
    const File output = nameless_file();
    DeviceResults& device = run.devices[k];
    device =
        DeviceRun(found[k], device, request, program ? fileno(output.get()) : -1, watch).results;
    if (program) left.push_back(parted(*program, all_of(output.get())));
  }
  if (!program) return run;
  if (watch.stop() == 0)
    add_agreement(run, *program, left, watch);
  else
    for (DeviceResults& device : run.devices)
      if (device.unfinished.empty())
        device.unfinished = stopped_by(watch.stop()) + " before the devices were compared";
  return run;
}

}  // namespace meniscus::verify
