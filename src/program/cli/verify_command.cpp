// `verify`: whether devices compute what they should, and the same as others.
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/grouped.hpp"
#include "io/input_file.hpp"
#include "io/output_file.hpp"
#include "meniscus/error.hpp"
#include "program/batch/outputs.hpp"
#include "program/child_process.hpp"
#include "program/cli/commands.hpp"
#include "program/cli/options.hpp"
#include "program/cli/progress.hpp"
#include "program/cli/signals.hpp"
#include "program/cli/terminal.hpp"
#include "verify/child.hpp"
#include "verify/devices.hpp"
#include "verify/page.hpp"
#include "verify/record.hpp"
#include "verify/repro.hpp"
#include "verify/results.hpp"
#include "verify/run.hpp"

namespace meniscus::cli {
namespace {

struct VerifyOptions {
  std::string size = "full", json, junit, html, record, commit;
  std::vector<std::string> compare;
  verify::Request request;
  bool quiet = false, list = false, list_devices = false;
  std::string child;  // what a process for a device is to do
};

verify::VerifyRun verify_with_progress(const VerifyOptions& options, const GentleStop& stop) {
  std::optional<Progress> progress;  // of one device
  std::string device;
  verify::Watch watch;
  watch.step = [&](const verify::Step& step) {
    const std::string name =
        step.number < 0 ? step.device : std::to_string(step.number) + " " + step.device;
    if (!progress || name != device) {
      device = name;
      progress.reset();
      progress.emplace(device.substr(0, 36), "", static_cast<std::int64_t>(step.items),
                       options.quiet);
      // Without a terminal a line for each device is enough.
      if (!options.quiet && !progress->shown()) print_line(stderr, "verifying  " + device);
    }
    progress->reached(static_cast<std::int64_t>(step.item - 1), step.name);
  };
  watch.failed = [&](const verify::Row& row) {
    if (options.quiet) return;
    if (progress) progress->hide();
    print_line(stderr, verify::failure_of(row));
  };
  watch.stop = [&stop] { return stop.signal().load(); };
  return verify::verify_devices(options.request, watch);
}

void write(std::optional<OutputFile>& file, const std::string& text) {
  if (!file) return;
  file->write(text);
  file->commit();
}

verify::VerifyRun read_run(const std::string& path) {
  return verify::run_from_json(read_file(path).bytes, path);
}

// The devices of several runs as those of one.
verify::VerifyRun together(const std::vector<std::string>& paths) {
  verify::VerifyRun all;
  for (const std::string& path : paths) {
    verify::VerifyRun run = read_run(path);
    all.version = run.version;
    for (verify::DeviceResults& device : run.devices) {
      device.file = path;
      all.devices.push_back(std::move(device));
    }
  }
  return all;
}

// The canonical bits of all devices that are selected, which must agree.
verify::Canonical record_on_devices(const VerifyOptions& options) {
  std::vector<verify::Canonical> found;
  for (const DeviceInfo& info : list_devices()) {
    if (!info.usable) continue;
    if (options.request.selector != "all" &&
        select_device(options.request.selector).index != info.index)
      continue;
    Device device(info);
    found.push_back(verify::record_canonical(device, [&](const std::string& what) {
      if (!options.quiet) print_line(stderr, "recording  " + info.name + ": " + what);
    }));
  }
  if (found.empty()) throw DeviceError("--record: no OpenCL device can be used");
  verify::Canonical canonical = verify::agreed(found);
  canonical.origin.commit = options.commit;
  return canonical;
}

// All files that are to be written, opened at first: that one cannot be is better known now than
// later.
struct VerifyFiles {
  std::optional<OutputFile> json, junit, html, record;

  explicit VerifyFiles(const VerifyOptions& options) {
    std::vector<std::string> read = options.compare;
    read.insert(read.end(), {options.request.program, options.request.manifest});
    as_usage([&] { check_outputs({read, {}}, {}, {options.json, options.junit, options.html}); });
    if (!options.html.empty()) check_page_name("--html", options.html);
    if (!options.json.empty() && options.json != "-") json.emplace(options.json);
    if (!options.junit.empty()) junit.emplace(options.junit);
    if (!options.html.empty()) html.emplace(options.html);
    if (!options.record.empty()) record.emplace(options.record);
  }
};

// Earlier runs, and whether what they found required is the same on all devices.
verify::VerifyRun compare_runs(const VerifyOptions& options, bool& same) {
  verify::VerifyRun run = together(options.compare);
  if (run.devices.size() < 2)
    throw usage_error("--compare: the files hold one device in all, two are needed");
  for (std::size_t k = 1; k < run.devices.size(); ++k) {
    if (options.json != "-")
      print_lines(stdout, verify::comparison_of(run.devices[0], run.devices[k]));
    same = same && verify::compared(run.devices[0], run.devices[k]).required() == 0;
  }
  return run;
}

// Told to stop by `stop`, it prints what was found before.
verify::VerifyRun verify_and_print(const VerifyOptions& options, const GentleStop& stop) {
  const verify::Request& request = options.request;
  check_parts_of_names("--kernel", request.kernels, verify::known_kernels());
  const std::string& folder = request.reproducers;
  if (!folder.empty()) as_usage([&] { verify::make_folder(folder); });
  verify::VerifyRun run = verify_with_progress(options, stop);
  if (options.json != "-") {
    print_lines(stdout, verify::table_of(run));
    if (!request.kernels.empty())
      print_line(stdout,
                 "kernels and references only: without --kernel probes, limits, whole frames and "
                 "known flaws are tested, too");
    for (const std::string& advice : verify::advice_of(run)) print_line(stdout, advice);
    if (request.program.empty())
      print_line(stdout, "canonical bits: " + verify::shipped_canonical().origin.words());
  }
  if (!folder.empty()) {
    const std::size_t count = verify::finish_folder(folder).size();
    const char* until = stop.signal() == 0 ? "" : " until it was stopped";
    print_line(stderr,
               count == 0
                   ? std::string("no launch failed") + until + ": there is no reproducer"
                   : counted(count, "reproducer") + " in " + folder + ": each has a README.md");
  }
  return run;
}

void run_verify(VerifyOptions& options, int& exit_code) {
  options.request.full = options.size == "full";
  if (options.list_devices) return verify::list_as_child(options.request.selector);
  if (!options.child.empty()) return verify::run_as_child(options.child);
  if (options.list) return print_names(verify::known_kernels());
  VerifyFiles files(options);
  if (files.record) {
    const verify::Canonical canonical = record_on_devices(options);
    write(files.record, verify::to_bytes(canonical));
    if (!options.quiet) print_line(stderr, canonical.origin.words());
    return;
  }
  std::optional<GentleStop> stop;
  bool same = true;
  verify::VerifyRun run;
  if (options.compare.empty()) {
    stop.emplace("stopping; what was compared so far follows");
    run = verify_and_print(options, *stop);
  } else {
    run = compare_runs(options, same);
  }
  exit_code = same && run.good() ? 0 : 1;
  if (options.json == "-") std::fputs(verify::to_json(run).c_str(), stdout);
  write(files.json, verify::to_json(run));
  write(files.junit, verify::to_junit(run));
  write(files.html, verify::to_html(run));
  const int signal = stop ? stop->signal().load() : 0;
  if (signal == 0 || run.finished()) return;
  print_line(stderr, "meniscus: error: verify was stopped by " + name_of_signal(signal) +
                         ": what it shows and writes is unfinished");
  exit_code = 128 + signal;
}

void add_size_option(CLI::App& command, VerifyOptions& o) {
  command
      .add_option(
          "--size", o.size,
          "full: all cases (default); small: a subset that takes seconds, e.g. for simulators")
      ->check(CLI::Validator(
          [](const std::string& text) {
            const bool good = text == "small" || text == "full";
            return good ? std::string() : "is " + text + ", must be small or full";
          },
          ""))
      ->type_name("S");
}

void add_output_options(CLI::App& command, VerifyOptions& o) {
  command.add_option("--json", o.json, "write the rows as JSON; -: to standard output, no table")
      ->type_name("FILE");
  command.add_option("--junit", o.junit, "write the rows as JUnit XML")->type_name("FILE");
  command.add_option("--html", o.html, "write one page: devices side by side")->type_name("FILE");
}

void add_repetition_options(CLI::App& command, verify::Request& request) {
  command
      .add_option("--repeat", request.repeat,
                  "run each launch and each frame N times; other bits are a failure (default 1)")
      ->check(from_to(1, 10'000))
      ->type_name("N");
  command
      .add_option(
          "--repro", request.reproducers,
          "make a folder in DIR, which must be new or empty, for launches that fail: source, "
          "buffers, expected bits and a host in C, to be sent to a driver's makers")
      ->type_name("DIR");
}

void add_own_kernel_options(CLI::App& command, verify::Request& request) {
  CLI::Option* own =
      command
          .add_option("--program", request.program,
                      "a kernel of your own instead: whether devices agree on what it computes")
          ->type_name("FILE.cl");
  CLI::Option* manifest =
      command
          .add_option(
              "--manifest", request.manifest,
              "what it gets, as {\"kernel\": \"k\", \"range\": [64], \"arguments\": [{\"type\": "
              "\"float\", \"count\": 64}]}, and what to expect; all keys are in "
              "docs/portability.md")
          ->type_name("FILE.json");
  own->needs(manifest);
  manifest->needs(own);
}

void add_compare_option(CLI::App& command, VerifyOptions& o) {
  command
      .add_option("--compare", o.compare,
                  "the JSON of earlier runs instead of a run: what differs between their devices")
      ->expected(1, 100)
      ->type_name("A.json B.json");
}

// Not for people: the canonical bits, and what the processes for each device are called with.
void add_hidden_options(CLI::App& command, VerifyOptions& o) {
  CLI::Option* commit = command.add_option("--commit", o.commit)->group("");
  command.add_option("--record", o.record)->group("")->needs(commit);
  command.add_option("--child", o.child)->group("");
  command.add_flag("--child-list", o.list_devices)->group("");
}

// A run of the built-in cases, one of an own kernel, a comparison, or a list.
void exclude_each_other(CLI::App& command) {
  std::vector<CLI::Option*> others;
  const auto exclude = [&](const char* name) {
    for (CLI::Option* other : others) command.get_option(name)->excludes(other);
  };
  for (const char* name : {"--kernel", "--size", "--repeat", "--repro"})
    others.push_back(command.get_option(name));
  exclude("--program");
  others.insert(others.end(), {command.get_option("--device"), command.get_option("--program")});
  exclude("--compare");
  others.push_back(command.get_option("--compare"));
  exclude("--list");
}

}  // namespace

void add_verify_command(CLI::App& program, int& exit_code) {
  CLI::App& command = *program.add_subcommand(
      "verify", "Check that devices compute what they should, to the last bit");
  const auto options = std::make_shared<VerifyOptions>();
  VerifyOptions& o = *options;
  verify::Request& request = o.request;
  add_device_option(command, request.selector, ", or all (default)");
  add_kernel_option(command, request.kernels);
  add_size_option(command, o);
  add_output_options(command, o);
  add_repetition_options(command, request);
  add_own_kernel_options(command, request);
  add_compare_option(command, o);
  add_list_option(command, o.list);
  command
      .add_option("--timeout", request.seconds,
                  "a device that says nothing for so many seconds is given up (default 300)")
      ->check(from_to(1.0, 1e6))
      ->type_name("S");
  command.add_flag("-q,--quiet", o.quiet, "print no progress");
  add_hidden_options(command, o);
  exclude_each_other(command);
  command.callback([options, &exit_code] { run_verify(*options, exit_code); });
}

}  // namespace meniscus::cli
