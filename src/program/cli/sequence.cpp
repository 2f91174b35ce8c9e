#include "program/cli/sequence.hpp"

#include <ImfThreading.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "base/host_name.hpp"
#include "base/printed.hpp"
#include "device/building.hpp"
#include "device/device.hpp"
#include "frame/process.hpp"
#include "io/output_file.hpp"
#include "meniscus/device.hpp"
#include "methods/programs.hpp"
#include "prepare/choose_radius.hpp"
#include "prepare/fill.hpp"
#include "prepare/survey.hpp"
#include "program/batch/camera_track.hpp"
#include "program/batch/plan.hpp"
#include "program/batch/record.hpp"
#include "program/batch/report.hpp"
#include "program/batch/room.hpp"
#include "program/batch/run.hpp"
#include "program/cli/batch_progress.hpp"
#include "program/cli/extract_warnings.hpp"
#include "program/cli/options.hpp"
#include "program/cli/progress.hpp"
#include "program/cli/report.hpp"
#include "program/cli/signals.hpp"
#include "program/cli/terminal.hpp"
#include "program/mpi/launch.hpp"
#include "program/wording.hpp"

namespace meniscus::cli {
namespace {

struct ShardChoice {
  Shard shard;
  std::string origin;  // in words
};

/// --shard, else the task of a Slurm array.
ShardChoice choose_shard(const ExtractOptions& options) {
  const bool from_slurm = options.shard == "slurm";
  if (!options.shard.empty() && !from_slurm)
    return {as_usage([&] { return parse_shard(options.shard); }), "from --shard"};
  const char* const id = std::getenv("SLURM_ARRAY_TASK_ID");
  const char* const count = std::getenv("SLURM_ARRAY_TASK_COUNT");
  if (!id || !count) {
    if (from_slurm)
      throw usage_error(
          "--shard slurm: SLURM_ARRAY_TASK_ID and SLURM_ARRAY_TASK_COUNT are not set, must be a "
          "task of a Slurm array (or give --shard k/N)");
    return {};
  }
  // They may be this task's own, made from its number, or those of all tasks together.
  if (!from_slurm && !options.frames.empty())
    throw usage_error("--frames " + options.frames + " in task " + id +
                      " of a Slurm array: give --shard 1/1 if these frames are this task's own, or "
                      "--shard slurm to split them among the tasks of the array");
  const char* const first = std::getenv("SLURM_ARRAY_TASK_MIN");
  const char* const step = std::getenv("SLURM_ARRAY_TASK_STEP");
  const auto number = [](const char* text, long otherwise) {
    return text ? std::strtol(text, nullptr, 10) : otherwise;
  };
  const long place = (number(id, 0) - number(first, 0)) / std::max(1l, number(step, 1)) + 1;
  if (place > number(count, 0))
    throw usage_error("SLURM_ARRAY_TASK_ID is " + std::string(id) + " of an array of " + count +
                      " tasks that has gaps, which says nothing about parts (give --shard k/N)");
  return {as_usage([&] { return parse_shard(std::to_string(place) + "/" + count); }),
          "from SLURM_ARRAY_TASK_ID (--shard 1/1 for all)"};
}

/// A frame whose particles tell where the fluid is and how close they lie: the first of so many
/// particles, or the one of the most among the first frames that can be read. Emitters begin with
/// empty frames and with drops.
std::unique_ptr<ParticleSource> telling_frame(const ExtractOptions& options, const Plan& plan,
                                              std::string& path) {
  constexpr std::int64_t kTelling = 256;  // particles: mostly inside of the fluid
  constexpr int kLooks = 64;              // frames that are looked at: small ones
  std::unique_ptr<ParticleSource> best;
  std::int64_t most = 0;
  int looks = 0;
  for (const std::string& input : plan.inputs) try {
      auto particles = open_particles(input, reading_of(options));
      // Large frames are not looked through for particles that are not finite.
      const std::int64_t finite = particles->in_memory()
                                      ? survey_of(*particles).finite
                                      : static_cast<std::int64_t>(particles->size());
      if (!best || finite > most) {
        path = input;
        best = std::move(particles);
        most = finite;
      }
      if (most >= kTelling || ++looks == kLooks) break;
    } catch (const InputError&) {
      if (!best && input == plan.inputs.back()) throw;
    }
  return best;
}

// Fluid moves: what frames one frame may not frame the others.
std::vector<std::string> first_middle_last(const Plan& plan) {
  std::vector<std::string> frames;
  for (const std::size_t k : {std::size_t{0}, plan.inputs.size() / 2, plan.inputs.size() - 1})
    if (std::find(frames.begin(), frames.end(), plan.inputs[k]) == frames.end())
      frames.push_back(plan.inputs[k]);
  return frames;
}

void warn(const std::string& what) { print_line(stderr, "meniscus: warning: " + what); }

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

// What must be the same for all frames: the camera where none is given, and into `settings` the
// particle radius where no file states one, or of those files that do not. One frame settles it for
// all shards.
//
//   whole  this command does the whole sequence, and no other does a part of it
std::unique_ptr<CameraTrack> settle_for_all(const Plan& plan, const ExtractOptions& options,
                                            std::unique_ptr<CameraTrack> cameras, bool whole,
                                            BatchSettings& settings, const Talk& say) {
  if (options.closed) {
    if (options.particle_radius) return cameras;
  } else if (cameras) {
    say("camera", options.camera_file + (cameras->moves() ? ", one for each frame" : ""));
    if (options.particle_radius) return cameras;
  }
  std::string path;
  const auto particles = telling_frame(options, plan, path);
  if (!cameras) {
    std::string names = path;
    std::vector<std::unique_ptr<ParticleSource>> others;
    std::vector<const ParticleSource*> seen{particles.get()};
    if (!options.eye)
      for (const std::string& input : first_middle_last(plan)) try {
          if (input == path) continue;
          auto source = open_particles(input, reading_of(options));
          if (!source->in_memory()) survey_of(*source);
          seen.push_back(others.emplace_back(std::move(source)).get());
          names += ", " + input;
        } catch (const InputError&) {  // is said when it is the frame's turn
        }
    const auto [camera, origin] = aimed_camera(options, seen);
    cameras = std::make_unique<CameraTrack>(camera);
    keep_camera(options, camera);
    if (!whole && !options.eye && options.written_camera.empty())
      warn("the camera was chosen from the frames that are there now (" + names +
           "): keep it with --write-camera FILE and give it to the other parts with --camera FILE");
    say("camera", origin + (options.eye ? "" : " of " + names) + ", " +
                      std::to_string(camera.width) + "x" + std::to_string(camera.height));
  }
  if (options.particle_radius) return cameras;
  if (particles->particle_radius() > 0 || (particles->has_radius() && particles->in_memory())) {
    settings.others_file = path;
    settings.others_radius = particles->has_radius() ? survey_of(*particles).middle_radius
                                                     : particles->particle_radius();
  } else if (!particles->has_radius()) {
    std::vector<Notice> notices;
    settings.parameters.particle_radius =
        naming(path, [&] { return choose_radius(*particles, options.parameters, notices); });
    for (const Notice& notice : notices) warn(path + ", for all frames: " + words_of(notice));
  }
  return cameras;
}

BatchSettings settings_of(const ExtractOptions& options, const Shard& shard, const Talk& say) {
  BatchSettings settings;
  std::string why;
  settings.devices = chosen_devices(options.device, &why);
  for (const DeviceInfo& device : settings.devices) say("device", device.name + ": " + why);
  settings.parameters = options.parameters;
  settings.closed = options.closed;
  settings.writing = options.writing;
  settings.particle_radius = options.particle_radius.value_or(0);
  settings.reading = options.reading;
  settings.frames_per_second = options.frames_per_second;
  settings.in_flight = options.in_flight;
  settings.writers = Imf::globalThreadCount();
  settings.memory = options.memory;
  settings.resume = options.resume;
  settings.stage_times = options.timings;
  settings.fail_fast = options.fail_fast;
  settings.host = host_name();
  if (shard.count > 1)
    settings.shard = std::to_string(shard.index) + "/" + std::to_string(shard.count);
  return settings;
}

// Under a limit on memory PoCL hangs or aborts where it gets none, so that no more frames are under
// way at once than have room.
void fit_into_memory(BatchSettings& settings, const Plan& plan, const CameraTrack& cameras) {
  const std::size_t room = room_left();
  if (room == std::numeric_limits<std::size_t>::max()) return;
  std::size_t pixels = 0;
  for (const FrameJob& job : plan.jobs) try {
      const Camera camera = cameras.at(job.frame);
      pixels = std::max(
          pixels, static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
    } catch (const InputError&) {  // is said when it is the frame's turn
    }
  const int devices = static_cast<int>(settings.devices.size());
  const Crew asked{devices * settings.in_flight, settings.writers};
  const Crew crew = crew_within(asked, pixels, room);
  const auto megabytes = [](std::size_t bytes) { return grouped(bytes >> 20) + " MB"; };
  const std::string left = "the limit on memory leaves " + megabytes(room);
  if (crew.extracting < devices)
    throw Error(left + " and frames of " + grouped(pixels) + " pixels take about " +
                megabytes(room_for({devices, 1}, pixels)) +
                " (raise ulimit -v, or use fewer devices or a smaller image)");
  if (crew == asked) return;
  settings.in_flight = crew.extracting / devices;
  settings.writers = crew.writing;
  warn(left + ": " + counted(static_cast<std::size_t>(crew.extracting), "frame") +
       " in flight instead of " + std::to_string(asked.extracting) + ", and " +
       std::to_string(crew.writing) + " written at once instead of " +
       std::to_string(asked.writing));
}

// Whether more than a few drops are outside the image. Of frames that stream it is not counted.
bool leaves_image(const FrameRecord& record) {
  const auto counted = [&](const char* what) {
    for (const auto& [name, count] : record.counts)
      if (name == what) return count;
    return std::int64_t{0};
  };
  const std::int64_t all = counted("particles");
  return all < kStreamed && counted("in view") < all - all / 20;
}

// Where some frames have velocities and others have none.
void warn_of_velocities(const std::vector<std::int64_t>& moving,
                        const std::vector<std::int64_t>& still, const ExtractOptions& options) {
  if (!options.parameters.motion || !has_carried_values(options.outputs) || still.empty() ||
      (moving.empty() && !options.asks_for_velocity))
    return;
  warn((options.asks_for_velocity ? "--aov V: " : "") + named_frames(still) +
       ": the particles carry no velocities, so that V, forward and vx vy vz are missing" +
       (moving.empty() ? "" : ", which other frames have"));
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

// The part of a shard that one of several processes takes.
Shard part_of(const Shard& shard, int rank, int size) {
  return {shard.index + shard.count * rank, shard.count * size};
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
  const auto [whole, shard_origin] = choose_shard(options);
  const Shard shard = part_of(whole, team.rank(), team.size());
  std::unique_ptr<CameraTrack> cameras;
  if (options.closed)
    cameras = std::make_unique<CameraTrack>(Camera{});  // none
  else if (!options.camera_file.empty())
    cameras = std::make_unique<CameraTrack>(options.camera_file);
  else
    check_aim(options);
  const Plan plan = as_usage([&] {
    return plan_sequence(
        {input, options.outputs, options.frames, options.skip_missing, shard, options.whitewater},
        cameras.get());
  });
  if (team.leads())
    for (const std::string& warning : plan.warnings) warn(warning);
  prepare_folders(plan, cameras.get(), options);
  say("frames", input.text() + ": " + (plan.jobs.empty() ? "none" : named_frames(plan.frames())));
  if (shard.count > 1)
    say("shard", std::to_string(shard.index) + " of " + std::to_string(shard.count) + " of " +
                     std::to_string(plan.all_shards) + " frames, " +
                     (team.size() > 1 ? "one of the processes" : shard_origin));
  if (plan.jobs.empty()) return 0;
  const bool framed = !cameras && !options.eye;
  if (cameras && !options.closed && team.leads()) warn_of_cameras(plan, *cameras, options);
  BatchSettings settings = settings_of(options, shard, say);
  const bool is_whole = whole.count == 1 && options.frames.empty();
  cameras =
      settle_for_all(plan, options, std::move(cameras), is_whole || !team.leads(), settings, say);
  fit_into_memory(settings, plan, *cameras);
  if (!options.closed) say("method", to_string(options.parameters.method));
  if (options.verbose && team.leads()) print_lines(stderr, describe(settings.parameters));
  Imf::setGlobalThreadCount(0);  // each writer packs its own frame

  std::unique_ptr<BatchLog> log;
  if (!options.log.empty()) log = std::make_unique<BatchLog>(options.log);
  std::unique_ptr<OutputFile> page;
  if (!options.report.empty()) page = std::make_unique<OutputFile>(options.report);
  std::vector<FrameRecord> records;  // for the page: of earlier runs, too, where the log has them
  std::string note;
  if (page && log) records = read_log(options.log, &note);
  std::vector<std::int64_t> failed, moving, still;
  const GentleStop stop;
  const double cpu_before = processor_ms();
  BatchOutcome outcome;
  double seconds = 0;
  {
    BatchProgress progress(plan.jobs.size(), options.quiet);
    Device first(settings.devices.front());
    const std::vector<ProgramName> programs = programs_of(settings.parameters, first.state());
    Working working(programs.size(), options.quiet);
    settings.on_building = [&](int begun) { working.building(begun); };
    const BuildAhead ahead(first, programs);
    const auto over = [&](FrameRecord record) {
      working.built();  // the line is the batch's from now on
      if (!options.closed && leaves_image(record))
        record.warnings.push_back(
            std::string("more than 5 % of the particles are outside the image") +
            (framed ? ", whose camera was framed around the first, middle and last frame (give "
                      "--camera or --eye)"
                    : " (expected for a close-up)"));
      progress.over(record);
      if (record.status == FrameStatus::failed) failed.push_back(record.frame);
      if (record.velocities) (*record.velocities ? moving : still).push_back(record.frame);
      if (log) log->add(record);
      if (page) records.push_back(record);
    };
    outcome = run_batch(plan.jobs, *cameras, settings, stop.signal(), over);
    seconds = progress.seconds();
  }
  const double busy = (processor_ms() - cpu_before) /
                      (10 * seconds * std::max(1u, std::thread::hardware_concurrency()));
  warn_of_velocities(moving, still, options);
  say("done", done_line(outcome, seconds, busy));
  if (page) {
    std::vector<std::int64_t> frames = plan.frames();
    frames.insert(frames.end(), plan.missing.begin(), plan.missing.end());
    page->write(to_html(merge_records(records, frames)));
    page->commit();
    say("report", options.report);
  }
  if (log) say("log", options.log);
  return conclude(outcome, plan.jobs.size(), stop.signal(), failed);
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
