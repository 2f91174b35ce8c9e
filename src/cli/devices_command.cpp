#include <cstdio>
#include <string>

#include "cli/commands.hpp"
#include "cli/report.hpp"
#include "cli/terminal.hpp"
#include "device/program_cache.hpp"
#include "device/tuning.hpp"
#include "frame/tune.hpp"
#include "meniscus/device.hpp"
#include "meniscus/error.hpp"

namespace meniscus::cli {
namespace {

void show_devices() {
  std::vector<std::string> problems;
  const std::vector<DeviceInfo> devices = list_devices(&problems);
  std::string why, problem;
  int chosen = -1;
  try {
    chosen = select_device("", &why).index;
  } catch (const DeviceError& error) {
    problem = error.what();
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
  if (const std::string folder = program_cache_folder(); !folder.empty())
    print_line(stdout, "Built kernels are kept in " + folder + "; remove it to build them anew.");
}

}  // namespace

void add_devices_command(CLI::App& program) {
  program.add_subcommand("devices", "List the OpenCL devices and say which one is the default")
      ->callback(show_devices);
}

}  // namespace meniscus::cli
