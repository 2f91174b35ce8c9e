#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "device/program_cache.hpp"
#include "device/tuning.hpp"
#include "frame/tune.hpp"
#include "meniscus/device.hpp"
#include "meniscus/error.hpp"
#include "meniscus/extract.hpp"
#include "program/cli/commands.hpp"
#include "program/cli/report.hpp"
#include "program/cli/terminal.hpp"
#include "program/wording.hpp"

namespace meniscus::cli {
namespace {

// One object, for programs. The same where no device can be used, but for the exit code.
void print_json(const std::vector<DeviceInfo>& devices, const std::vector<std::string>& problems,
                int chosen, const std::string& why) {
  nlohmann::ordered_json list = nlohmann::json::array();
  for (const DeviceInfo& device : devices)
    list.push_back({{"index", device.index},
                    {"name", device.name},
                    {"kind", to_string(device.kind)},
                    {"platform", device.platform},
                    {"driver", device.driver},
                    {"version", device.version},
                    {"compute_units", device.compute_units},
                    {"memory_bytes", device.global_memory},
                    {"largest_buffer_bytes", device.largest_buffer},
                    {"usable", device.usable},
                    {"problem", device.problem},
                    {"launched_with", to_string(tuning_of(device))}});
  nlohmann::ordered_json all{{"meniscus", version()}, {"devices", list}, {"problems", problems}};
  all["default"] = chosen < 0 ? nlohmann::ordered_json() : nlohmann::ordered_json(chosen);
  all["why"] = why;
  all["kernels_kept_in"] = program_cache_folder();
  using Json = nlohmann::ordered_json;
  std::printf("%s\n", all.dump(1, ' ', false, Json::error_handler_t::replace).c_str());
}

void show_devices(bool json) {
  std::vector<std::string> problems;
  const std::vector<DeviceInfo> devices = list_devices(&problems);
  std::string why, problem;
  int chosen = -1;
  try {
    chosen = select_device("", &why).index;
  } catch (const DeviceError& error) {
    problem = words_of(error);
  }
  if (json) {
    print_json(devices, problems, chosen, chosen < 0 ? problem : why);
    if (chosen < 0) throw DeviceError(problem);
    return;
  }
  for (const DeviceInfo& device : devices) {
    print_line(stdout, printed("%c %d  %s", device.index == chosen ? '*' : ' ', device.index,
                               device.name.c_str()));
    print_line(stdout, printed("     %s, %s, %s memory, largest buffer %s", to_string(device.kind),
                               counted(device.compute_units, "compute unit").c_str(),
                               size_of(device.global_memory).c_str(),
                               size_of(device.largest_buffer).c_str()));
    print_line(stdout, printed("     %s, driver %s, %s", device.platform.c_str(),
                               device.driver.c_str(), device.version.c_str()));
    if (!device.usable) print_line(stdout, "     not usable: " + device.problem);
    if (const Tuning tuning = tuning_of(device);
        device.usable && !(tuning == default_tuning(device)))
      print_line(stdout, "     launched with " + to_string(tuning) + ", as meniscus tune found");
  }
  for (const std::string& other : problems) print_line(stdout, "! " + other);
  if (chosen < 0) throw DeviceError(problem);
  print_lines(
      stdout,
      printed("\nThe default is %d: %s. Choose another by --device with its number, a part of its "
              "name, cpu or gpu.\n",
              chosen, why.c_str()));
  const std::string folder = program_cache_folder();
  if (folder.empty())
    print_line(stdout, "Built kernels are not kept: set MENISCUS_CACHE_DIR, or HOME.");
  else if (!keeps_programs(folder))
    print_line(stdout, "Built kernels are not kept: " + folder +
                           " must be a folder that this user alone may write into.");
  else
    print_line(stdout, "Built kernels are kept in " + folder + "; remove it to build them anew.");
}

}  // namespace

void add_devices_command(CLI::App& program) {
  CLI::App& command = *program.add_subcommand(
      "devices", "List the OpenCL devices and say which one is the default");
  const auto json = std::make_shared<bool>(false);
  command.add_flag("--json", *json, "as JSON, for programs");
  command.callback([json] { show_devices(*json); });
}

}  // namespace meniscus::cli
