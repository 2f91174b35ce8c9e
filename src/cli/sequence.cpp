#include "cli/sequence.hpp"

#include <ImfThreading.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "batch/camera_track.hpp"
#include "batch/plan.hpp"
#include "batch/record.hpp"
#include "batch/run.hpp"
#include "canonical_order.hpp"
#include "cli/batch_progress.hpp"
#include "cli/options.hpp"
#include "cli/report.hpp"
#include "cli/signals.hpp"
#include "extract.hpp"
#include "frame/process.hpp"
#include "io/output_file.hpp"
#include "meniscus/device.hpp"

namespace meniscus::cli {
namespace {

struct ShardChoice {
  Shard shard;
  std::string origin;  // in words
};

/// --shard, else the task of a Slurm array.
ShardChoice choose_shard(const ExtractOptions& options) {
  if (!options.shard.empty())
    return {as_usage([&] { return parse_shard(options.shard); }), "from --shard"};
  const char* const id = std::getenv("SLURM_ARRAY_TASK_ID");
  const char* const count = std::getenv("SLURM_ARRAY_TASK_COUNT");
  if (!id || !count) return {};
  const char* const first = std::getenv("SLURM_ARRAY_TASK_MIN");
  const char* const step = std::getenv("SLURM_ARRAY_TASK_STEP");
  const auto number = [](const char* text, long otherwise) {
    return text ? std::strtol(text, nullptr, 10) : otherwise;
  };
  const long place = (number(id, 0) - number(first, 0)) / std::max(1l, number(step, 1)) + 1;
  return {as_usage([&] { return parse_shard(std::to_string(place) + "/" + count); }),
          "from SLURM_ARRAY_TASK_ID (--shard 1/1 for all)"};
}

/// The first frame that can be read, whatever shard it is of: it settles what must be the same for
/// all frames, the camera where none is given and the particle radius where no file states one.
std::unique_ptr<ParticleSource> first_readable(const ExtractOptions& options, const Plan& plan,
                                               std::string& path) {
  for (const std::string& input : plan.inputs) try {
      path = input;
      return open_particles(input, options.particle_radius.value_or(0));
    } catch (const InputError&) {
      if (input == plan.inputs.back()) throw;
    }
  return nullptr;
}

std::vector<DeviceInfo> choose_devices(const std::string& selector, std::string& why) {
  if (selector != "all") return {select_device(selector, &why)};
  std::vector<DeviceInfo> devices = list_devices();
  std::erase_if(devices, [](const DeviceInfo& device) { return !device.usable; });
  if (devices.empty())
    throw DeviceError("--device all: none of the OpenCL devices is usable (see meniscus devices)");
  why = "all";
  return devices;
}

std::string host_name() {
  char name[256] = "";
  gethostname(name, sizeof name - 1);
  return name;
}

void warn(const std::string& what) {
  std::fprintf(stderr, "meniscus: warning: %s\n", what.c_str());
}

}  // namespace

int run_sequence(const ExtractOptions& given, const FramePattern& input) {
  ExtractOptions options = given;
  const Talk say(options.quiet);
  const auto [shard, shard_origin] = choose_shard(options);

  std::unique_ptr<CameraTrack> cameras;
  if (!options.camera_file.empty()) cameras = std::make_unique<CameraTrack>(options.camera_file);
  const Plan plan = as_usage([&] {
    return plan_sequence({input, options.outputs, options.frames, options.skip_missing, shard},
                         cameras.get());
  });
  for (const std::string& warning : plan.warnings) warn(warning);
  for (const FrameJob& job : plan.jobs) as_usage([&] { check_outputs(job.input, job.outputs); });
  std::set<std::string> folders;  // better now than later
  for (const FrameJob& job : plan.jobs)
    for (const std::string& path : job.outputs)
      if (folders.insert(path.substr(0, path.rfind('/') + 1)).second) {
        OutputFile probe(path);
        remove_abandoned_outputs(path);
      }
  std::vector<std::int64_t> frames;
  for (const FrameJob& job : plan.jobs) frames.push_back(job.frame);
  say("frames", input.text() + ": " + (frames.empty() ? "none" : named_frames(frames)));
  if (shard.count > 1)
    say("shard", std::to_string(shard.index) + " of " + std::to_string(shard.count) + " of " +
                     std::to_string(plan.frames) + " frames, " + shard_origin);
  if (plan.jobs.empty()) return 0;

  std::string first;
  if (!cameras || !options.particle_radius) {
    const auto particles = first_readable(options, plan, first);
    if (!cameras) {
      const auto [camera, origin] = aimed_camera(options, *particles);
      cameras = std::make_unique<CameraTrack>(camera);
      say("camera", origin + (options.eye ? "" : " of " + first) + ", " +
                        std::to_string(camera.width) + "x" + std::to_string(camera.height));
    }
    const Particles* const all = particles->in_memory();
    if (all && !options.particle_radius && !particles->has_radius() &&
        !(particles->particle_radius() > 0)) {
      std::vector<std::string> warnings;
      options.parameters.particle_radius =
          choose_radius(*all, canonical_order(*all, {}, warnings), options.parameters, warnings);
      for (const std::string& warning : warnings) warn(first + ", for all frames: " + warning);
    }
  }
  if (!options.camera_file.empty())
    say("camera", options.camera_file + (cameras->moves() ? ", one for each frame" : ""));

  BatchSettings settings;
  std::string why;
  settings.devices = choose_devices(options.device, why);
  for (const DeviceInfo& device : settings.devices) say("device", device.name + ": " + why);
  say("method", to_string(options.parameters.method));
  settings.parameters = options.parameters;
  settings.writing = options.writing;
  settings.particle_radius = options.particle_radius.value_or(0);
  settings.in_flight = options.in_flight;
  settings.writers = Imf::globalThreadCount();
  settings.memory = options.memory;
  settings.resume = options.resume;
  settings.fail_fast = options.fail_fast;
  settings.host = host_name();
  if (shard.count > 1)
    settings.shard = std::to_string(shard.index) + "/" + std::to_string(shard.count);
  Imf::setGlobalThreadCount(0);  // each writer packs its own frame

  std::unique_ptr<BatchLog> log;
  if (!options.log.empty()) log = std::make_unique<BatchLog>(options.log);
  const std::unique_ptr<OutputFile> page =
      options.report.empty() ? nullptr : std::make_unique<OutputFile>(options.report);
  std::vector<FrameRecord> records;
  std::vector<std::int64_t> failed;

  const GentleStop stop;
  const double cpu_before = processor_ms();
  BatchOutcome outcome;
  double seconds = 0;
  {
    BatchProgress progress(plan.jobs.size(), options.quiet);
    outcome =
        run_batch(plan.jobs, *cameras, settings, stop.signal(), [&](const FrameRecord& record) {
          progress.over(record);
          if (record.status == FrameStatus::failed) failed.push_back(record.frame);
          if (log) log->add(record);
          if (page) records.push_back(record);
        });
    seconds = progress.seconds();
  }
  const std::size_t left = plan.jobs.size() - outcome.done - outcome.failed - outcome.skipped;
  char figures[160];
  const double cores = std::max(1u, std::thread::hardware_concurrency());
  std::snprintf(figures, sizeof figures, " in %s: %.2f frames/s, processors %.0f %% busy",
                duration(seconds).c_str(), static_cast<double>(outcome.done) / seconds,
                (processor_ms() - cpu_before) / (10 * seconds * cores));
  say("done",
      std::to_string(outcome.done) + " frames" + figures +
          (outcome.skipped > 0 ? "; " + std::to_string(outcome.skipped) + " were there already"
                               : ""));
  if (page) {
    page->commit();
    say("report", options.report);
  }
  if (log) say("log", options.log);

  const std::string go_on = "; the same command with --resume goes on";
  if (!outcome.broken.empty())
    throw OutputError(outcome.broken + "; " + std::to_string(outcome.done) + " of " +
                      std::to_string(plan.jobs.size()) + " frames are done" + go_on);
  if (const int signal = stop.signal(); signal != 0) {
    std::fprintf(stderr, "meniscus: error: stopped by signal %d with %zu of %zu frames left%s\n",
                 signal, left, plan.jobs.size(), go_on.c_str());
    return kStoppedBySignal + signal;
  }
  if (!failed.empty()) {
    std::fprintf(stderr, "meniscus: error: %s of %zu failed%s\n", named_frames(failed).c_str(),
                 plan.jobs.size(),
                 left > 0 ? (", and " + std::to_string(left) + " were not begun").c_str() : "");
    return kSomeFailed;
  }
  return 0;
}

}  // namespace meniscus::cli
