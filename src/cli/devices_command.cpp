#include <cstdio>
#include <string>

#include "cli/commands.hpp"
#include "cli/report.hpp"
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
    std::printf("%c %d  %s\n", device.index == chosen ? '*' : ' ', device.index,
                device.name.c_str());
    std::printf("     %s, %s, %s memory, largest buffer %s\n", to_string(device.kind),
                counted(device.compute_units, "compute unit").c_str(),
                size_of(device.global_memory).c_str(), size_of(device.largest_buffer).c_str());
    std::printf("     %s, driver %s, %s\n", device.platform.c_str(), device.driver.c_str(),
                device.version.c_str());
    if (!device.usable) std::printf("     not usable: %s\n", device.problem.c_str());
    if (const Tuning tuning = tuning_of(device);
        device.usable && !(tuning == default_tuning(device)))
      std::printf("     launched with %s, as meniscus tune found\n", to_string(tuning).c_str());
  }
  for (const std::string& other : problems) std::printf("! %s\n", other.c_str());
  if (chosen < 0) throw DeviceError(problem);
  std::printf(
      "\nThe default is %d: %s. Choose another by --device with its number, a part of its "
      "name, cpu or gpu.\n",
      chosen, why.c_str());
  if (const std::string folder = program_cache_folder(); !folder.empty())
    std::printf("Built kernels are kept in %s; remove it to build them anew.\n", folder.c_str());
}

}  // namespace

void add_devices_command(CLI::App& program) {
  program.add_subcommand("devices", "List the OpenCL devices and say which one is the default")
      ->callback(show_devices);
}

}  // namespace meniscus::cli
