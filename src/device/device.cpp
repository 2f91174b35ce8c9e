#include "device/device.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include "base/content_hash.hpp"
#include "base/elapsed.hpp"
#include "device/building.hpp"
#include "device/installation.hpp"
#include "device/kernel_sources.hpp"
#include "device/kernels.hpp"
#include "device/opencl_error.hpp"
#include "device/program_cache.hpp"
#include "device/shared_context.hpp"
#include "device/tuning.hpp"

namespace meniscus {
namespace {

// No relaxed maths: the same bits on every device, and INFINITY means "no surface". Division and
// square root are exact on CPUs and where a GPU is asked for it.
std::string compiler_options(const DeviceInfo& info) {
  std::string options = "-cl-std=CL1.2 ";
  if (handle_of(info).getInfo<CL_DEVICE_SINGLE_FP_CONFIG>() & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT)
    options += "-cl-fp32-correctly-rounded-divide-sqrt ";
  // It computes what its optimizer makes of negated lanes wrongly (docs/portability.md).
  if (info.platform == "Oclgrind") options += "-cl-opt-disable ";
  return options;
}

// Vector loads may reach past the last value by up to one vector of sixteen.
constexpr std::size_t kPadding = 64 * 16;

// From this many bytes on all processors of a CPU fill: PoCL's command is left to one.
constexpr std::size_t kManyToFill = std::size_t{1} << 18;

const KernelSource& embedded(const std::string& file) {
  for (const KernelSource& source : kernel_sources())
    if (source.file == file) return source;
  throw DeviceError(file + " is not among the embedded kernels");
}

constexpr const char* kPocl = "Portable Computing Language";

// Files of one frame that are built as one program where a runtime reads its own headers, which
// takes 20 ms of a processor, for each program at every start: PoCL, which looks for it in its
// cache by the preprocessed text. Their names do not collide.
constexpr std::array<std::string_view, 2> kTogether{
    "visible.cl bins.cl region.cl interpolate.cl behind.cl specks.cl",
    "density.cl particle_fit.cl roundness.cl fairing.cl choose_groups.cl"};

// Binaries where the platform has no cache of its own. PoCL would compile every kernel a second
// time to give a binary away, for groups of any size, which it does not launch. Nothing where
// kernels are run to be looked at.
Keeps kept_of(const DeviceInfo& info) {
  if (info.platform == "Oclgrind") return Keeps::nothing;
  constexpr std::array kOwnCache{kPocl, "rusticl", "NVIDIA CUDA"};
  const bool own = std::find(kOwnCache.begin(), kOwnCache.end(), info.platform) != kOwnCache.end();
  return own ? Keeps::notes : Keeps::binaries;
}

constexpr const char* kNote = "the runtime's own cache has it";

// All that a built program depends on.
std::string description_of(const DeviceInfo& info, const std::string& source,
                           const std::string& options) {
  std::string text = identity_of(info);
  for (const std::string& part :
       {options, hex_digits(content_hash(source)), std::to_string(source.size())})
    text += part + "\n";
  if (const char* mode = std::getenv(kIntelVectorizer)) text += mode;
  return text;
}

// Empty: the driver does not give it away.
std::string binary_of(const cl::Program& program) {
  std::size_t size = 0;
  if (clGetProgramInfo(program(), CL_PROGRAM_BINARY_SIZES, sizeof size, &size, nullptr) !=
      CL_SUCCESS)
    return "";
  std::string binary(size, '\0');
  auto* bytes = reinterpret_cast<unsigned char*>(binary.data());
  return clGetProgramInfo(program(), CL_PROGRAM_BINARIES, sizeof bytes, &bytes, nullptr) ==
                 CL_SUCCESS
             ? binary
             : "";
}

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

void DeviceMemory::add(std::uint64_t bytes) {
  const std::uint64_t now = now_ += bytes;
  std::uint64_t peak = peak_;
  while (now > peak && !peak_.compare_exchange_weak(peak, now)) {
  }
}

std::string width_option(int width) { return "-D WIDTH=" + std::to_string(width); }

// A program from a binary that this driver made before; none where it refuses that.
cl::Program Device::State::build_kept(const std::string& binary, const std::string& options) {
  const std::size_t size = binary.size();
  const auto* bytes = reinterpret_cast<const unsigned char*>(binary.data());
  cl_int status = CL_SUCCESS, error = CL_SUCCESS;
  cl::Program program(
      clCreateProgramWithBinary(context(), 1, &handle_of(info)(), &size, &bytes, &status, &error));
  if (error != CL_SUCCESS || status != CL_SUCCESS) return {};
  if (clBuildProgram(program(), 1, &handle_of(info)(), options.c_str(), nullptr, nullptr) ==
      CL_SUCCESS)
    return program;
  keep_context();
  return {};
}

cl::Program Device::State::build(const std::string& file, const std::string& source,
                                 const std::string& more_options) {
  std::string log;
  try {
    const std::string options = build_options(more_options);
    const bool keeps_it = keeps != Keeps::nothing && !kernel_text;
    const std::string key = keeps_it ? description_of(info, source, options) : "";
    std::string kept = keeps_it ? find_program(key) : "";
    if (kept.empty() || was_built_here(key)) {
      new_programs_.insert(built_with(file) + " " + more_options);
      if (on_building) on_building(++anew_);
    }
    std::optional<BuildTurn> turn;
    if (keeps_it && kept.empty()) {
      turn.emplace(key);
      kept = find_program(key);  // of another thread
    }
    if (keeps == Keeps::binaries && !kept.empty()) {
      if (cl::Program program = build_kept(kept, options); program()) return program;
      drop_program(key);
    }
    cl::Program program(context, source);
    const cl_int error =
        clBuildProgram(program(), 1, &handle_of(info)(), options.c_str(), nullptr, nullptr);
    if (error == CL_SUCCESS) {
      if (keeps_it && (keeps == Keeps::binaries || kept.empty()))
        keep_program(key, keeps == Keeps::binaries ? binary_of(program) : kNote);
      if (turn) turn->built();
      return program;
    }
    keep_context();
    if (error == CL_BUILD_PROGRAM_FAILURE) log = build_log(program, handle_of(info));
    if (log.empty()) throw cl::Error(error, "clBuildProgram");
  } catch (const cl::Error& error) {
    fail("building " + file, error);
  }
  throw DeviceError(file + " did not build" + place() + ": " + first_error(log));
}

bool Device::State::is_kept(const std::string& file, const std::string& options) const {
  return keeps != Keeps::nothing &&
         !find_program(description_of(info, source_of(built_with(file)), build_options(options)))
              .empty();
}

cl::Program& Device::State::program(const std::string& file, const std::string& options) {
  const std::string files = built_with(file);
  const std::string key = files + " " + options;
  const auto found = programs.find(key);
  if (found != programs.end()) return found->second;
  return programs.emplace(key, build(file, source_of(files), options)).first->second;
}

std::string Device::State::built_with(const std::string& file) const {
  if (info.platform == kPocl && !kernel_text)
    for (const std::string_view files : kTogether)
      if ((" " + std::string(files)).find(" " + file) != std::string::npos)
        return std::string(files);
  return file;
}

std::string Device::State::source_of(const std::string& files) const {
  std::vector<std::string> parts{"records.h", "nouns.h", "prelude.cl"};
  const auto add = [&](const std::string& part) {
    if (std::find(parts.begin(), parts.end(), part) == parts.end()) parts.push_back(part);
  };
  std::istringstream each(files);
  for (std::string file; each >> file; add(file)) {
    std::istringstream used{std::string(embedded(file).uses)};
    for (std::string part; used >> part;) add(part);
  }
  std::string source;
  for (const std::string& part : parts) {
    const std::string text(embedded(part).text);
    source += "\n#line 1 \"" + part + "\"\n" + (kernel_text ? kernel_text(part, text) : text);
  }
  return source;
}

std::string Device::State::build_options(const std::string& options) const {
  return compiler_options(info) + options;
}

void Device::State::tell_guard(const std::string& name, const char* doing) {
  if (guard) guard->begins(name, doing, observer || guard->waits());
}

void Device::State::tell_guard_over() {
  if (guard && (observer || guard->waits())) guard->ended();
}

BuiltKernel& Device::State::kernel(const std::string& file, const std::string& name,
                                   const std::string& options) {
  const std::string program_key = built_with(file) + " " + options;
  const std::string key = file + " " + options + " " + name;
  if (const auto found = kernels.find(key); found != kernels.end()) return found->second;

  const auto begin = std::chrono::steady_clock::now();
  tell_guard(name, "building");
  cl::Program& built = program(file, options);
  try {
    BuiltKernel made{cl::Kernel(built, name.c_str()), file, name, options};
    made.arguments = made.kernel.getInfo<CL_KERNEL_NUM_ARGS>();
    made.most_items = made.kernel.getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(handle_of(info));
    made.compiles = compiles_at_launch && new_programs_.contains(program_key);
    tell_guard_over();
    building_ms_ += milliseconds_since(begin);
    return kernels.emplace(key, std::move(made)).first->second;
  } catch (const cl::Error& error) {
    keep_context();
    fail("creating kernel " + name, error);
  }
}

BuiltKernel& Device::State::kernel(const char* file, const char* name, int number, int width) {
  constexpr std::size_t kWidths = 5;  // powers of two up to 16
  const std::size_t place =
      kWidths * static_cast<std::size_t>(number) +
      static_cast<std::size_t>(std::countr_zero(static_cast<unsigned>(width)));
  if (place >= of_handles_.size()) of_handles_.resize(place + 1, nullptr);
  if (!of_handles_[place]) of_handles_[place] = &kernel(file, name, width_option(width));
  return *of_handles_[place];
}

void Device::State::forget_programs() {
  of_handles_.clear();
  kernels.clear();
  programs.clear();
}

void Device::State::check_unmapped() {
  if (unmap_error_) throw *std::exchange(unmap_error_, std::nullopt);
}

Range Device::State::launched_range(const Range& wanted, std::size_t most) const {
  const auto rounded = [](std::size_t n, std::size_t group) {
    return (n + group - 1) / group * group;
  };
  Range tuned = wanted;
  if (wanted.ny == 1 && wanted.group_x == kRowGroup) tuned.group_x = row_group;
  Range range = with_groups_of(tuned, most);
  range.nx = rounded(range.nx, range.group_x);
  range.ny = rounded(range.ny, range.group_y);
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

std::size_t Device::State::most_bytes() const {
  return info.largest_buffer < 2 * kPadding ? 0 : (info.largest_buffer - kPadding) / 64 * 64;
}

std::size_t Device::State::padded(std::size_t bytes) const {
  if (bytes > most_bytes())
    throw OutOfDeviceMemory("a buffer of " + std::to_string(bytes) + " bytes is needed but \"" +
                            info.name + "\" allows " + std::to_string(most_bytes()) +
                            " (use a smaller image or another " + setting("device") + ")");
  return (bytes + 63) / 64 * 64 + kPadding;
}

std::size_t Device::State::part_bytes(std::size_t bytes) {
  // A multiple of what any device asks for where a part begins.
  return (bytes + kPadding - 1) / kPadding * kPadding + kPadding;
}

HostMemory Device::State::host_bytes(std::size_t bytes) {
  const std::size_t size = padded(bytes);
  try {
    if (is_in_place()) return pool->take_host(size);
    return staging->take(queue, (size + Uploads::kGrain - 1) / Uploads::kGrain * Uploads::kGrain);
  } catch (const cl::Error& error) {
    fail("waiting for uploads", error);
  }
}

Memory Device::State::done_bytes(HostMemory memory) {
  const std::size_t size = memory.size;
  try {
    if (!is_in_place() && memory.bytes.get_deleter().chunk) {
      Memory buffer = uploads_.add(*pool, info.largest_buffer, std::move(memory));
      if (uploads_.is_enough()) counts.uploads += uploads_.send(queue);
      return buffer;
    }
    ++counts.uploads;
    if (is_in_place()) return pool->share(std::move(memory));
    Memory buffer = pool->take(size);
    queue.enqueueWriteBuffer(buffer, CL_TRUE, 0, size, memory.bytes.get());
    return buffer;
  } catch (const cl::Error& error) {
    fail("uploading " + std::to_string(size) + " bytes", error);
  }
}

void Device::State::send_uploads() {
  try {
    counts.uploads += uploads_.send(queue);
  } catch (const cl::Error& error) {
    fail("uploading", error);
  }
}

Memory Device::State::allocate_bytes(std::size_t bytes, bool zeroed) {
  const std::size_t size = padded(bytes);
  try {
    Memory buffer = pool->take(size);
    if (observer || zeroed) enqueue_fill(buffer, cl_uint{0}, 0, size);
    return buffer;
  } catch (const cl::Error& error) {
    fail("allocating " + std::to_string(bytes) + " bytes", error);
  }
}

Memory Device::State::filled_bytes(const void* pattern, std::size_t pattern_bytes,
                                   std::size_t bytes) {
  const auto* values = static_cast<const unsigned char*>(pattern);
  const bool is_zero =
      std::all_of(values, values + pattern_bytes, [](unsigned char v) { return v == 0; });
  // Then what lies beyond is filled with it.
  if (is_zero && (!is_in_place() || bytes < kManyToFill)) return allocate_bytes(bytes, true);
  Memory buffer = allocate_bytes(bytes);
  if (bytes > 0) fill_new(buffer, pattern, pattern_bytes, bytes);
  return buffer;
}

Memory Device::State::constant_bytes(cl_uint pattern, std::size_t bytes) {
  // An observer may write to a launch's buffers, so that none is shared.
  if (observer) return filled_bytes(&pattern, sizeof pattern, bytes);
  Constant& kept = constants_[pattern];
  if (kept.bytes < bytes) kept = {filled_bytes(&pattern, sizeof pattern, bytes), bytes};
  return kept.memory;
}

void Device::State::write_bytes(Memory::Place to, const void* from, std::size_t bytes) {
  send_uploads();
  try {
    queue.enqueueWriteBuffer(to.buffer, CL_TRUE, to.origin, bytes, from);
    ++counts.uploads;
  } catch (const cl::Error& error) {
    fail("uploading " + std::to_string(bytes) + " bytes", error);
  }
}

void Device::State::read_bytes(Memory::Place from, void* to, std::size_t bytes) {
  send_uploads();
  try {
    queue.enqueueReadBuffer(from.buffer, CL_TRUE, from.origin, bytes, to);
    ++counts.reads;
    if (staging) staging->waited();
  } catch (const cl::Error& error) {
    fail("downloading " + std::to_string(bytes) + " bytes", error);
  }
}

HostMemory Device::State::copy_bytes(const Memory& from, std::size_t bytes) {
  HostMemory copy = host_bytes(bytes);
  read_bytes(from, copy.bytes.get(), bytes);
  return copy;
}

void* Device::State::map_bytes(const Memory& memory, std::size_t bytes) {
  send_uploads();
  try {
    ++counts.reads;
    return queue.enqueueMapBuffer(memory, CL_TRUE, CL_MAP_READ, 0, bytes);
  } catch (const cl::Error& error) {
    fail("mapping " + std::to_string(bytes) + " bytes", error);
  }
}

void Device::State::unmap(const Memory& memory, void* mapped) noexcept {
  try {
    queue.enqueueUnmapMemObject(static_cast<const cl::Buffer&>(memory), mapped);
  } catch (const cl::Error& error) {
    unmap_error_ = error;
  }
}

void Device::State::fill_bytes(const Memory& memory, const void* pattern, std::size_t pattern_bytes,
                               std::size_t bytes) {
  send_uploads();
  fill_new(memory, pattern, pattern_bytes, bytes);
}

void Device::State::fill_new(const Memory& memory, const void* pattern, std::size_t pattern_bytes,
                             std::size_t bytes) {
  if (pattern_bytes != 1 && pattern_bytes != 4)
    throw DeviceError("fill patterns are one or four bytes");
  try {
    if (!is_in_place()) {
      if (pattern_bytes == 4)
        enqueue_fill(memory, *static_cast<const cl_uint*>(pattern), 0, bytes);
      else
        enqueue_fill(memory, *static_cast<const cl_uchar*>(pattern), 0, bytes);
      return;
    }
    // Sixteen words at a time: PoCL stores a pattern at a time.
    cl_uint16 words;
    for (std::size_t k = 0; k < sizeof words; k += pattern_bytes)
      std::copy_n(static_cast<const char*>(pattern), pattern_bytes,
                  reinterpret_cast<char*>(&words) + k);
    const std::size_t number = bytes / sizeof words, whole = number * sizeof words;
    if (bytes >= kManyToFill) {
      BuiltKernel& fill_words =
          kernel(meniscus::kernels::fill_words.file, meniscus::kernels::fill_words.name,
                 meniscus::kernels::fill_words.number, 1);
      fill_words.kernel.setArg(0, static_cast<const cl::Buffer&>(memory));
      fill_words.kernel.setArg(1, words.s[0]);
      fill_words.kernel.setArg(2, static_cast<cl_int>(number));
      counts.arguments += 3;
      enqueue(fill_words, {number});
    } else if (whole > 0) {
      enqueue_fill(memory, words, 0, whole);
    }
    if (whole == bytes) return;
    if (pattern_bytes == 4)
      enqueue_fill(memory, words.s[0], whole, bytes - whole);
    else
      enqueue_fill(memory, static_cast<cl_uchar>(words.s[0] & 255), whole, bytes - whole);
  } catch (const cl::Error& error) {
    fail("filling " + std::to_string(bytes) + " bytes", error);
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
  state_->compiles_at_launch = info.platform == kPocl;
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
