// Buffers, launches and timings on an opened device. What stages use.
#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "device/kernel_handle.hpp"
#include "device/memory_pool.hpp"
#include "device/opencl.hpp"
#include "device/staging.hpp"
#include "device/tuning.hpp"
#include "device/uploads.hpp"
#include "meniscus/error.hpp"

namespace meniscus {

/// A device buffer of `size` values of T. Its allocation is rounded up, so that vector loads of the
/// last work-items stay inside; what lies there is anything, and no result depends on it.
template <class T>
struct Buffer {
  using Value = T;
  Memory memory;
  std::size_t size = 0;  // values
};

/// Groups of a row of so many work-items are what a launch asks for that leaves their size to the
/// device's tuning (tuning.hpp).
inline constexpr std::size_t kRowGroup = 64;

/// Work-items in up to two dimensions and the work-group they are cut into, whose sides are powers
/// of two; they are halved, the height first, until the device and the kernel allow the group. The
/// range is rounded up to whole work-groups.
struct Range {
  std::size_t nx = 1, ny = 1;
  std::size_t group_x = kRowGroup, group_y = 1;
};

/// A kernel's launch, as those who watch launches see it.
struct KernelLaunch {
  struct Argument {
    const cl::Buffer* buffer = nullptr;  // null: a scalar
    std::size_t bytes = 0;               // of the buffer's values
    bool floats = false;                 // the values are float, else integers
    const void* scalar = nullptr;        // its value, while the launch is seen
    std::size_t scalar_bytes = 0;
  };
  const std::string& file;
  const std::string& kernel;
  const std::string& options;  // as the stage gives them
  Range range;                 // as the stage asks for it
  std::vector<Argument> arguments;
};

/// A kernel that was built for a device, and what launches ask of it.
struct BuiltKernel {
  cl::Kernel kernel;
  std::string file, name, options;
  cl_uint arguments = 0;       // that it takes
  std::size_t most_items = 1;  // of a work-group
  bool compiles = false;       // when it is launched first
};

/// A launch that a guard does not allow.
struct KernelLeftOut : Error {
  explicit KernelLeftOut(const std::string& name)
      : Error(name + " is left out: it crashed or hung before") {}
};

/// Sees every launch on a device; what it is for is verify (verify/trace.hpp).
class LaunchObserver {
 public:
  virtual ~LaunchObserver() = default;
  virtual void before(const KernelLaunch& launch) = 0;
  virtual void after(const KernelLaunch& launch) = 0;
  /// In the place of after() where a guard did not allow the launch: nothing ran.
  virtual void left_out(const KernelLaunch& launch) { throw KernelLeftOut(launch.kernel); }
};

/// Is told what a device is about to do, which may crash or hang, so that somebody else can name it
/// (verify/devices.cpp).
class LaunchGuard {
 public:
  virtual ~LaunchGuard() = default;
  /// Asked once for each launch, before anything is built for it.
  virtual bool allows(const std::string& kernel) = 0;
  /// `doing` is "building" or "running". `alone`: nothing that began before is still under way.
  virtual void begins(const std::string& kernel, const char* doing, bool alone) = 0;
  /// What began last is over.
  virtual void ended() = 0;
  /// Whether launches are to be waited for, one by one.
  virtual bool waits() const = 0;
};

/// How much memory the buffers of a device take. Buffers tell it when they come and when the driver
/// lets go of them, from whichever thread that happens on.
class DeviceMemory {
 public:
  void add(std::uint64_t bytes);
  void remove(std::uint64_t bytes) { now_ -= bytes; }

  std::uint64_t now() const { return now_; }    // bytes
  std::uint64_t peak() const { return peak_; }  // bytes, the most at a time so far

 private:
  std::atomic<std::uint64_t> now_{0}, peak_{0};
};

/// What a device was asked for so far. Each command costs the host its time, on a GPU more than
/// most kernels take; each wait leaves the device idle until the host has gone on.
struct CommandCounts {
  std::int64_t launches = 0;   // kernels enqueued
  std::int64_t arguments = 0;  // arguments given to kernels
  std::int64_t fills = 0;      // of buffers
  std::int64_t uploads = 0;    // to buffers; on devices that share the host's memory, in place
  std::int64_t reads = 0;      // back to the host, each of which waits for all work before it
  std::int64_t waits = 0;      // for the device, with nothing to read

  CommandCounts since(const CommandCounts& before) const {
    return {launches - before.launches, arguments - before.arguments, fills - before.fills,
            uploads - before.uploads,   reads - before.reads,         waits - before.waits};
  }
};

/// What is kept on disk of a program that was built (program_cache.hpp): nothing; a note that the
/// runtime's own cache has it; or its binary.
enum class Keeps { nothing, notes, binaries };

/// What an opened device holds. Everything here throws DeviceError, naming call and device.
struct Device::State {
  DeviceInfo info;
  cl::Context context;
  std::shared_ptr<cl::Context> shared_context;  // the same, of a device that all share it on
  cl::CommandQueue queue;
  int vector_width = 1;  // work-items of loop-heavy kernels take this many pixels or groups
  bool wide = false;     // the device's own vectors have 16 floats
  std::size_t row_group = kRowGroup;  // work-items in groups where a launch leaves it open
  DiscForm discs = DiscForm::bins;
  std::shared_ptr<DeviceMemory> memory = std::make_shared<DeviceMemory>();
  std::unique_ptr<MemoryPool> pool;
  std::unique_ptr<Staging> staging;  // of devices with memory of their own

  std::map<std::string, cl::Program> programs;            // by files and options
  std::map<std::string, BuiltKernel> kernels;             // by file, kernel and options
  bool timed = true;                                      // whether launches leave events
  std::vector<std::pair<std::string, cl::Event>> events;  // since the last take_times()
  Keeps keeps = Keeps::nothing;
  /// Whether the runtime compiles a kernel when it is launched first, as PoCL does.
  bool compiles_at_launch = false;
  /// Is called before a program is built that no cache has, with how many there were, this one too.
  std::function<void(int programs)> on_building;
  std::string stage;                                       // named in error messages
  CommandCounts counts;                                    // since the device was opened
  std::function<void(const std::string& stage)> on_stage;  // called as each begins
  std::function<void(const Notice& notice)> on_notice;     // called as each becomes known
  std::vector<std::string> told;       // texts of what it was called with in this frame
  LaunchObserver* observer = nullptr;  // while there is one, new buffers hold zeros
  LaunchGuard* guard = nullptr;
  /// When set, what it makes of a kernel file's text is built instead: faults on purpose.
  std::function<std::string(const std::string& file, const std::string& text)> kernel_text;

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State();

  /// The program of this file and those that it uses, built unless it was before.
  cl::Program& program(const std::string& file, const std::string& options);
  /// Whether a cache on disk has the program, or a note of it.
  bool is_kept(const std::string& file, const std::string& options) const;
  BuiltKernel& kernel(const std::string& file, const std::string& name, const std::string& options);
  /// The same of a handle, `number` being its own: found without looking for names.
  BuiltKernel& kernel(const char* file, const char* name, int number, int width);
  /// Calls on_notice, unless it has told the same already.
  void tell(const Notice& notice);
  /// From now on no program is built.
  void forget_programs();
  void enqueue(BuiltKernel& kernel, const Range& range);
  /// What files, a blank between, are built from: the prelude, what they use, and `#line` between
  /// them.
  std::string source_of(const std::string& files) const;
  /// The files, a blank between, that are built as one program with `file`.
  std::string built_with(const std::string& file) const;
  /// All that the compiler is given where a stage gives `options`.
  std::string build_options(const std::string& options) const;
  /// The work-items and groups that a launch over `wanted` comes to, of a kernel that allows `most`
  /// items in a group.
  Range launched_range(const Range& wanted, std::size_t most) const;
  /// What kernels take that keep vectors of 16 floats busy, where the device has them.
  int wide_width() const { return wide && vector_width == 8 ? 16 : vector_width; }
  std::size_t most_bytes() const;  // that allocate_bytes can give
  Memory allocate_bytes(std::size_t bytes, bool zeroed = false);
  /// What a buffer of so many bytes takes as a part of another, padding among it: parts lie one
  /// behind the other (together.hpp).
  static std::size_t part_bytes(std::size_t bytes);
  /// A part of a buffer as one of its own; `origin` is a sum of part_bytes().
  static Memory part_of(const Memory& whole, std::size_t origin, std::size_t bytes) {
    return MemoryPool::part_of(whole, origin, part_bytes(bytes));
  }
  /// Whether the device reads and writes the host's memory where it lies.
  bool is_in_place() const { return !staging; }
  /// Memory for the host to write, for done_bytes().
  HostMemory host_bytes(std::size_t bytes);
  /// A buffer of what the host wrote: in place, or copied before the next launch or read (which is
  /// when it counts), without a wait where the memory allows it.
  Memory done_bytes(HostMemory memory);
  /// The buffers of done_bytes() get what the host wrote. To be called before commands that this
  /// does not enqueue.
  void send_uploads();
  /// What allocate_bytes() makes, with every `pattern_bytes` of it as `pattern` says.
  Memory filled_bytes(const void* pattern, std::size_t pattern_bytes, std::size_t bytes);
  /// A buffer of at least so many bytes that hold a pattern of four, which no kernel changes: it is
  /// kept, and given again to all who want the same.
  Memory constant_bytes(cl_uint pattern, std::size_t bytes);
  void write_bytes(Memory::Place to, const void* from, std::size_t bytes);
  void read_bytes(Memory::Place from, void* to, std::size_t bytes);
  HostMemory copy_bytes(const Memory& from, std::size_t bytes);  // for the host to read; waits
  void* map_bytes(const Memory& memory, std::size_t bytes);      // for reading, in place; waits
  void unmap(const Memory& memory, void* mapped) noexcept;       // the next launch throws for it
  void fill_bytes(const Memory& memory, const void* pattern, std::size_t pattern_bytes,
                  std::size_t bytes);
  // The same of a whole buffer.
  void write_bytes(const cl::Buffer& to, const void* from, std::size_t bytes) {
    write_bytes({to, 0}, from, bytes);
  }
  void read_bytes(const cl::Buffer& from, void* to, std::size_t bytes) {
    read_bytes({from, 0}, to, bytes);
  }
  void write_bytes(const Memory& to, const void* from, std::size_t bytes) {
    write_bytes(to.place(), from, bytes);
  }
  void read_bytes(const Memory& from, void* to, std::size_t bytes) {
    read_bytes(from.place(), to, bytes);
  }

  /// What was enqueued is begun while the host does something else.
  void flush();

  /// Throws what a failed call comes to: `doing` says what the program was about, "filling 12
  /// bytes".
  [[noreturn]] void fail(const std::string& doing, const cl::Error& error) const;

  /// Waits for all work and returns the milliseconds each kernel took since the last call, while
  /// launches are timed.
  std::vector<std::pair<std::string, double>> take_times();
  /// The milliseconds that programs and kernels took to build since the last call.
  double take_building_ms() { return std::exchange(building_ms_, 0); }
  /// Whether launches are timed from now on (default). A GPU's driver takes twice as long for one
  /// that is. Waits for all work where that changes; times not taken yet are lost.
  void time_kernels(bool on);

 private:
  void finish();  // waits for all work; throws cl::Error
  void fill_new(const Memory& memory, const void* pattern, std::size_t pattern_bytes,
                std::size_t bytes);
  /// Fills from byte `from` on; the only place that enqueues a fill. Throws cl::Error.
  template <class Pattern>
  void enqueue_fill(const Memory& memory, const Pattern& pattern, std::size_t from,
                    std::size_t bytes) {
    const Memory::Place at = memory.place();
    queue.enqueueFillBuffer(at.buffer, pattern, at.origin + from, bytes);
    ++counts.fills;
  }

  std::size_t padded(std::size_t bytes) const;  // of a buffer; throws where it would be too large
  std::string place() const;                    // " on "the device" in stage fit"
  cl::Program build(const std::string& file, const std::string& source, const std::string& options);
  cl::Program build_kept(const std::string& binary, const std::string& options);

  /// From now on the context is never released. After a build that failed, or a kernel that cannot
  /// be made, PoCL 3.0 aborts the process when the context goes, and nobody would learn what
  /// failed.
  void keep_context();
  bool context_is_kept_ = false;

  double building_ms_ = 0;
  int anew_ = 0;                          // programs that no cache had
  std::set<std::string> new_programs_;    // of these, the keys in `programs`
  std::vector<BuiltKernel*> of_handles_;  // in `kernels`, by a handle's number and width

  Uploads uploads_;
  struct Constant {
    Memory memory;
    std::size_t bytes = 0;
  };
  std::map<cl_uint, Constant> constants_;  // by their pattern

  cl::CommandQueue other_queue_;  // the timed one where launches are not timed, and the reverse

  /// Tells the guard, where there is one, what begins, and that it is over where that is known.
  void tell_guard(const std::string& name, const char* doing);
  void tell_guard_over();

  /// Throws where unmap failed, which cannot throw by itself.
  void check_unmapped();
  std::optional<cl::Error> unmap_error_;
};

/// "-D WIDTH=n": the number of pixels or groups that a work-item of a loop-heavy kernel takes.
std::string width_option(int width);

template <class T>
Buffer<T> allocate(Device& device, std::size_t size) {
  return {device.state().allocate_bytes(size * sizeof(T)), size};
}

/// The most values of T that a buffer of the device can hold. What grows beyond is cut by its
/// stage.
template <class T>
std::size_t most_values(Device& device) {
  return device.state().most_bytes() / sizeof(T);
}

/// A buffer filled with `value`.
template <class T>
Buffer<T> filled(Device& device, std::size_t size, const T& value) {
  static_assert(sizeof(T) == 1 || sizeof(T) == 4, "fill patterns are one or four bytes");
  return {device.state().filled_bytes(&value, sizeof(T), size * sizeof(T)), size};
}

/// A buffer whose values are all `value` and stay so: for kernels to read.
template <class T>
Buffer<T> constant(Device& device, std::size_t size, const T& value) {
  static_assert(sizeof(T) == 4, "patterns of constants are four bytes");
  return {device.state().constant_bytes(std::bit_cast<cl_uint>(value), size * sizeof(T)), size};
}

/// Gives every value of a buffer.
template <class T>
void fill(Device& device, const Buffer<T>& buffer, const T& value) {
  static_assert(sizeof(T) == 1 || sizeof(T) == 4, "fill patterns are one or four bytes");
  if (buffer.size > 0)
    device.state().fill_bytes(buffer.memory, &value, sizeof(T), buffer.size * sizeof(T));
}

/// Values that the host writes, all of them, for a buffer that done() makes of them: in place where
/// the device shares the host's memory, else copied when they are done, without a wait where the
/// memory allows it (staging.hpp).
template <class T>
class Upload {
 public:
  Upload(Device& device, std::size_t size)
      : device_(device), size_(size), memory_(device.state().host_bytes(size * sizeof(T))) {}
  Upload(const Upload&) = delete;
  Upload& operator=(const Upload&) = delete;

  std::size_t size() const { return size_; }
  T* data() { return static_cast<T*>(memory_.bytes.get()); }
  T& operator[](std::size_t i) { return data()[i]; }

  Buffer<T> done() { return {device_.state().done_bytes(std::move(memory_)), size_}; }

 private:
  Device& device_;
  std::size_t size_;
  HostMemory memory_;
};

/// Copies host values into a new buffer. Returns when the host values are no longer needed.
template <class T>
Buffer<T> upload(Device& device, const std::vector<T>& values) {
  Upload<T> copy(device, values.size());
  std::copy(values.begin(), values.end(), copy.data());
  return copy.done();
}

/// A buffer's values on the host, to be read while this lives and the device is given no work: in
/// place where the device shares the host's memory, else a copy. Waits for all work.
template <class T>
class HostView {
 public:
  HostView(Device& device, const Buffer<T>& buffer)
      : state_(device.state()), memory_(buffer.memory), size_(buffer.size) {
    if (size_ == 0) return;
    if (state_.is_in_place()) {
      mapped_ = state_.map_bytes(memory_, size_ * sizeof(T));
      data_ = static_cast<const T*>(mapped_);
    } else {
      copy_ = state_.copy_bytes(memory_, size_ * sizeof(T));
      data_ = static_cast<const T*>(copy_.bytes.get());
    }
  }
  ~HostView() {
    if (mapped_) state_.unmap(memory_, mapped_);
  }
  HostView(const HostView&) = delete;
  HostView& operator=(const HostView&) = delete;

  std::size_t size() const { return size_; }
  const T* data() const { return data_; }
  const T& operator[](std::size_t i) const { return data_[i]; }

 private:
  Device::State& state_;
  Memory memory_;
  std::size_t size_;
  void* mapped_ = nullptr;
  HostMemory copy_;
  const T* data_ = nullptr;
};

/// Waits for all work and copies a buffer to the host.
template <class T>
std::vector<T> download(Device& device, const Buffer<T>& buffer) {
  if (device.state().is_in_place()) {
    std::vector<T> values(buffer.size);
    if (buffer.size)
      device.state().read_bytes(buffer.memory, values.data(), buffer.size * sizeof(T));
    return values;
  }
  const HostView view(device, buffer);
  return std::vector<T>(view.data(), view.data() + view.size());
}

/// While this lives launches are timed, or are not unless somebody watches them.
class TimedKernels {
 public:
  TimedKernels(Device& device, bool timed) : state_(device.state()), before_(state_.timed) {
    state_.time_kernels(timed || state_.observer);
  }
  ~TimedKernels() {
    try {
      state_.time_kernels(before_);
    } catch (const Error&) {
      // The next command meets it again.
    }
  }
  TimedKernels(const TimedKernels&) = delete;
  TimedKernels& operator=(const TimedKernels&) = delete;

 private:
  Device::State& state_;
  bool before_;
};

template <class T>
const cl::Buffer& kernel_argument(const Buffer<T>& buffer) {
  return buffer.memory;
}
template <class T>
const T& kernel_argument(const T& value) {
  return value;
}

template <class T>
KernelLaunch::Argument seen_argument(const Buffer<T>& buffer) {
  const cl::Buffer& memory = buffer.memory;
  return {&memory, buffer.size * sizeof(T), std::is_same_v<T, float>, nullptr, 0};
}
template <class T>
KernelLaunch::Argument seen_argument(const T& value) {
  return {nullptr, 0, false, &value, sizeof value};
}

/// Launches a built kernel: the only place that sets arguments. Does not wait.
template <class... Arguments>
void launch(Device& device, BuiltKernel& built, const Range& range, const Arguments&... arguments) {
  Device::State& state = device.state();
  cl_uint index = 0;
  try {
    (built.kernel.setArg(index++, kernel_argument(arguments)), ...);
    state.counts.arguments += index;
  } catch (const cl::Error& error) {
    state.fail("giving " + built.name + " its arguments", error);
  }
  if (!state.observer) return state.enqueue(built, range);
  const KernelLaunch seen{
      built.file, built.name, built.options, range, {seen_argument(arguments)...}};
  state.observer->before(seen);
  state.enqueue(built, range);
  state.observer->after(seen);
  if (state.guard) state.guard->ended();
}

/// Whether the guard, where there is one, does not allow a launch; then the observer is told, or
/// KernelLeftOut is thrown.
template <class... Arguments>
bool left_out(Device& device, const std::string& file, const std::string& name,
              const std::string& options, const Range& range, const Arguments&... arguments) {
  Device::State& state = device.state();
  if (!state.guard || state.guard->allows(name)) return false;
  if (!state.observer) throw KernelLeftOut(name);
  const KernelLaunch seen{file, name, options, range, {seen_argument(arguments)...}};
  state.observer->before(seen);
  state.observer->left_out(seen);
  return true;
}

/// Builds (once) and launches a kernel (device/kernels.hpp) whose work-items take `width` values at
/// a time: launch(device, kernels::fill_words, 1, {n}, buffer, ...). For a noun of kernels/nouns.h
/// it takes a value with the noun's members. Does not wait.
template <class... Types, class... Arguments>
void launch(Device& device, const KernelHandle<Types...>& kernel, int width, const Range& range,
            const Arguments&... arguments) {
  static_assert(sizeof...(Types) == sizeof...(Arguments),
                "the kernel takes another number of arguments");
  if constexpr (sizeof...(Types) == sizeof...(Arguments)) {
    static_assert((takes<Types, Arguments> && ...), "the kernel takes another type");
    std::apply(
        [&](const auto&... parts) {
          Device::State& state = device.state();
          if (state.guard &&
              left_out(device, kernel.file, kernel.name, width_option(width), range, parts...))
            return;
          launch(device, state.kernel(kernel.file, kernel.name, kernel.number, width), range,
                 parts...);
        },
        std::tuple_cat(parts_of<Types>(arguments)...));
  }
}

/// The same of a kernel by its name and with any options of the compiler, for what probes a device.
template <class... Arguments>
void launch(Device& device, const std::string& file, const std::string& name, const Range& range,
            const std::string& options, const Arguments&... arguments) {
  if (left_out(device, file, name, options, range, arguments...)) return;
  BuiltKernel& built = device.state().kernel(file, name, options);
  if (built.arguments != sizeof...(arguments))
    throw DeviceError(file + ": " + name + " takes " + std::to_string(built.arguments) +
                      " arguments, not " + std::to_string(sizeof...(arguments)));
  launch(device, built, range, arguments...);
}

}  // namespace meniscus
