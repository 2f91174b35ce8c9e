// A device that is opened, and what is launched on it. Its programs and its memory have rooms of
// their own: device_programs.cpp, device_memory.cpp.
#include "device/device.hpp"

#include <algorithm>
#include <chrono>

#include "base/elapsed.hpp"
#include "base/rounded_up.hpp"
#include "device/building.hpp"
#include "device/opencl_error.hpp"
#include "device/shared_context.hpp"
#include "device/tuning.hpp"

namespace meniscus {
namespace {

// A range whose work-groups have at most `most` items. The sides of groups are powers of two.
Range with_groups_of(Range range, std::size_t most) {
  while (range.group_x * range.group_y > std::max<std::size_t>(1, most))
    (range.group_y > 1 ? range.group_y : range.group_x) /= 2;
  return range;
}

}  // namespace

void Device::on_stage(std::function<void(const std::string&)> call) {
  state_->on_stage = std::move(call);
}

void Device::on_notice(std::function<void(const Notice&)> call) {
  state_->on_notice = std::move(call);
}

void Device::State::tell(const Notice& notice) {
  if (!on_notice || std::find(told.begin(), told.end(), notice.text) != told.end()) return;
  told.push_back(notice.text);
  on_notice(notice);
}

std::string Device::State::place() const {
  std::string text = " on \"";
  text += info.name + "\"";
  if (!stage.empty()) text += " in stage " + stage;
  return text;
}

void Device::State::fail(const std::string& doing, const cl::Error& error) const {
  const std::string what = doing + place() + ": " + describe(error);
  if (is_out_of_memory(error.err()))
    throw OutOfDeviceMemory(what + ": out of memory (use a smaller image, a smaller " +
                            setting("memory") + ", or another " + setting("device") + ")");
  forget_shared_context(handle_of(info));
  throw DeviceError(what + " (try another " + setting("device") + "; meniscus devices lists them)");
}

void Device::State::keep_context() {
  if (context_is_kept_) return;
  context_is_kept_ = clRetainContext(context()) == CL_SUCCESS;
}

Device::State::~State() {
  if (!queue()) return;
  // What is enqueued reads memory that goes away now. Errors have been reported by now.
  clFinish(queue());
}

void Device::State::tell_guard(const std::string& name, const char* doing) {
  if (guard) guard->begins(name, doing, observer || guard->waits());
}

void Device::State::tell_guard_over() {
  if (guard && (observer || guard->waits())) guard->ended();
}

void Device::State::check_unmapped() {
  if (unmap_error_) throw *std::exchange(unmap_error_, std::nullopt);
}

Range Device::State::launched_range(const Range& wanted, std::size_t most) const {
  Range tuned = wanted;
  if (wanted.ny == 1 && wanted.group_x == kRowGroup) tuned.group_x = row_group;
  Range range = with_groups_of(tuned, most);
  range.nx = rounded_up(range.nx, range.group_x);
  range.ny = rounded_up(range.ny, range.group_y);
  return range;
}

void Device::State::enqueue(BuiltKernel& kernel, const Range& wanted) {
  if (wanted.nx == 0 || wanted.ny == 0) return;
  const std::string& name = kernel.name;
  send_uploads();
  const bool builds = std::exchange(kernel.compiles, false);
  const auto begin = std::chrono::steady_clock::now();
  cl::Event event;
  try {
    check_unmapped();
    const Range range = launched_range(wanted, kernel.most_items);
    const bool plane = range.ny > 1;
    const cl::NDRange global = plane ? cl::NDRange(range.nx, range.ny) : cl::NDRange(range.nx);
    const cl::NDRange local =
        plane ? cl::NDRange(range.group_x, range.group_y) : cl::NDRange(range.group_x);
    tell_guard(name, "running");
    queue.enqueueNDRangeKernel(kernel.kernel, cl::NullRange, global, local, nullptr,
                               timed ? &event : nullptr);
    ++counts.launches;
    if (timed) events.emplace_back(name, std::move(event));
    if (guard && guard->waits() && !observer) {
      finish();
      guard->ended();
    }
    if (builds) {
      queue.finish();
      building_ms_ += milliseconds_since(begin);
    }
  } catch (const cl::Error& error) {
    fail("launching " + name, error);
  }
}

void Device::State::flush() {
  send_uploads();
  try {
    queue.flush();
  } catch (const cl::Error& error) {
    fail("flushing the queue", error);
  }
}

void Device::State::finish() {
  send_uploads();
  queue.finish();
  if (staging) staging->waited();
  ++counts.waits;
}

std::vector<std::pair<std::string, double>> Device::State::take_times() {
  std::vector<std::pair<std::string, double>> times;
  try {
    check_unmapped();
    finish();
    for (const auto& [name, event] : events) {
      const auto begin = event.getProfilingInfo<CL_PROFILING_COMMAND_START>();
      const auto end = event.getProfilingInfo<CL_PROFILING_COMMAND_END>();
      times.emplace_back(name, 1e-6 * static_cast<double>(end - begin));
    }
  } catch (const cl::Error& error) {
    fail("waiting for the kernels", error);
  }
  events.clear();
  return times;
}

void Device::State::time_kernels(bool on) {
  if (on == timed) return;
  try {
    check_unmapped();
    finish();
    if (!other_queue_())
      other_queue_ = cl::CommandQueue(context, handle_of(info), on ? CL_QUEUE_PROFILING_ENABLE : 0);
  } catch (const cl::Error& error) {
    fail("waiting for the kernels", error);
  }
  events.clear();
  std::swap(queue, other_queue_);
  timed = on;
}

Device::Device(const std::string& selector) : Device(select_device(selector)) {}

Device::Device(const DeviceInfo& info) : state_(std::make_unique<State>()) {
  state_->info = info;
  check_not_forked();
  try {
    if (info.kind == DeviceKind::cpu) {
      state_->context = cl::Context(handle_of(info));
    } else {
      state_->shared_context = shared_context(handle_of(info));
      state_->context = *state_->shared_context;
    }
    state_->queue = cl::CommandQueue(state_->context, handle_of(info), CL_QUEUE_PROFILING_ENABLE);
    state_->wide = info.kind == DeviceKind::cpu &&
                   handle_of(info).getInfo<CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT>() >= 16;
    if (info.kind != DeviceKind::cpu) state_->staging = std::make_unique<Staging>(state_->context);
    // An error that the work left behind is met again by the next command.
    const auto wait = [state = state_.get()] { clFinish(state->queue()); };
    state_->pool = std::make_unique<MemoryPool>(state_->context, state_->memory,
                                                info.largest_buffer, state_->is_in_place(), wait);
  } catch (const cl::Error& error) {
    state_->fail("opening the device", error);
  }
  state_->keeps = kept_of(info);
  state_->compiles_at_launch = compiles_at_launch(info);
  const Tuning tuning = tuning_of(info);
  state_->vector_width = tuning.vector_width;
  state_->row_group = tuning.group;
  state_->discs = tuning.discs;
}

Device::~Device() = default;
Device::Device(Device&&) noexcept = default;
Device& Device::operator=(Device&&) noexcept = default;
const DeviceInfo& Device::info() const { return state_->info; }

}  // namespace meniscus
