#include "program/cli/sequence_settings.hpp"

#include <ImfThreading.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <utility>
#include <vector>

#include "base/host_name.hpp"
#include "base/printed.hpp"
#include "meniscus/device.hpp"
#include "prepare/choose_radius.hpp"
#include "prepare/survey.hpp"
#include "program/batch/room.hpp"
#include "program/cli/options.hpp"
#include "program/cli/terminal.hpp"
#include "program/wording.hpp"

namespace meniscus::cli {
namespace {

constexpr int kLooks = 64;  // frames that are looked at, for one that tells something

// A frame whose particles tell where the fluid is and how close they lie: the first of so many
// particles, or the one of the most among the first frames that can be read. Emitters begin with
// empty frames and with drops.
std::unique_ptr<ParticleSource> telling_frame(const ExtractOptions& options, const Plan& plan,
                                              std::string& path) {
  constexpr std::int64_t kTelling = 256;  // particles: mostly inside of the fluid
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

// A frame that a camera is to show.
struct SeenFrame {
  std::string path;
  std::unique_ptr<ParticleSource> particles;
};

// Fluid moves: what frames one frame may not frame the others. For one that is empty or cannot be
// read, as the last one of a simulation that still runs, the nearest one before it stands.
std::vector<SeenFrame> first_middle_last(const ExtractOptions& options, const Plan& plan) {
  std::vector<SeenFrame> frames;
  for (const std::size_t k : {std::size_t{0}, plan.inputs.size() / 2, plan.inputs.size() - 1})
    for (std::size_t back = 0; back <= std::min<std::size_t>(k, kLooks); ++back) try {
        const std::string& path = plan.inputs[k - back];
        if (std::ranges::count(frames, path, &SeenFrame::path) > 0) break;
        auto particles = open_particles(path, reading_of(options));
        if (survey_of(*particles).finite == 0) continue;
        frames.push_back({path, std::move(particles)});
        break;
      } catch (const InputError&) {  // is said when it is the frame's turn
      }
  return frames;
}

// A camera that frames the first, the middle and the last frame, and `particles` of the file
// `path`, or the one of --eye.
std::unique_ptr<CameraTrack> aim_at_sequence(const Plan& plan, const ExtractOptions& options,
                                             const ParticleSource& particles,
                                             const std::string& path, bool whole, const Talk& say) {
  std::string names = path;
  std::vector<SeenFrame> others;
  std::vector<const ParticleSource*> seen{&particles};
  if (!options.eye) others = first_middle_last(options, plan);
  for (const SeenFrame& frame : others) {
    if (frame.path == path) continue;
    seen.push_back(frame.particles.get());
    names += ", " + frame.path;
  }
  const auto [camera, origin] = aimed_camera(options, seen);
  keep_camera(options, camera);
  if (!whole && !options.eye && options.written_camera.empty())
    warn("the camera was chosen from the frames that are there now (" + names +
         "): keep it with --write-camera FILE and give it to the other parts with --camera FILE");
  say("camera", origin + (options.eye ? "" : " of " + names) + ", " + std::to_string(camera.width) +
                    "x" + std::to_string(camera.height));
  return std::make_unique<CameraTrack>(camera);
}

// The particle radius of all files that state none, told from those of the file `path`.
void settle_radius(const ExtractOptions& options, const ParticleSource& particles,
                   const std::string& path, BatchSettings& settings) {
  if (particles.particle_radius() > 0 || (particles.has_radius() && particles.in_memory())) {
    settings.others_file = path;
    settings.others_radius =
        particles.has_radius() ? survey_of(particles).middle_radius : particles.particle_radius();
  } else if (!particles.has_radius()) {
    Notices notices;
    settings.parameters.particle_radius =
        naming(path, [&] { return choose_radius(particles, options.parameters, notices); });
    for (const Notice& notice : notices.all()) warn(path + ", for all frames: " + words_of(notice));
  }
}

}  // namespace

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

std::unique_ptr<CameraTrack> settle_for_all(const Plan& plan, const ExtractOptions& options,
                                            std::unique_ptr<CameraTrack> cameras, bool whole,
                                            BatchSettings& settings, const Talk& say) {
  if (cameras && !options.closed)
    say("camera", options.camera_file + (cameras->moves() ? ", one for each frame" : ""));
  if (cameras && options.particle_radius) return cameras;
  std::string path;
  const auto particles = telling_frame(options, plan, path);
  if (!cameras) cameras = aim_at_sequence(plan, options, *particles, path, whole, say);
  if (!options.particle_radius) settle_radius(options, *particles, path, settings);
  return cameras;
}

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
  const Crew wanted{devices * settings.in_flight, settings.writers};
  const Crew crew = crew_within(wanted, pixels, room);
  const auto megabytes = [](std::size_t bytes) { return grouped(bytes >> 20) + " MB"; };
  const std::string left = "the limit on memory leaves " + megabytes(room);
  if (crew.extracting < devices)
    throw Error(left + " and frames of " + grouped(pixels) + " pixels take about " +
                megabytes(room_for({devices, 1}, pixels)) +
                " (raise ulimit -v, or use fewer devices or a smaller image)");
  if (crew == wanted) return;
  settings.in_flight = crew.extracting / devices;
  settings.writers = crew.writing;
  warn(left + ": " + counted(static_cast<std::size_t>(crew.extracting), "frame") +
       " in flight instead of " + std::to_string(wanted.extracting) + ", and " +
       std::to_string(crew.writing) + " written at once instead of " +
       std::to_string(wanted.writing));
}

}  // namespace meniscus::cli
