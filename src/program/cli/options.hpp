// Options that several commands have.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "meniscus/device.hpp"
#include "meniscus/error.hpp"
#include "program/wording.hpp"

namespace meniscus::cli {

/// What a wrong value throws: one line and exit code 2.
inline CLI::ValidationError usage_error(const std::string& what) {
  return CLI::ValidationError(what);
}

/// Does `work`; what it finds wrong with an argument is bad usage.
template <class Work>
auto as_usage(const Work& work) {
  try {
    return work();
  } catch (const InvalidArgument& error) {
    throw usage_error(words_of(error));
  }
}

/// "1024x768" -> {1024, 768}. Throws usage_error.
std::array<int, 2> parse_size(const std::string& text);

/// "50%", of the option --size.
double parse_share(const std::string& text);

/// How many particles to generate: 1000000 or 1e6. Throws usage_error.
std::int64_t parse_particles(const std::string& text);

/// The device that `selector` names, or, for "all", every one that can be used; `why` as from
/// select_device. Throws DeviceError when there is none.
std::vector<DeviceInfo> chosen_devices(const std::string& selector, std::string* why = nullptr);

/// Throws usage_error where one of the `parts` given with `option` is empty or in none of the
/// names.
void check_parts_of_names(const std::string& option, const std::vector<std::string>& parts,
                          const std::vector<std::string>& names);

/// Throws usage_error unless the name given with `option` is a page's: it ends in .html. So no log,
/// camera or image is replaced by a page.
void check_page_name(const std::string& option, const std::string& path);

/// Throws Error where so many particles take more memory than the machine has: without a word the
/// system would end this program, or another one.
void require_memory(std::int64_t particles, std::int64_t bytes_each);

/// What a number must be: "--in-flight is 0, must be 1 to 64".
CLI::Validator from_to(int least, int most);
CLI::Validator from_to(double least, double most);

/// --device D; `more` ends its help: whether it may be all, and the default.
void add_device_option(CLI::App& command, std::string& device, const std::string& more);

/// --kernel K, parts of names, separated by commas or given several times.
void add_kernel_option(CLI::App& command, std::vector<std::string>& kernels);

/// --list: only the names that --kernel can take are printed, with print_names.
CLI::Option* add_list_option(CLI::App& command, bool& list);

/// Prints names to standard output, one a line.
void print_names(const std::vector<std::string>& names);

/// An option that takes a finite number above 0; `unit` says what of.
CLI::Option* add_positive_option(CLI::App& command, const std::string& name,
                                 const std::string& unit, std::function<void(double)> take,
                                 const std::string& help);

/// --memory BYTES, which bounds what `effect` says.
void add_memory_option(
    CLI::App& command, std::size_t& memory,
    const std::string& effect = "device memory that the passes over large files may take");

/// --threads N; 0 stands for all.
CLI::Option* add_threads_option(CLI::App& command, int& threads);

/// Limits PoCL, Intel's runtime, the host's loops and OpenEXR to so many processor threads; 0: all.
/// Call it before the first OpenCL call: the runtimes read their number of threads then.
void use_threads(int threads);

}  // namespace meniscus::cli
