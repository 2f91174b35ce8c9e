// One process's part of a sequence, from the options to the exit code: run_part() is the table of
// contents.
#include "program/cli/sequence.hpp"

#include <ImfThreading.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "base/printed.hpp"
#include "device/building.hpp"
#include "device/device.hpp"
#include "frame/process.hpp"
#include "io/output_file.hpp"
#include "methods/programs.hpp"
#include "prepare/fill.hpp"
#include "program/batch/report.hpp"
#include "program/cli/batch_progress.hpp"
#include "program/cli/extract_warnings.hpp"
#include "program/cli/options.hpp"
#include "program/cli/progress.hpp"
#include "program/cli/sequence_settings.hpp"
#include "program/cli/shard_choice.hpp"
#include "program/cli/signals.hpp"
#include "program/cli/terminal.hpp"
#include "program/mpi/launch.hpp"

namespace meniscus::cli {
namespace {

// The cameras that the options name; none: one is to be aimed at the particles. Closed meshes look
// at no camera.
std::unique_ptr<CameraTrack> given_cameras(const ExtractOptions& options) {
  if (options.closed) return std::make_unique<CameraTrack>(Camera{});
  check_aim(options);
  if (!options.camera_file.empty())
    return std::make_unique<CameraTrack>(options.camera_file, options.share);
  return nullptr;
}

// Finds out before work begins whether the outputs can be written, and clears the folders of what
// killed processes left.
void prepare_folders(const Plan& plan, const CameraTrack* cameras, const ExtractOptions& options) {
  std::vector<std::string> outputs;
  for (const FrameJob& job : plan.jobs)
    outputs.insert(outputs.end(), job.outputs.begin(), job.outputs.end());
  std::vector<std::string> inputs = plan.inputs;
  for (const FrameJob& job : plan.jobs)
    for (const WhitewaterInput& one : job.whitewater) inputs.push_back(one.path);
  as_usage([&] {
    check_outputs({inputs, cameras ? cameras->files() : std::vector<std::string>()}, outputs,
                  {options.log, options.report, options.written_camera});
  });
  if (!options.report.empty()) check_page_name("--report", options.report);
  std::set<std::string> folders;
  for (const std::string& path : outputs)
    if (folders.insert(path.substr(0, path.rfind('/') + 1)).second) {
      OutputFile probe(path);
      remove_abandoned_outputs(path);
    }
  std::error_code ignored;
  for (const std::string& path : {options.log, options.report})
    if (const std::filesystem::path folder = std::filesystem::path(path).parent_path();
        !folder.empty() && !std::filesystem::exists(folder, ignored))
      OutputFile says_so(path);
}

// Of the first camera that can be read: the others will be like it.
void warn_of_cameras(const Plan& plan, const CameraTrack& cameras, const ExtractOptions& options) {
  for (const FrameJob& job : plan.jobs) try {
      for (const std::string& warning : warnings_of(cameras.at(job.frame), options.camera_file))
        warn(warning);
      return;
    } catch (const InputError&) {  // is said when it is the frame's turn
    }
}

// Whether more than a few drops are outside the image. Of frames that stream it is not counted.
// Where nothing is in view a warning has said so, which is enough of a camera that was `given`.
bool leaves_image(const FrameRecord& record, bool given) {
  const auto counted = [&](const char* what) {
    for (const auto& [name, count] : record.counts)
      if (name == what) return count;
    return std::int64_t{0};
  };
  const std::int64_t all = counted("particles");
  const std::int64_t in_view = counted("in view");
  return all < kStreamed && in_view < all - all / 20 && !(given && in_view == 0);
}

// What is kept of the frames that are over: for the log, for the page, and for the last words.
class Tally {
 public:
  // Of earlier runs, too, where the log has them.
  explicit Tally(const ExtractOptions& options) : options_(options) {
    if (!options.log.empty()) log_ = std::make_unique<BatchLog>(options.log);
    if (!options.report.empty()) page_ = std::make_unique<OutputFile>(options.report);
    std::string note;
    if (page_ && log_) records_ = read_log(options.log, &note);
  }

  void add(const FrameRecord& record) {
    if (record.status == FrameStatus::failed) failed_.push_back(record.frame);
    if (record.velocities) (*record.velocities ? moving_ : still_).push_back(record.frame);
    if (log_) log_->add(record);
    if (page_) records_.push_back(record);
  }

  // Where some frames have velocities and others have none.
  void warn_of_velocities() const {
    if (!options_.parameters.motion || !has_carried_values(options_.outputs) || still_.empty() ||
        (moving_.empty() && !options_.asks_for_velocity))
      return;
    warn((options_.asks_for_velocity ? "--aov V: " : "") + named_frames(still_) +
         ": the particles carry no velocities, so that V, forward and vx vy vz are missing" +
         (moving_.empty() ? "" : ", which other frames have"));
  }

  void write_page(const Plan& plan, const Talk& say) {
    if (page_) {
      std::vector<std::int64_t> frames = plan.frames();
      frames.insert(frames.end(), plan.missing.begin(), plan.missing.end());
      page_->write(to_html(merge_records(records_, frames)));
      page_->commit();
      say("report", options_.report);
    }
    if (log_) say("log", options_.log);
  }

  const std::vector<std::int64_t>& failed() const { return failed_; }

 private:
  const ExtractOptions& options_;
  std::unique_ptr<BatchLog> log_;
  std::unique_ptr<OutputFile> page_;
  std::vector<FrameRecord> records_;  // for the page
  std::vector<std::int64_t> failed_, moving_, still_;
};

// Extracts the frames of a plan, shows how far it is and adds each one that is over to `tally`.
//
//   framed  the camera was aimed at the sequence
BatchOutcome extract_all(const Plan& plan, const CameraTrack& cameras, BatchSettings settings,
                         const ExtractOptions& options, bool framed, const GentleStop& stop,
                         Tally& tally, double& seconds) {
  const std::size_t at_once =
      settings.devices.size() * static_cast<std::size_t>(settings.in_flight);
  BatchProgress progress(plan.jobs.size(), at_once, options.quiet);
  Device first(settings.devices.front());
  const std::vector<ProgramName> programs = programs_of(settings.parameters, first.state());
  Working working(programs.size(), options.quiet);
  settings.on_building = [&](int begun) {
    progress.building();
    working.building(begun);
  };
  settings.on_warning = [&](const FrameJob& job, const std::string& warning) {
    working.past([&] { progress.warned(job, warning); });
  };
  const BuildAhead ahead(first, programs);
  const auto over = [&](FrameRecord record) {
    working.built();  // the line is the batch's from now on
    if (!options.closed && leaves_image(record, !framed))
      record.warnings.push_back(
          std::string("more than 5 % of the particles are outside the image") +
          (framed ? ", whose camera was framed around the first, middle and last frame (give "
                    "--camera or --eye)"
                  : " (expected for a close-up)"));
    progress.over(record);
    tally.add(record);
  };
  const BatchOutcome outcome = run_batch(plan.jobs, cameras, settings, stop.signal(), over);
  seconds = progress.seconds();
  return outcome;
}

std::string done_line(const BatchOutcome& outcome, double seconds, double processors_percent) {
  std::string line = "no frame";
  if (outcome.done > 0)
    line = counted(outcome.done, "frame") + " in " + duration(seconds) + ": " +
           frame_rate(static_cast<double>(outcome.done) / seconds) +
           printed(", processors %.0f %% busy", processors_percent);
  if (outcome.skipped > 0)
    line += "; " + grouped(outcome.skipped) + (outcome.skipped == 1 ? " was" : " were") +
            " there already";
  return line;
}

// How a batch ended, as the exit code. Throws when a file could not be written.
int conclude(const BatchOutcome& outcome, std::size_t frames, int signal,
             const std::vector<std::int64_t>& failed) {
  const std::size_t left = frames - outcome.done - outcome.failed - outcome.skipped;
  const std::string go_on = "; the same command with --resume goes on";
  if (!outcome.broken.empty())
    throw OutputError(outcome.broken + "; " + std::to_string(outcome.done + outcome.skipped) +
                      " of " + std::to_string(frames) + " frames are done" + go_on);
  if (signal != 0) {
    print_line(stderr, printed("meniscus: error: stopped by signal %d with %zu of %s left%s",
                               signal, left, counted(frames, "frame").c_str(), go_on.c_str()));
    return kStoppedBySignal + signal;
  }
  if (failed.empty()) return 0;
  const std::string not_begun = left > 0 ? ", and " + std::to_string(left) + " were not begun" : "";
  print_line(stderr, printed("meniscus: error: %zu of %s failed: %s%s", failed.size(),
                             counted(frames, "frame").c_str(), listed_frames(failed).c_str(),
                             not_begun.c_str()));
  return kSomeFailed;
}

// out/log.jsonl -> out/log.2.jsonl: a log of its own for each process but the first.
std::string log_of(const std::string& path, int rank) {
  if (rank == 0 || path.empty()) return path;
  const std::filesystem::path name(path);
  return (name.parent_path() /
          (name.stem().string() + "." + std::to_string(rank) + name.extension().string()))
      .string();
}

// The frames of this process.
int run_part(ExtractOptions options, const FramePattern& input, const Team& team) {
  options.quiet |= !team.leads();
  options.log = log_of(options.log, team.rank());
  const Talk say(options.quiet);
  const ShardChoice chosen = choose_shard(options);
  const Shard shard = part_of(chosen.shard, team.rank(), team.size());
  std::unique_ptr<CameraTrack> cameras = given_cameras(options);
  const Plan plan = as_usage([&] {
    return plan_sequence(
        {input, options.outputs, options.frames, options.skip_missing, shard, options.whitewater},
        cameras.get());
  });
  if (team.leads()) {
    if (!chosen.warning.empty()) warn(chosen.warning);
    for (const std::string& warning : plan.warnings) warn(warning);
  }
  prepare_folders(plan, cameras.get(), options);
  say("frames", input.text() + ": " + (plan.jobs.empty() ? "none" : named_frames(plan.frames())));
  if (shard.count > 1)
    say("shard", std::to_string(shard.index) + " of " + std::to_string(shard.count) + " of " +
                     std::to_string(plan.all_shards) + " frames, " +
                     (team.size() > 1 ? "one of the processes" : chosen.origin));
  if (plan.jobs.empty()) return 0;
  const bool framed = !cameras && !options.eye;
  if (cameras && !options.closed && team.leads()) warn_of_cameras(plan, *cameras, options);
  BatchSettings settings = settings_of(options, shard, say);
  const bool is_whole = chosen.shard.count == 1 && options.frames.empty();
  cameras =
      settle_for_all(plan, options, std::move(cameras), is_whole || !team.leads(), settings, say);
  fit_into_memory(settings, plan, *cameras);
  if (!options.closed) say("method", to_string(options.parameters.method));
  if (options.verbose && team.leads()) print_lines(stderr, describe(settings.parameters));
  Imf::setGlobalThreadCount(0);  // each writer packs its own frame

  Tally tally(options);
  const GentleStop stop("stopping when the frames under way are done");
  const double cpu_before = processor_ms();
  double seconds = 0;
  const BatchOutcome outcome =
      extract_all(plan, *cameras, settings, options, framed, stop, tally, seconds);
  const double busy = (processor_ms() - cpu_before) /
                      (10 * seconds * std::max(1u, std::thread::hardware_concurrency()));
  tally.warn_of_velocities();
  say("done", done_line(outcome, seconds, busy));
  int page = 0;
  try {
    tally.write_page(plan, say);
  } catch (const OutputError& error) {  // hides nothing of how the batch ended
    print_line(stderr, "meniscus: error: " + words_of(error));
    page = 1;
  }
  return std::max(page, conclude(outcome, plan.jobs.size(), stop.signal(), tally.failed()));
}

}  // namespace

int run_sequence(const ExtractOptions& options, const FramePattern& input) {
  if (options.timings && options.log.empty() && options.report.empty())
    throw usage_error("--timings of a sequence goes into --log and --report: give one of them");
  Team& team = launched_team();
  if (team.size() > 1 && !options.report.empty())
    throw usage_error(
        "--report is for one process; of several make it from their logs by meniscus report");
  // Nobody leaves before all are done: mpirun stops the others when one ends with an error.
  const std::vector<int> codes = team.joined<int>({run_part(options, input, team)});
  return *std::max_element(codes.begin(), codes.end());
}

}  // namespace meniscus::cli
