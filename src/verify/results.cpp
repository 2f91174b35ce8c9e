#include "verify/results.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

#include "base/printable.hpp"
#include "base/printed.hpp"
#include "io/input_file.hpp"
#include "io/json_number.hpp"
#include "io/json_text.hpp"
#include "meniscus/error.hpp"
#include "program/page/page.hpp"

namespace meniscus::verify {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kGroups[] = {"device", "program",   "probe", "limit",
                                   "kernel", "reference", "frame", "flaw"};

// What is said of devices goes with each of their rows.
constexpr std::size_t kMostDevices = 64, kLongestName = 200;  // characters
constexpr std::size_t kLongestUnfinished = 400;               // characters

// JSON has no infinity.
Json number(double value) { return std::isfinite(value) ? Json(value) : Json("infinite"); }

Json object_of(const Row& row) {
  return {{"device", row.device},
          {"kernel", row.kernel},
          {"variant", row.variant},
          {"size", row.size},
          {"result", to_string(row.result)},
          {"ulp", row.ulp < 0 ? Json(nullptr) : number(row.ulp)},
          {"reason", row.reason},
          {"ms", row.ms},
          {"group", row.group},
          {"required", row.required},
          {"section", row.section}};
}

Row row_of(const Json& object) {
  Row row;
  row.group = object.at("group");
  row.device = object.at("device");
  row.kernel = object.at("kernel");
  row.variant = object.at("variant");
  row.size = object.at("size");
  const std::string result = object.at("result");
  require(result == "pass" || result == "fail" || result == "skip",
          "\"result\" is " + in_quotes(result) + ", must be pass, fail or skip");
  row.result = result == "pass" ? Result::pass : result == "fail" ? Result::fail : Result::skip;
  const Json& ulp = object.at("ulp");
  row.ulp = ulp.is_null() ? -1 : ulp.is_string() ? INFINITY : ulp.get<double>();
  row.reason = object.at("reason");
  row.ms = object.at("ms");
  row.required = object.at("required");
  row.section = object.at("section");
  return row;
}

template <class Work>
auto parsed(const std::string& name, const Work& work) {
  try {
    return work();
  } catch (const Json::exception& error) {
    throw InputError(name + ": is not what meniscus verify --json writes: " + reason_of(error));
  } catch (const Error& error) {
    throw InputError(name + ": is not what meniscus verify --json writes: " + error.what());
  }
}

std::string padded(std::string text, std::size_t width) {
  if (text.size() < width) text.append(width - text.size(), ' ');
  return text;
}

// Whether a row is of a whole case, as where nothing can be built: its kernel is the case's name.
bool is_of_a_case(const Row& row) { return row.size.starts_with(row.kernel + ", "); }

// "project_particles, width 8, fit on block".
std::string words_of(const Row& row) {
  std::string text = row.kernel;
  const std::string size = is_of_a_case(row) ? row.size.substr(row.kernel.size() + 2) : row.size;
  for (const std::string* part : {&row.variant, &size})
    if (!part->empty()) text += ", " + *part;
  return text;
}

// "kernel project_particles, width 8, fit on block".
std::string subject_of(const Row& row) {
  return (is_of_a_case(row) ? "case" : row.group) + " " + words_of(row);
}

std::string and_others(std::size_t cases) {
  return cases < 2 ? "" : " and on " + counted(cases - 1, "other");
}

// "FAILED kernel project_particles, width 8, fit on block".
std::string what_failed(const Row& row) {
  return (row.required ? "FAILED " : "(not required) ") + subject_of(row);
}

// "3 ulp; launch 4 of 12 ... [OpenCL C 1.2, 7.4]".
std::string why_failed(const Row& row) {
  return (row.ulp > 0 ? error_of(row) + "; " : "") + row.reason +
         (row.section.empty() ? "" : " [" + row.section + "]");
}

// Why rows were skipped, a line for each reason.
std::string skips_of(const DeviceResults& device) {
  constexpr std::size_t kMostReasons = 10;
  std::map<std::string, std::size_t> skips;
  std::string text;
  std::size_t others = 0;  // rows
  for (const Row& row : device.rows)
    if (row.result == Result::skip) ++skips[row.reason];
  for (std::size_t shown = 0; const auto& [reason, count] : skips)
    if (shown++ < kMostReasons)
      text += "  skipped " + grouped(count) + ": " + reason + "\n";
    else
      others += count;
  if (others > 0)
    text += "  skipped " + grouped(others) + " for other reasons, which --json FILE writes\n";
  return text;
}

}  // namespace

const char* to_string(Result result) {
  return result == Result::pass ? "pass" : result == Result::fail ? "fail" : "skip";
}

void Tally::add(Result result) {
  (result == Result::pass ? passed : result == Result::fail ? failed : skipped) += 1;
}

std::string Tally::words() const {
  std::string text = grouped(passed) + " passed";
  if (failed > 0) text += ", " + grouped(failed) + " FAILED";
  if (skipped > 0) text += ", " + grouped(skipped) + " skipped";
  return text;
}

std::vector<std::pair<std::string, Tally>> DeviceResults::tallies() const {
  std::vector<std::pair<std::string, Tally>> tallies;
  for (const char* group : kGroups) {
    Tally tally;
    for (const Row& row : rows)
      if (row.group == group) tally.add(row.result);
    if (tally.all() > 0) tallies.emplace_back(group, tally);
  }
  return tallies;
}

std::vector<Failure> DeviceResults::failures() const {
  std::vector<Failure> failures;
  std::map<std::tuple<std::string, std::string, std::string>, std::size_t> places;
  std::map<std::tuple<std::string, bool, std::string>, std::size_t> reasons;
  for (const Row& row : rows) {
    if (row.result != Result::fail) continue;
    const auto same = reasons.try_emplace({row.group, row.required, row.reason}, failures.size());
    const auto [place, first] =
        places.try_emplace({row.group, row.kernel, row.variant}, same.first->second);
    same.first->second = place->second;
    if (place->second == failures.size()) failures.push_back({&row, 0});
    ++failures[place->second].cases;
  }
  return failures;
}

bool DeviceResults::unusable() const {
  return unfinished.empty() && std::all_of(rows.begin(), rows.end(), [](const Row& row) {
           return row.group == "device" && row.result == Result::skip;
         });
}

bool DeviceResults::good() const {
  if (!unfinished.empty()) return false;
  bool any = false;
  for (const Row& row : rows) {
    if (row.required && row.result != Result::pass) return false;
    any = any || row.result == Result::pass;
  }
  return any;
}

const char* DeviceResults::verdict() const {
  std::size_t passed = 0, failed = 0, untested = unfinished.empty() ? 0 : 1;  // of the required
  for (const Row& row : rows) {
    if (!row.required) continue;
    (row.result == Result::pass ? passed : row.result == Result::fail ? failed : untested) += 1;
  }
  return good()                       ? "PASSED"
         : failed > 0                 ? "FAILED"
         : passed > 0 && untested > 0 ? "INCOMPLETE"
                                      : "not verified";
}

bool VerifyRun::good() const {
  bool any = false;
  for (const DeviceResults& device : devices) {
    if (device.unusable()) continue;
    if (!device.good()) return false;
    any = true;
  }
  return any;
}

bool VerifyRun::finished() const {
  return !devices.empty() &&
         std::all_of(devices.begin(), devices.end(),
                     [](const DeviceResults& device) { return device.unfinished.empty(); });
}

void VerifyRun::number_namesakes() {
  const auto same = [](const DeviceResults& a, const DeviceResults& b) {
    return a.file == b.file && title_of(a.device) == title_of(b.device);
  };
  for (std::size_t k = 0; k < devices.size(); ++k)
    if (std::count_if(devices.begin(), devices.end(),
                      [&](const DeviceResults& other) { return same(devices[k], other); }) > 1)
      devices[k].number = static_cast<int>(k);
}

std::string to_json(const Row& row) {
  return object_of(row).dump(-1, ' ', false, Json::error_handler_t::replace);
}

Row row_from_json(const std::string& text, const std::string& name) {
  return parsed(name, [&] { return row_of(parse_json<Json>(text)); });
}

std::string to_json(const VerifyRun& run) {
  std::string text = "{\"meniscus\": " + Json(run.version).dump() + ",\n \"devices\": [";
  const char* separator = "\n  ";
  for (const DeviceResults& d : run.devices) {
    Json device{{"name", d.device.name},     {"platform", d.device.platform},
                {"driver", d.device.driver}, {"version", d.device.version},
                {"seconds", d.seconds},      {"good", d.good()}};
    if (!d.unfinished.empty()) device["unfinished"] = d.unfinished;
    text += separator + device.dump(-1, ' ', false, Json::error_handler_t::replace);
    separator = ",\n  ";
  }
  text += "],\n \"rows\": [";
  separator = "\n  ";
  for (std::size_t k = 0; k < run.devices.size(); ++k)
    for (const Row& row : run.devices[k].rows) {
      Json object = object_of(row);
      object["index"] = k;
      text += separator + object.dump(-1, ' ', false, Json::error_handler_t::replace);
      separator = ",\n  ";
    }
  return text + "]}\n";
}

VerifyRun run_from_json(const std::string& text, const std::string& name) {
  return parsed(name, [&] {
    const Json json = parse_json<Json>(text);
    VerifyRun run;
    run.version = json.at("meniscus");
    require(json.at("devices").size() <= kMostDevices,
            "it has " + counted(json.at("devices").size(), "device") + ", at most " +
                std::to_string(kMostDevices) + " are read");
    for (const Json& device : json.at("devices")) {
      const auto text_of = [&](const char* key) {
        return printable(device.at(key).get<std::string>(), kLongestName);
      };
      DeviceResults results;
      results.device = {text_of("name"), text_of("platform"), text_of("driver"),
                        text_of("version")};
      results.seconds = device.at("seconds");
      if (device.contains("unfinished"))
        results.unfinished =
            printable(device.at("unfinished").get<std::string>(), kLongestUnfinished);
      run.devices.push_back(results);
    }
    for (const Json& row : json.at("rows")) {
      const auto index = whole_number<std::size_t>(row.at("index"));
      require(index && *index < run.devices.size(),
              "\"index\" is " + in_quotes_of(row.at("index")) + ", must be that of a device");
      run.devices[*index].rows.push_back(row_of(row));
    }
    run.number_namesakes();
    return run;
  });
}

std::string to_junit(const VerifyRun& run) {
  std::string text =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"meniscus verify\">\n";
  for (const DeviceResults& device : run.devices) {
    if (!device.unfinished.empty())
      text += "<testsuite name=\"" + escaped(title_of(device)) +
              ".run\" tests=\"1\" errors=\"1\">\n<testcase classname=\"run\" "
              "name=\"comes to its end\"><error message=\"" +
              escaped(device.unfinished) + "\"/></testcase>\n</testsuite>\n";
    for (const auto& [group, tally] : device.tallies()) {
      text += "<testsuite name=\"" + escaped(title_of(device)) + "." + group + "\" tests=\"";
      text += std::to_string(tally.all()) + "\" failures=\"" + std::to_string(tally.failed);
      text += "\" skipped=\"" + std::to_string(tally.skipped) + "\">\n";
      for (const Row& row : device.rows) {
        if (row.group != group) continue;
        text += "<testcase classname=\"" + escaped(row.kernel) + "\" name=\"" +
                escaped(words_of(row)) + "\" time=\"" + printed("%.6f", 1e-3 * row.ms) + "\"";
        if (row.result == Result::pass)
          text += "/>\n";
        else if (row.result == Result::fail)
          text += "><failure message=\"" + escaped(row.reason) + "\"/></testcase>\n";
        else
          text += "><skipped message=\"" + escaped(row.reason) + "\"/></testcase>\n";
      }
      text += "</testsuite>\n";
    }
  }
  return text + "</testsuites>\n";
}

std::string title_of(const DeviceName& device) {
  std::string title = device.name;
  if (!device.platform.empty()) title += " (" + device.platform;
  if (!device.driver.empty()) title += ", driver " + device.driver;
  return device.platform.empty() ? title : title + ")";
}

std::string title_of(const DeviceResults& results) {
  return (results.file.empty() ? "" : results.file + ": ") + title_of(results.device) +
         number_words(results);
}

std::string number_words(const DeviceResults& results) {
  return results.number < 0 ? "" : ", device " + std::to_string(results.number);
}

std::string error_of(const Row& row) {
  if (row.ulp < 0) return "";
  if (row.ulp == 0 && row.result == Result::pass) return "same bits";
  return std::isfinite(row.ulp) ? three_digits(row.ulp) + " ulp" : "infinitely far";
}

std::string failure_of(const Row& row) { return what_failed(row) + ": " + why_failed(row); }

std::string table_of(const VerifyRun& run) {
  std::string text;
  for (const DeviceResults& device : run.devices) {
    text += title_of(device) + ", " + device.device.version + "\n";
    for (const auto& [group, tally] : device.tallies())
      text += "  " + padded(group + "s", 12) + tally.words() + "\n";
    // Limits are figures that people want to see.
    for (const Row& row : device.rows)
      if (row.group == "limit" && row.result == Result::pass && !row.reason.empty())
        text += "    " + padded(row.kernel + (row.variant.empty() ? "" : ", " + row.variant), 26) +
                row.reason + "\n";
    for (const auto& [row, cases] : device.failures()) {
      text += "  " + what_failed(*row) + and_others(cases);
      text += "\n    " + why_failed(*row) + "\n";
    }
    text += skips_of(device);
    if (!device.unfinished.empty()) text += "  UNFINISHED: " + device.unfinished + "\n";
    text += std::string("  ") + device.verdict() + ", " + duration(device.seconds) + "\n\n";
  }
  return text;
}

std::vector<std::string> advice_of(const VerifyRun& run) {
  bool required = false, not_required = false, of_others = false;
  std::string kernel;  // the first of ours that failed and must not
  for (const DeviceResults& device : run.devices)
    for (const Row& row : device.rows) {
      of_others = of_others || row.group == "program";
      if (row.result != Result::fail) continue;
      (row.required ? required : not_required) = true;
      if (row.required && row.group == "kernel" && !is_of_a_case(row) && kernel.empty())
        kernel = row.kernel;
    }
  std::vector<std::string> advice;
  if (of_others) return advice;
  if (required)
    advice.push_back(
        "A device that failed does not give the results that others give: do not use it for "
        "frames. docs/portability.md lists known flaws of runtimes; another version of the driver "
        "may do.");
  if (!kernel.empty())
    advice.push_back("meniscus verify --kernel " + kernel +
                     " --repro DIR makes a folder that shows the failure without Meniscus, for "
                     "the makers of the driver.");
  if (not_required)
    advice.push_back(
        "Not required is what frames do not use on this device: another vector width, or "
        "arithmetic that no kernel relies on.");
  return advice;
}

std::string compared_variant(const Row& row) {
  if (row.group != "frame") return row.variant;
  const std::size_t comma = row.variant.find(", ");  // behind the width
  return comma == std::string::npos ? "" : row.variant.substr(comma + 2);
}

std::size_t Comparison::required() const {
  return static_cast<std::size_t>(
      std::count_if(changes.begin(), changes.end(), [](const Change& change) {
        return change.before && change.after && (change.before->required || change.after->required);
      }));
}

Comparison compared(const DeviceResults& before, const DeviceResults& after) {
  const auto key = [](const Row& row) {
    return std::tuple(row.group, row.kernel, compared_variant(row), row.size);
  };
  std::map<decltype(key(Row{})), const Row*> earlier;
  for (const Row& row : before.rows) earlier[key(row)] = &row;
  Comparison comparison;
  for (const Row& row : after.rows) {
    const auto found = earlier.find(key(row));
    const Row* old = found == earlier.end() ? nullptr : found->second;
    if (old) earlier.erase(found);
    // What limits measure is never the same twice: their results count.
    const bool same =
        old && old->result == row.result && old->ulp == row.ulp &&
        (row.group == "limit" || row.result == Result::pass || old->reason == row.reason) &&
        (row.group != "frame" || old->reason == row.reason);
    if (same) {
      ++comparison.same;
      continue;
    }
    comparison.changes.push_back({old, &row});
    comparison.only_after += old == nullptr;
  }
  for (const Row& row : before.rows)
    if (const auto left = earlier.find(key(row)); left != earlier.end() && left->second == &row) {
      comparison.changes.push_back({&row, nullptr});
      ++comparison.only_before;
    }
  return comparison;
}

std::string comparison_of(const DeviceResults& before, const DeviceResults& after) {
  std::string text;
  for (const auto& [letter, device] : {std::pair("A  ", &before), std::pair("B  ", &after)}) {
    text += letter + title_of(*device) + "\n";
    if (!device->unfinished.empty()) text += "   UNFINISHED: " + device->unfinished + "\n";
  }
  const Comparison comparison = compared(before, after);
  text += grouped(comparison.same) + " rows are the same, " + grouped(comparison.differing()) +
          " differ";
  if (comparison.differing() > 0)
    text += " (" + grouped(comparison.required()) + " of them required)";
  if (comparison.only_before > 0) text += ", " + grouped(comparison.only_before) + " only in A";
  if (comparison.only_after > 0) text += ", " + grouped(comparison.only_after) + " only in B";
  text += "\n";
  const auto outcome = [](const Row* row) {
    if (!row) return std::string("not there");
    std::string words = to_string(row->result);
    if (const std::string error = error_of(*row); !error.empty()) words += ", " + error;
    return row->reason.empty() ? words : words + ": " + row->reason;
  };
  const auto is = [](const Row* row, Result result) { return row && row->result == result; };
  struct Shown {
    const Change* first;
    std::size_t cases;
  };
  std::vector<Shown> all;
  std::map<std::tuple<std::string, std::string, std::string, int, int>, std::size_t> places;
  std::size_t skipped[2] = {0, 0};
  const Row* first_skipped[2] = {nullptr, nullptr};
  for (const Change& change : comparison.changes) {
    const auto& [before, after] = change;
    const bool failed = is(before, Result::fail) || is(after, Result::fail);
    // One run had other cases than the other: no difference but where it failed.
    if ((!before || !after) && !failed) continue;
    const bool in_a = is(before, Result::skip), in_b = is(after, Result::skip);
    if (!failed && in_a != in_b) {
      if (skipped[in_b]++ == 0) first_skipped[in_b] = in_a ? before : after;
      continue;
    }
    const Row& row = after ? *after : *before;
    const auto result = [](const Row* one) { return one ? static_cast<int>(one->result) : -1; };
    const auto place = places.try_emplace(
        {row.group, row.kernel, row.variant, result(before), result(after)}, all.size());
    if (place.second) all.push_back({&change, 0});
    ++all[place.first->second].cases;
  }
  std::stable_partition(all.begin(), all.end(), [&](const Shown& one) {
    return is(one.first->before, Result::fail) || is(one.first->after, Result::fail);
  });
  for (const auto& [change, cases] : all)
    text += subject_of(change->after ? *change->after : *change->before) + and_others(cases) +
            "\n  A  " + outcome(change->before) + "\n  B  " + outcome(change->after) + "\n";
  for (const int b : {0, 1})
    if (skipped[b] > 0)
      text += std::string("skipped in ") + "AB"[b] + " alone: " + counted(skipped[b], "row") +
              ", the first " + subject_of(*first_skipped[b]) + ": " + first_skipped[b]->reason +
              "\n";
  return text;
}

}  // namespace meniscus::verify
