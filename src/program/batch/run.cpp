// Threads that read, extract and write frames, with queues between them. A frame goes through
// read(), extract_one() and write_outputs(); what happens to it is in its record.
#include "program/batch/run.hpp"

#include <tbb/concurrent_queue.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <future>
#include <memory>
#include <mutex>
#include <new>
#include <shared_mutex>
#include <thread>
#include <utility>

#include "api/extract_sparingly.hpp"
#include "base/content_hash.hpp"
#include "base/elapsed.hpp"
#include "base/printed.hpp"
#include "device/device.hpp"
#include "program/batch/job.hpp"
#include "program/wording.hpp"

namespace meniscus {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double seconds_since_1970() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

// A frame on its way through the batch.
struct Frame {
  const FrameJob* job = nullptr;
  FrameRecord record;
  std::string seal;  // the job that its outputs carry
  Camera camera, next_camera;
  Parameters parameters;
  std::unique_ptr<ParticleSource> particles;
  Whitewater whitewater;
  Surface surface;
};

// A thread's device.
struct Worker {
  Device device;
  std::size_t which = 0;  // of the batch's devices
  int failures = 0;       // frames in a row that it could not do
};

// A device that fails so many frames in a row gets no more.
constexpr int kPatience = 3;

// Frames waiting for the next step. The end is a null pointer for each thread that waits. The
// steps block on files and devices, so that they are threads and no tasks of oneTBB's, whose own
// threads would be held up.
using Queue = tbb::concurrent_bounded_queue<std::unique_ptr<Frame>>;

std::optional<double> mean_residual(const Surface& surface) {
  double sum = 0;
  std::size_t count = 0;
  for (const float residual : surface.residual)
    if (residual > 0) {
      sum += residual;
      ++count;
    }
  if (count == 0) return std::nullopt;
  return sum / static_cast<double>(count);
}

class Batch {
 public:
  Batch(const std::vector<FrameJob>& jobs, const CameraTrack& cameras,
        const BatchSettings& settings, const std::atomic<int>& stop,
        const std::function<void(const FrameRecord&)>& finished)
      : jobs_(jobs), cameras_(cameras), settings_(settings), stop_(stop), finished_(finished) {}

  BatchOutcome run() {
    open_devices();
    run_threads();
    if (failure_) std::rethrow_exception(failure_);
    return outcome_;
  }

 private:
  // PoCL and drivers take their time to open a device, so all open at once.
  void open_devices() {
    const int in_flight = static_cast<int>(std::min(static_cast<std::size_t>(settings_.in_flight),
                                                    std::max<std::size_t>(1, jobs_.size())));
    std::vector<std::future<Worker>> opening;
    for (std::size_t which = 0; which < settings_.devices.size(); ++which)
      for (DeviceInfo& part : divided(settings_.devices[which], in_flight))
        opening.push_back(std::async(std::launch::async, [part = std::move(part), which] {
          return Worker{Device(part), which};
        }));
    for (std::future<Worker>& worker : opening) workers_.push_back(worker.get());
    for (Worker& worker : workers_) worker.device.state().on_building = settings_.on_building;
  }

  // Reads, extracts and writes all frames. The last thread of a step tells those of the next one
  // that there is no more to come.
  void run_threads() {
    const std::size_t writers = static_cast<std::size_t>(settings_.writers);
    readers_ = writers;  // reading is cheap, but checking outputs that may be whole is not
    extractors_ = workers_.size();
    read_.set_capacity(static_cast<std::ptrdiff_t>(workers_.size()));
    extracted_.set_capacity(static_cast<std::ptrdiff_t>(writers));
    std::vector<std::jthread> threads;
    for (std::size_t k = 0; k < writers; ++k) {
      threads.emplace_back([&] {
        read_all();
        if (--readers_ == 0)
          for (std::size_t i = 0; i < workers_.size(); ++i) read_.push(nullptr);
      });
      threads.emplace_back([&] { write_all(); });
    }
    for (Worker& worker : workers_)
      threads.emplace_back([&, writers] {
        extract_all(worker);
        if (--extractors_ == 0)
          for (std::size_t i = 0; i < writers; ++i) extracted_.push(nullptr);
      });
  }

  void read_all() {
    for (std::size_t k; !halted_ && stop_ == 0 && (k = next_++) < jobs_.size();) {
      auto frame = std::make_unique<Frame>();
      frame->job = &jobs_[k];
      FrameRecord& record = frame->record;
      record.frame = frame->job->frame;
      record.input = frame->job->input;
      record.outputs = frame->job->outputs;
      record.version = version();
      record.method = to_string(settings_.parameters.method);
      record.host = settings_.host;
      record.shard = settings_.shard;
      record.start = seconds_since_1970();
      if (!attempt(*frame, record.read_ms, [&] { read(*frame); })) continue;
      if (record.status == FrameStatus::skipped)
        over(record);
      else
        read_.push(std::move(frame));
    }
  }

  void read(Frame& frame) {
    frame.camera = cameras_.at(frame.job->frame);
    frame.next_camera = cameras_.after(frame.job->frame);
    frame.seal = job_of(*frame.job, frame.camera, frame.next_camera, settings_);
    if (settings_.resume && look_at_outputs(frame)) {
      frame.record.status = FrameStatus::skipped;
      return;
    }
    ReadOptions reading = settings_.reading;
    reading.particle_radius = settings_.particle_radius;
    frame.particles = open_particles(frame.job->input, reading);
    frame.record.velocities = frame.particles->has_velocity();
    frame.parameters = settings_.parameters;
    take_radius_of_others(frame);
    if (settings_.parameters.image)
      frame.whitewater = Whitewater(frame.job->whitewater, settings_.parameters.whitewater.radius);
  }

  // A drop that states no radius is as large as the particles of the other frames.
  void take_radius_of_others(Frame& frame) const {
    const ParticleSource& particles = *frame.particles;
    if (!(settings_.others_radius > 0) || frame.parameters.particle_radius > 0 ||
        particles.has_radius() || particles.particle_radius() > 0)
      return;
    frame.parameters.particle_radius = settings_.others_radius;
    if (particles.size() > 0)
      frame.record.warnings.push_back(
          printed("no particle radius in the file: %.6g of ", settings_.others_radius) +
          settings_.others_file + " is used");
  }

  // Whether all outputs are there, complete and of the same job. If some are there and one is not
  // so, the frame's record says what is wrong with it.
  static bool look_at_outputs(Frame& frame) {
    const std::vector<std::string>& outputs = frame.job->outputs;
    for (const std::string& path : outputs) {
      const std::string flaw = flaw_in_detail(path, frame.seal);
      if (flaw.empty()) continue;
      std::error_code ignored;
      if (std::any_of(outputs.begin(), outputs.end(),
                      [&](const std::string& other) { return fs::exists(other, ignored); }))
        frame.record.again = path + " " + flaw;
      return false;
    }
    return true;
  }

  void extract_all(Worker& worker) {
    for (std::unique_ptr<Frame> frame; read_.pop(frame), frame;) {
      if (halted_ || stop_ != 0) continue;  // not begun, so that --resume does it
      FrameRecord& record = frame->record;
      if (attempt(*frame, record.extract_ms, [&] { extract_one(worker, *frame); }))
        extracted_.push(std::move(frame));
    }
  }

  void extract_one(Worker& worker, Frame& frame) {
    std::vector<StageTime> stages;
    frame.surface = extract_somehow(worker, frame, stages);
    frame.particles.reset();
    frame.whitewater = {};
    if (!frame.surface.velocity.empty())
      frame.surface.forward =
          screen_motion(frame.surface, frame.next_camera, settings_.frames_per_second);
    FrameRecord& record = frame.record;
    for (const StageTime& stage : stages) {  // of which some run several times
      const auto same = [&](const auto& entry) { return entry.first == stage.stage; };
      auto sum = std::find_if(record.stages.begin(), record.stages.end(), same);
      if (sum == record.stages.end()) sum = record.stages.insert(sum, {stage.stage, 0.0});
      sum->second += stage.host_ms;
    }
    record.counts = named(frame.surface.counts);
    const Mesh& mesh = frame.surface.mesh;
    if (settings_.parameters.mesh || settings_.closed) {
      record.counts.emplace_back("mesh vertices", mesh.position.size());
      record.counts.emplace_back("mesh triangles", mesh.triangle.size());
    }
    if (!settings_.closed)
      record.size = std::to_string(frame.camera.width) + "x" + std::to_string(frame.camera.height);
    record.radius = frame.surface.particle_radius;
    for (const Notice& notice : frame.surface.notices) record.warnings.push_back(words_of(notice));
    record.residual = mean_residual(frame.surface);
    record.disorder = frame.surface.disorder;
    record.hash = hex_digits(content_hash(frame.surface));
  }

  // The surface of a frame, made on a device; after it had no memory, with as little as can be.
  Surface extract_on(Device& device, Frame& frame, std::vector<StageTime>& stages,
                     const OutOfDeviceMemory* no_memory = nullptr) const {
    stages.clear();  // of an attempt before
    std::vector<StageTime>* const times = settings_.stage_times ? &stages : nullptr;
    frame.record.device = device.info().name;
    if (settings_.on_warning)
      device.on_notice([this, job = frame.job](const Notice& notice) {
        settings_.on_warning(*job, words_of(notice));
      });
    Surface surface = naming(frame.job->input, [&] {
      if (settings_.closed)
        return extract_closed(device, *frame.particles, *settings_.closed, frame.parameters, times);
      if (no_memory)
        return extract_sparingly(device, *frame.particles, frame.camera, frame.parameters, times,
                                 settings_.memory, *no_memory);
      return extract(device, *frame.particles, frame.camera, frame.parameters, times,
                     settings_.memory);
    });
    if (!frame.whitewater.empty())
      draw_whitewater(device, frame.whitewater.sources(), frame.parameters, surface, times,
                      settings_.memory);
    return surface;
  }

  // While other threads extract frames, too.
  Surface try_beside_others(Worker& worker, Frame& frame, std::vector<StageTime>& stages) {
    { const std::lock_guard turn(gate_); }  // behind one that wants to be alone
    const std::shared_lock with_others(extracting_);
    Surface surface = extract_on(worker.device, frame, stages);
    worker.failures = 0;
    return surface;
  }

  // With all memory that the other threads can spare.
  Surface try_sparingly(Worker& worker, Frame& frame, std::vector<StageTime>& stages,
                        const OutOfDeviceMemory& no_memory) {
    for (Worker& other : workers_) other.device.state().pool->drop_idle();
    Surface surface = extract_on(worker.device, frame, stages, &no_memory);
    worker.failures = 0;
    return surface;
  }

  // On the next device, which the thread keeps where its own has failed too often.
  Surface try_elsewhere(Worker& worker, Frame& frame, std::vector<StageTime>& stages,
                        const std::string& failure) {
    if (settings_.devices.size() == 1) throw DeviceError(failure);
    ++worker.failures;
    const std::size_t which = (worker.which + 1) % settings_.devices.size();
    std::optional<Worker> other;
    Surface surface;
    try {
      other = Worker{Device(settings_.devices[which]), which};
      surface = extract_on(other->device, frame, stages);
    } catch (const DeviceError& error) {
      throw DeviceError(failure + "; then " + words_of(error));
    }
    surface.notices.push_back({.text = "extracted on another device after: " + failure});
    if (worker.failures >= kPatience) {
      surface.notices.push_back({.text = "a device that failed " + std::to_string(worker.failures) +
                                         " frames in a row gets no more: \"" +
                                         worker.device.info().name + '"'});
      worker = std::move(*other);
    }
    return surface;
  }

  // What did not work is tried again while all other threads wait: where memory ran out with as
  // little of it as can be, and then, or where the device failed, on another one.
  Surface extract_somehow(Worker& worker, Frame& frame, std::vector<StageTime>& stages) {
    std::optional<OutOfDeviceMemory> no_memory;
    std::string failure;
    try {
      return try_beside_others(worker, frame, stages);
    } catch (const OutOfDeviceMemory& error) {
      no_memory = error;
    } catch (const DeviceError& error) {
      failure = words_of(error);
    }
    const std::lock_guard turn(gate_);
    const std::unique_lock alone(extracting_);
    if (no_memory) {
      try {
        return try_sparingly(worker, frame, stages, *no_memory);
      } catch (const DeviceError& error) {
        failure = words_of(error);
      }
    }
    return try_elsewhere(worker, frame, stages, failure);
  }

  void write_all() {
    for (std::unique_ptr<Frame> frame; extracted_.pop(frame), frame;) {
      if (halted_) continue;
      FrameRecord& record = frame->record;
      WriteOptions options = settings_.writing;
      options.job = frame->seal;
      if (attempt(*frame, record.write_ms, [&] {
            record.bytes =
                write_outputs(frame->job->outputs, frame->surface, frame->parameters, options);
          }))
        over(record);
    }
  }

  // Runs one step of a frame. Returns whether it went well; else the frame is over.
  template <class Step>
  bool attempt(Frame& frame, double& ms, const Step& step) {
    const auto begin = Clock::now();
    FrameRecord& record = frame.record;
    try {
      step();
      ms = milliseconds_since(begin);
      return true;
    } catch (const OutputError& error) {  // the next would meet the same disk
      const std::scoped_lock lock(one_at_a_time_);
      break_off(error);
      return false;
    } catch (const std::bad_alloc&) {
      record.error =
          frame.job->input + ": out of memory: lower --in-flight, or use a smaller image";
    } catch (const std::exception& error) {
      record.error = words_of(error);
    }
    ms = milliseconds_since(begin);
    record.status = FrameStatus::failed;
    over(record);
    return false;
  }

  // Under the lock.
  void break_off(const OutputError& error) {
    if (outcome_.broken.empty()) outcome_.broken = words_of(error);
    halted_ = true;
  }

  void over(FrameRecord& record) {
    record.end = seconds_since_1970();
    const std::scoped_lock lock(one_at_a_time_);
    ++(record.status == FrameStatus::done     ? outcome_.done
       : record.status == FrameStatus::failed ? outcome_.failed
                                              : outcome_.skipped);
    if (settings_.fail_fast && record.status == FrameStatus::failed) halted_ = true;
    try {
      finished_(record);
    } catch (const OutputError& error) {  // the log's
      break_off(error);
    } catch (...) {
      failure_ = std::current_exception();
      halted_ = true;
    }
  }

  const std::vector<FrameJob>& jobs_;
  const CameraTrack& cameras_;
  const BatchSettings& settings_;
  const std::atomic<int>& stop_;
  const std::function<void(const FrameRecord&)>& finished_;

  Queue read_, extracted_;
  std::atomic<std::size_t> next_{0}, readers_{0}, extractors_{0};
  std::atomic<bool> halted_{false};  // by an error: frames under way are dropped
  std::vector<Worker> workers_;
  std::mutex gate_;               // passed by each frame before `extracting_`
  std::shared_mutex extracting_;  // by one frame alone when it is extracted again
  std::mutex one_at_a_time_;
  BatchOutcome outcome_;
  std::exception_ptr failure_;
};

}  // namespace

BatchOutcome run_batch(const std::vector<FrameJob>& jobs, const CameraTrack& cameras,
                       const BatchSettings& settings, const std::atomic<int>& stop,
                       const std::function<void(const FrameRecord&)>& finished) {
  require(!settings.devices.empty() && settings.in_flight > 0 && settings.writers > 0,
          "run_batch: wants at least one device, frame in flight and writer");
  return Batch(jobs, cameras, settings, stop, finished).run();
}

}  // namespace meniscus
