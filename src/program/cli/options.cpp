#include "program/cli/options.hpp"

#include <ImfThreading.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <thread>

#include "base/parallel.hpp"
#include "base/printed.hpp"
#include "io/input_file.hpp"
#include "meniscus/camera.hpp"
#include "program/batch/outputs.hpp"
#include "program/cli/terminal.hpp"
#include "program/cli/unknown_word.hpp"
#include "program/dam_break.hpp"

namespace meniscus::cli {

std::array<int, 2> parse_size(const std::string& text) {
  std::array<int, 2> size{};
  const char* const end = text.data() + text.size();
  const auto [x, width_error] = std::from_chars(text.data(), end, size[0]);
  if (width_error == std::errc() && x != end && *x == 'x') {
    const auto [rest, height_error] = std::from_chars(x + 1, end, size[1]);
    if (height_error == std::errc() && rest == end && std::ranges::min(size) >= 1 &&
        std::ranges::max(size) <= kLargestSide)
      return size;
  }
  throw usage_error("--size is " + text + ", must be WIDTHxHEIGHT, each 1 to " +
                    std::to_string(kLargestSide) + " pixels, e.g. 1024x768");
}

double parse_share(const std::string& text) {
  constexpr double kMost = 1000;
  double percent = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, percent);
  if (error == std::errc() && rest + 1 == end && *rest == '%' && percent > 0 && percent <= kMost)
    return percent / 100;
  throw usage_error("--size is " + text + ", must be a share up to 1000%, e.g. 50%");
}

std::int64_t parse_particles(const std::string& text) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  if (error == std::errc() && rest == end && value == std::trunc(value) &&
      value >= DamBreak::kFewest && value <= DamBreak::kMost)
    return static_cast<std::int64_t>(value);
  throw usage_error("--particles is " + text + ", must be a whole number from " +
                    std::to_string(DamBreak::kFewest) + " to " + std::to_string(DamBreak::kMost));
}

namespace {

// 134217728, 128M, 128MB, 128MiB or 0.5G: powers of 1024.
std::size_t parse_bytes(const std::string& text) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [unit, error] = std::from_chars(text.data(), end, value);
  const std::string letters = "KMGT";
  std::size_t shift = 0;
  bool good = error == std::errc() && value > 0;
  if (good && unit != end) {
    const std::size_t place = letters.find(*unit);
    const std::string rest(unit + 1, end);
    good = place != std::string::npos && (rest.empty() || rest == "B" || rest == "iB");
    shift = 10 * (place + 1);
  }
  if (good) value *= static_cast<double>(std::size_t{1} << shift);
  if (good && value < 0x1p62) return static_cast<std::size_t>(value);
  throw usage_error("--memory is " + text +
                    ", must be bytes > 0, as a number, or with K, M, G or T, e.g. 512M");
}

// CLI11's own range says "Value 0 not in range 1.000000 to 1000000.000000", and in the help, too.
template <class Number>
CLI::Validator between(Number least, Number most, const char* format) {
  const std::string wanted = ", must be " + printed(format, least) + " to " + printed(format, most);
  return CLI::Validator(
      [=](const std::string& text) {
        Number value{};
        const char* const end = text.data() + text.size();
        const auto [rest, error] = std::from_chars(text.data(), end, value);
        const bool good = error == std::errc() && rest == end && value >= least && value <= most;
        return good ? std::string() : "is " + text + wanted;
      },
      "");
}

}  // namespace

CLI::Validator from_to(int least, int most) { return between(least, most, "%d"); }
CLI::Validator from_to(double least, double most) { return between(least, most, "%.0f"); }

std::vector<DeviceInfo> chosen_devices(const std::string& selector, std::string* why) {
  if (selector != "all") return {select_device(selector, why)};
  if (why) *why = "all";
  std::vector<DeviceInfo> usable;
  for (const DeviceInfo& device : list_devices())
    if (device.usable) usable.push_back(device);
  if (usable.empty()) select_device("");  // says why there is none
  return usable;
}

void check_parts_of_names(const std::string& option, const std::vector<std::string>& parts,
                          const std::vector<std::string>& names) {
  const auto matches = [&](const std::string& part) {
    return std::any_of(names.begin(), names.end(), [&](const std::string& name) {
      return name.find(part) != std::string::npos;
    });
  };
  for (const std::string& part : parts) {
    if (part.empty())
      throw usage_error(option +
                        " has an empty name, must be parts of names (--list has them all)");
    if (matches(part)) continue;
    const std::string nearest = nearest_name(part, names);
    throw usage_error(option + " is " + part + ", must be a part of a name" +
                      (nearest.empty() ? "" : " such as " + nearest) + " (--list has them all)");
  }
}

void check_page_name(const std::string& option, const std::string& path) {
  if (!lower_case(path).ends_with(".html"))
    throw usage_error(option + " is " + path + ", must end in .html: it is a page");
}

void require_memory(std::int64_t particles, std::int64_t bytes_each) {
  const auto gigabytes = [](double bytes) { return printed("%.3g GB", bytes / 1e9); };
  const double wanted = static_cast<double>(particles) * static_cast<double>(bytes_each);
  const double has =
      static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGE_SIZE));
  if (wanted > has)
    throw Error("--particles is " + std::to_string(particles) +
                ", which are held in memory and take " + gigabytes(wanted) +
                " or more, but the machine has " + gigabytes(has) + " (give fewer)");
}

CLI::Option* add_positive_option(CLI::App& command, const std::string& name,
                                 const std::string& unit, std::function<void(double)> take,
                                 const std::string& help) {
  return command.add_option_function<double>(
      name,
      [name, unit, take = std::move(take)](double value) {
        if (!(value > 0) || !std::isfinite(value))
          throw usage_error(name.substr(name.find("--")) +
                            printed(" is %g, must be a number > 0, in ", value) + unit);
        take(value);
      },
      help);
}

void add_device_option(CLI::App& command, std::string& device, const std::string& more) {
  command
      .add_option("--device", device,
                  "OpenCL device: a number, a part of a name, cpu or gpu" + more)
      ->type_name("D");
}

void add_kernel_option(CLI::App& command, std::vector<std::string>& kernels) {
  command
      .add_option(
          "--kernel", kernels,
          "only kernels with this in their names; several separated by commas, or given one "
          "by one")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("K,...");
}

CLI::Option* add_list_option(CLI::App& command, bool& list) {
  return command.add_flag("--list", list, "print the names of the kernels, and do nothing else");
}

void print_names(const std::vector<std::string>& names) {
  for (const std::string& name : names) print_line(stdout, name);
}

void add_memory_option(CLI::App& command, std::size_t& memory, const std::string& effect) {
  command
      .add_option_function<std::string>(
          "--memory", [&memory](const std::string& text) { memory = parse_bytes(text); },
          effect + ": bytes, or with K, M or G (default " +
              (memory >> 30 > 0 ? std::to_string(memory >> 30) + "G"
                                : std::to_string(memory >> 20) + "M") +
              ")")
      ->type_name("BYTES");
}

CLI::Option* add_threads_option(CLI::App& command, int& threads) {
  return command.add_option("--threads", threads, "processor threads (default: all)")
      ->type_name("N")
      ->check(from_to(1, 1024));
}

void use_threads(int threads) {
  if (threads > 0) {
    const std::string count = std::to_string(threads);
    setenv("POCL_MAX_PTHREAD_COUNT", count.c_str(), 1);  // up to PoCL 3
    setenv("POCL_CPU_MAX_CU_COUNT", count.c_str(), 1);   // from PoCL 4 on
    setenv("DPCPP_CPU_NUM_CUS", count.c_str(), 1);       // Intel's, whose compute units stay
    limit_threads(threads);
  }
  const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
  Imf::setGlobalThreadCount(threads > 0 ? threads : static_cast<int>(cores));
}

}  // namespace meniscus::cli
