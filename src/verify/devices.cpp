#include "verify/devices.hpp"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "child_process.hpp"
#include "meniscus/device.hpp"
#include "meniscus/error.hpp"
#include "meniscus/meniscus.hpp"

namespace meniscus::verify {
namespace {

using Json = nlohmann::json;

constexpr int kMostCrashes = 25;  // of one device; then it is given up

// What runtimes print comes in between: a line of ours begins with this.
constexpr std::string_view kMark = "\x1bverify ";

void say(const Json& line) {
  const std::string text = line.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::printf("\n%s%s\n", kMark.data(), text.c_str());
  std::fflush(stdout);
}

struct Found {
  int index = 0;
  DeviceName name;
  std::string problem;  // why it cannot be used; empty: it can
};

// The next line of ours.
ChildProcess::Read next(ChildProcess& child, Json& line, double seconds) {
  for (std::string text;;) {
    const ChildProcess::Read read = child.read_line(text, seconds);
    if (read != ChildProcess::Read::line) return read;
    if (!text.starts_with(kMark)) continue;
    line = Json::parse(text.substr(kMark.size()));
    return read;
  }
}

// How a process ended that should not have, in words.
std::string how_it_ended(ChildProcess& child, ChildProcess::Read read, double seconds) {
  std::string how;
  if (read == ChildProcess::Read::late) {
    child.kill();
    child.wait();
    how = "gave no sign for " + std::to_string(static_cast<int>(seconds)) + " s and was ended";
  } else {
    how = child.wait();
    how = how.empty() ? "the process ended early" : "the process was ended by " + how;
  }
  if (const std::string words = child.last_words(); !words.empty())
    how += "; its last words: " + words;
  return how;
}

// Not even the list of devices is asked for in this process.
std::vector<Found> find_devices(const std::string& selector, double seconds) {
  ChildProcess child({"verify", "--child-list", "--device", selector}, true);
  std::vector<Found> devices;
  Json line;
  for (;;) {
    const ChildProcess::Read read = next(child, line, seconds);
    if (read == ChildProcess::Read::line && line.contains("end")) return devices;
    if (read == ChildProcess::Read::line && line.contains("error"))
      throw DeviceError(line.at("error").get<std::string>());
    if (read != ChildProcess::Read::line)
      throw DeviceError("listing the OpenCL devices: " + how_it_ended(child, read, seconds) +
                        " (an OpenCL platform that is installed crashes: name another one in "
                        "OCL_ICD_VENDORS)");
    devices.push_back(
        {line.at("index"),
         {line.at("name"), line.at("platform"), line.at("driver"), line.at("version")},
         line.at("problem")});
  }
}

std::vector<std::string> child_arguments(const Found& device, std::size_t from,
                                         const Settings& settings) {
  std::vector<std::string> arguments{"verify",
                                     "--child",
                                     std::to_string(device.index),
                                     "--child-from",
                                     std::to_string(from),
                                     "--size",
                                     settings.full ? "full" : "small"};
  for (const std::string& kernel : settings.kernels) {
    arguments.push_back("--kernel");
    arguments.push_back(kernel);
  }
  return arguments;
}

DeviceResults verify_device(const Found& device, const Settings& settings, double seconds,
                            const Watch& watch) {
  DeviceResults results;
  results.device = device.name;
  const auto begin = std::chrono::steady_clock::now();
  const auto add = [&](Row row) {
    row.device = device.name.name;
    results.rows.push_back(std::move(row));
  };
  const auto whole_device = [&](Result result, const std::string& reason) {
    Row row;
    row.group = "device";
    row.kernel = "open";
    row.result = result;
    row.reason = reason;
    add(std::move(row));
  };
  if (!device.problem.empty()) {
    whole_device(Result::skip, device.problem);
    return results;
  }
  std::size_t from = 0;
  bool over = false;
  for (int crashes = 0; !over; ++crashes) {
    if (crashes == kMostCrashes) {
      whole_device(Result::fail, "given up after " + std::to_string(crashes) + " crashes");
      break;
    }
    ChildProcess child(child_arguments(device, from, settings), true);
    std::string name, group;  // of the item under way
    for (Json line;;) {
      const ChildProcess::Read read = next(child, line, seconds);
      if (read != ChildProcess::Read::line) {
        const std::string how = how_it_ended(child, read, seconds);
        if (name.empty()) {
          whole_device(Result::fail, how);
          over = true;
          break;
        }
        Row row;
        row.group = group;
        row.kernel = name;
        row.result = Result::fail;
        row.reason = how;
        add(std::move(row));
        break;  // and go on behind it
      }
      if (line.contains("end")) {
        over = true;
        break;
      }
      if (line.contains("error")) {
        whole_device(Result::fail, line.at("error"));
        over = true;
        break;
      }
      if (line.contains("row")) {
        add(row_from_json(line.at("row").get<std::string>(), "verify's child"));
        continue;
      }
      name = line.at("name");
      group = line.at("group");
      from = line.at("item").get<std::size_t>() + 1;
      watch({device.name.name, from, line.at("items"), name});
    }
  }
  results.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return results;
}

}  // namespace

VerifyRun verify_devices(const std::string& selector, const Settings& settings, double seconds,
                         const Watch& watch) {
  VerifyRun run;
  run.version = version();
  for (const Found& device : find_devices(selector, seconds))
    run.devices.push_back(verify_device(device, settings, seconds, watch));
  return run;
}

void list_as_child(const std::string& selector) {
  try {
    for (const DeviceInfo& device :
         selector == "all" ? list_devices() : std::vector{select_device(selector)})
      say({{"index", device.index},
           {"name", device.name},
           {"platform", device.platform},
           {"driver", device.driver},
           {"version", device.version},
           {"problem", device.problem}});
    say({{"end", true}});
  } catch (const Error& error) {
    say({{"error", error.what()}});
  }
}

void run_as_child(int index, std::size_t from, const Settings& settings) {
  try {
    Device device(std::to_string(index));
    const std::vector<Item> items = items_of(settings, device.state().vector_width);
    for (std::size_t k = from; k < items.size(); ++k) {
      say({{"item", k},
           {"items", items.size()},
           {"name", items[k].name},
           {"group", items[k].group}});
      run_item(items[k], device, [](const Row& row) { say({{"row", to_json(row)}}); });
    }
    say({{"end", true}});
    // Some drivers crash when they are let go of; all has been said.
    std::_Exit(0);
  } catch (const Error& error) {
    say({{"error", error.what()}});
  }
}

}  // namespace meniscus::verify
