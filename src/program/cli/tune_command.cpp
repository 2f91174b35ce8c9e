// `tune`: measures how a device's kernels are launched fastest, and keeps it for all later runs.
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>

#include "base/printed.hpp"
#include "device/tuning.hpp"
#include "frame/tune.hpp"
#include "program/cli/commands.hpp"
#include "program/cli/options.hpp"
#include "program/cli/terminal.hpp"

namespace meniscus::cli {
namespace {

struct TuneOptions {
  std::string device;
  int rounds = 7;
  bool forget = false, quiet = false;
};

void tune_device(const DeviceInfo& info, const TuneOptions& options) {
  print_line(stdout, info.name + " (" + info.platform + ", driver " + info.driver + ")");
  if (options.forget) {
    forget_tuning(info);
    print_line(stdout, "  forgotten: " + to_string(tuning_of(info)) + " from now on");
    return;
  }
  const TuningRun run = tune(info, dam_frame(), options.rounds, [&](const std::string& what) {
    if (!options.quiet) print_line(stderr, "measuring  " + what);
  });
  for (const Trial& trial : run.trials) {
    std::string note = trial.tuning == default_tuning(info) ? "  (default)" : "";
    if (!trial.error.empty())
      note += "  does not run: " + trial.error;
    else if (!trial.same_bits)
      note += "  other bits: not used";
    std::string time;
    if (std::isfinite(trial.ms)) time = printed("%8.1f ms", trial.ms);
    if (std::isfinite(trial.spread_ms))
      time += printed(" + %.0f %%", 100 * trial.spread_ms / trial.ms);
    print_line(stdout, printed("  %-39s %18s%s", to_string(trial.tuning).c_str(), time.c_str(),
                               note.c_str()));
  }
  if (!keep_tuning(info, run.best))
    throw Error(
        "tune: the choice cannot be kept: set MENISCUS_CACHE_DIR to a folder that can be written");
  const bool is_default = run.best == default_tuning(info);
  print_line(stdout,
             "  kept: " + to_string(run.best) +
                 (is_default ? ", since no way is faster by 3 % and by more than the frames "
                               "spread"
                             : ""));
}

}  // namespace

void add_tune_command(CLI::App& program) {
  CLI::App& command =
      *program.add_subcommand("tune", "Measure once how a device's kernels are launched fastest");
  const auto options = std::make_shared<TuneOptions>();
  TuneOptions& o = *options;
  add_device_option(command, o.device, ", or all (default: the one that extract takes)");
  command
      .add_option("--rounds", o.rounds,
                  "frames of each way (default 7); of one frame each the default is kept")
      ->check(from_to(1, 1000))
      ->type_name("N");
  command.add_flag("--forget", o.forget, "forget what was kept");
  command.add_flag("-q,--quiet", o.quiet, "print no progress");
  command.callback([options] {
    for (const DeviceInfo& info : chosen_devices(options->device)) tune_device(info, *options);
  });
}

}  // namespace meniscus::cli
