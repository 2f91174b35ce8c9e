// `report`: the logs of a batch as one page.
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "base/grouped.hpp"
#include "io/output_file.hpp"
#include "meniscus/error.hpp"
#include "program/batch/frames.hpp"
#include "program/batch/outputs.hpp"
#include "program/batch/record.hpp"
#include "program/batch/report.hpp"
#include "program/cli/commands.hpp"
#include "program/cli/options.hpp"
#include "program/cli/report.hpp"
#include "program/cli/terminal.hpp"
#include "program/wording.hpp"

namespace meniscus::cli {
namespace {

struct ReportOptions {
  std::vector<std::string> logs;
  std::string output, frames;
  bool quiet = false;
};

void run_report(const ReportOptions& options) {
  std::vector<std::int64_t> expected;
  if (!options.frames.empty()) try {
      expected = parse_frames(options.frames);
    } catch (const InvalidArgument& error) {
      throw usage_error(words_of(error));
    }
  as_usage([&] { check_outputs({options.logs, {}}, {}, {options.output}); });
  check_page_name("--output", options.output);
  OutputFile page(options.output);  // better now than later
  std::vector<FrameRecord> records;
  std::vector<std::string> notes;
  for (const std::string& log : options.logs) {
    std::string note;
    for (FrameRecord& record : read_log(log, &note)) records.push_back(std::move(record));
    if (note.empty()) continue;
    print_line(stderr, "meniscus: warning: " + note);
    notes.push_back(note);
  }
  if (records.empty()) print_line(stderr, "meniscus: warning: the logs have no frame");
  BatchReport report = merge_records(records, expected);
  report.notes = notes;
  page.write(to_html(report));
  page.commit();

  const Talk say(options.quiet);
  const auto count = [&](FrameStatus status) { return grouped(report.count(status)); };
  say("frames", grouped(report.frames.size()) + " in " + counted(options.logs.size(), "log") +
                    ": " + count(FrameStatus::done) + " done, " + count(FrameStatus::skipped) +
                    " there already, " + count(FrameStatus::failed) + " failed; " +
                    grouped(report.missing.size()) + " missing");
  say("wrote", options.output);
}

}  // namespace

void add_report_command(CLI::App& program) {
  CLI::App& command = *program.add_subcommand(
      "report", "Make a page of a batch's logs: pictures, plots, what went wrong");
  const auto options = std::make_shared<ReportOptions>();
  ReportOptions& o = *options;
  command.add_option("LOG", o.logs, "what extract --log wrote; of all shards and runs together")
      ->required()
      ->type_name("FILE");
  command.add_option("-o,--output", o.output, "the page, an .html file that needs nothing else")
      ->required()
      ->type_name("FILE");
  command
      .add_option("--frames", o.frames,
                  "the frames there should be, as for extract (default: those between the first "
                  "and the last one)")
      ->type_name("LIST");
  command.add_flag("-q,--quiet", o.quiet, "print only warnings and errors");
  command.callback([options] { run_report(*options); });
}

}  // namespace meniscus::cli
