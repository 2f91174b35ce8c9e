#include "program/cli/bench_command.hpp"

#include <memory>
#include <sstream>

#include "program/cli/commands.hpp"
#include "program/cli/options.hpp"

namespace meniscus::cli {
namespace {

std::vector<long long> parse_counts(const std::string& text) {
  std::vector<long long> counts;
  std::istringstream words(text);
  for (std::string word; std::getline(words, word, ',');) counts.push_back(parse_particles(word));
  if (counts.empty()) throw usage_error("--particles is empty, must be numbers of particles");
  return counts;
}

}  // namespace

void add_bench_command(CLI::App& program, int& exit_code) {
  CLI::App& command =
      *program.add_subcommand("bench", "Measure the kernels' speed against the device's limits");
  const auto options = std::make_shared<BenchOptions>();
  BenchOptions& o = *options;
  add_device_option(command, o.device,
                    ", or all (default: the fastest kind found, see meniscus devices)");
  add_kernel_option(command, o.kernels);
  command
      .add_option_function<std::string>(
          "--particles", [&o](const std::string& text) { o.particles = parse_counts(text); },
          "particles of the frames, separated by commas (default 10000,40000,160000)")
      ->type_name("N,...");
  command
      .add_option_function<std::string>(
          "--size", [&o](const std::string& text) { o.size = parse_size(text); },
          "image size in pixels (default 1024x768)")
      ->type_name("WxH");
  add_threads_option(command, o.threads)
      ->description(
          "processor threads of the device and of the native versions (default: all, and then "
          "one)");
  command
      .add_option("--repetitions", o.repetitions,
                  "launches of each kernel at least (default 20); the fastest counts, and how "
                  "far the fastest quarter reaches above it is the noise")
      ->check(from_to(1, 1000))
      ->type_name("N");
  command
      .add_option("--json", o.json, "write the results as JSON; -: to standard output, no table")
      ->type_name("FILE");
  const std::vector<CLI::Option*> of_a_run = command.get_options();
  command.add_option("--html", o.html, "write one page with bars and roofline plots")
      ->type_name("FILE");
  command
      .add_option("--compare", o.compare,
                  "JSON of an earlier run: say which differences exceed the noise; with the "
                  "JSON of a later run behind it nothing is measured")
      ->expected(1, 2)
      ->type_name("OLD.json [NEW.json]");
  add_list_option(command, o.list);
  command.add_flag("--child", o.is_child)->group("");
  command.add_flag("--without-control", o.without_control)->group("");
  command.add_flag("-q,--quiet", o.quiet, "print no progress");
  const std::vector<CLI::Option*> own = command.get_options();
  add_bench_frame_command(command);
  for (CLI::App* frame : command.get_subcommands({}))
    for (CLI::Option* option : own)
      if (option != command.get_help_ptr()) frame->excludes(option);
  command.callback([options, of_a_run, &command, &exit_code] {
    if (!command.get_subcommands().empty()) return;
    for (const CLI::Option* option : of_a_run)
      if (options->compare.size() == 2 && option->count() > 0)
        throw usage_error(option->get_name() +
                          " is given with two files of --compare, of which none is measured");
    exit_code = bench_kernels(*options);
  });
}

}  // namespace meniscus::cli
