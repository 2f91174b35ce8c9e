#include "device/device.hpp"

#include <algorithm>
#include <sstream>

#include "device/kernel_sources.hpp"

namespace meniscus {
namespace {

// No relaxed maths: the same bits on every device, and INFINITY means "no surface". Division and
// square root are exact on CPUs and where a GPU is asked for it.
std::string compiler_options(const cl::Device& device) {
  std::string options = "-cl-std=CL1.2 ";
  if (device.getInfo<CL_DEVICE_SINGLE_FP_CONFIG>() & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT)
    options += "-cl-fp32-correctly-rounded-divide-sqrt ";
  return options;
}

// Vector loads may reach past the last value by up to one vector of sixteen.
constexpr std::size_t kPadding = 64 * 16;

[[noreturn]] void fail(const Device::State& state, const std::string& call,
                       const cl::Error& error) {
  std::string what = call + " failed on \"" + state.info.name + "\"" +
                     (state.stage.empty() ? "" : " in stage " + state.stage) + ": OpenCL error " +
                     std::to_string(error.err());
  if (error.err() == CL_MEM_OBJECT_ALLOCATION_FAILURE || error.err() == CL_OUT_OF_RESOURCES ||
      error.err() == CL_OUT_OF_HOST_MEMORY || error.err() == CL_INVALID_BUFFER_SIZE)
    what += " (out of memory: use a smaller image or another --device)";
  throw DeviceError(what);
}

std::string_view text_of(const std::string& file) {
  for (const KernelSource& source : kernel_sources())
    if (source.file == file) return source.text;
  throw DeviceError(file + " is not among the embedded kernels");
}

// The first line of the compiler's log that speaks of an error, or the first line.
std::string first_error(const std::string& log) {
  std::istringstream lines(log);
  std::string line, first;
  while (std::getline(lines, line)) {
    if (first.empty()) first = line;
    if (line.find("error") != std::string::npos) return line;
  }
  return first;
}

}  // namespace

void DeviceMemory::add(std::uint64_t bytes) {
  const std::uint64_t now = now_ += bytes;
  std::uint64_t peak = peak_;
  while (now > peak && !peak_.compare_exchange_weak(peak, now)) {
  }
}

std::string width_option(int width) { return "-D WIDTH=" + std::to_string(width); }

cl::Kernel& Device::State::kernel(const std::string& file, const std::string& name,
                                  const std::string& options) {
  const std::string program_key = file + " " + options;
  const std::string key = program_key + " " + name;
  if (const auto found = kernels.find(key); found != kernels.end()) return found->second;

  auto program = programs.find(program_key);
  if (program == programs.end()) {
    std::string source;
    std::istringstream parts("prelude.cl " + file);
    for (std::string part; parts >> part;)
      source += "\n#line 1 \"" + part + "\"\n" + std::string(text_of(part));
    try {
      cl::Program built(context, source);
      try {
        built.build(info.handle, (compiler_options(info.handle) + options).c_str());
      } catch (const cl::Error&) {
        throw DeviceError(file + " did not build on \"" + info.name + "\": " +
                          first_error(built.getBuildInfo<CL_PROGRAM_BUILD_LOG>(info.handle)));
      }
      program = programs.emplace(program_key, built).first;
    } catch (const cl::Error& error) {
      fail(*this, "building " + file, error);
    }
  }
  try {
    return kernels.emplace(key, cl::Kernel(program->second, name.c_str())).first->second;
  } catch (const cl::Error& error) {
    fail(*this, "creating kernel " + name, error);
  }
}

void Device::State::enqueue(cl::Kernel& kernel, const std::string& name, const Range& range) {
  const auto rounded = [](std::size_t n, std::size_t group) {
    return (n + group - 1) / group * group;
  };
  if (range.nx == 0 || range.ny == 0) return;
  cl::Event event;
  try {
    const cl::NDRange global =
        range.group_y > 1 || range.ny > 1
            ? cl::NDRange(rounded(range.nx, range.group_x), rounded(range.ny, range.group_y))
            : cl::NDRange(rounded(range.nx, range.group_x));
    const cl::NDRange local = range.group_y > 1 || range.ny > 1
                                  ? cl::NDRange(range.group_x, range.group_y)
                                  : cl::NDRange(range.group_x);
    queue.enqueueNDRangeKernel(kernel, cl::NullRange, global, local, nullptr, &event);
  } catch (const cl::Error& error) {
    fail(*this, "launching " + name, error);
  }
  events.emplace_back(name, event);
}

Memory Device::State::allocate_bytes(std::size_t bytes) {
  if (bytes > info.largest_buffer)
    throw DeviceError("a buffer of " + std::to_string(bytes) + " bytes is needed but \"" +
                      info.name + "\" allows " + std::to_string(info.largest_buffer) +
                      " (use a smaller image or another --device)");
  try {
    const std::size_t padded = (bytes + 63) / 64 * 64 + kPadding;
    Memory buffer = pool->take(padded);
    const cl_uint zero = 0;
    const std::size_t tail = bytes / 4 * 4;
    queue.enqueueFillBuffer(buffer, zero, tail, padded - tail);
    return buffer;
  } catch (const cl::Error& error) {
    fail(*this, "allocating " + std::to_string(bytes) + " bytes", error);
  }
}

void Device::State::write_bytes(const cl::Buffer& to, const void* from, std::size_t bytes) {
  try {
    queue.enqueueWriteBuffer(to, CL_TRUE, 0, bytes, from);
  } catch (const cl::Error& error) {
    fail(*this, "upload", error);
  }
}

void Device::State::read_bytes(const cl::Buffer& from, void* to, std::size_t bytes) {
  try {
    queue.enqueueReadBuffer(from, CL_TRUE, 0, bytes, to);
  } catch (const cl::Error& error) {
    fail(*this, "download", error);
  }
}

void* Device::State::map_bytes(const cl::Buffer& buffer, std::size_t bytes) {
  try {
    return queue.enqueueMapBuffer(buffer, CL_TRUE, CL_MAP_READ, 0, bytes);
  } catch (const cl::Error& error) {
    fail(*this, "mapping a buffer", error);
  }
}

void Device::State::unmap(const cl::Buffer& buffer, void* mapped) noexcept {
  try {
    queue.enqueueUnmapMemObject(buffer, mapped);
  } catch (const cl::Error&) {
    // The next command on the buffer says what is wrong.
  }
}

void Device::State::fill_bytes(const cl::Buffer& buffer, const void* pattern,
                               std::size_t pattern_bytes, std::size_t bytes) {
  try {
    if (pattern_bytes == 4) {
      // Sixteen words at a time: PoCL stores a pattern at a time.
      cl_uint16 words;
      for (cl_uint& word : words.s)
        std::copy_n(static_cast<const char*>(pattern), 4, reinterpret_cast<char*>(&word));
      const std::size_t whole = bytes / sizeof(words) * sizeof(words);
      if (whole > 0) queue.enqueueFillBuffer(buffer, words, 0, whole);
      if (whole < bytes) queue.enqueueFillBuffer(buffer, words.s[0], whole, bytes - whole);
    } else {
      cl_uchar byte;
      std::copy_n(static_cast<const char*>(pattern), 1, reinterpret_cast<char*>(&byte));
      if (pattern_bytes != 1) throw DeviceError("fill patterns are one or four bytes");
      queue.enqueueFillBuffer(buffer, byte, 0, bytes);
    }
  } catch (const cl::Error& error) {
    fail(*this, "fill", error);
  }
}

std::vector<std::pair<std::string, double>> Device::State::take_times() {
  std::vector<std::pair<std::string, double>> times;
  try {
    queue.finish();
    for (const auto& [name, event] : events) {
      const auto begin = event.getProfilingInfo<CL_PROFILING_COMMAND_START>();
      const auto end = event.getProfilingInfo<CL_PROFILING_COMMAND_END>();
      times.emplace_back(name, 1e-6 * static_cast<double>(end - begin));
    }
  } catch (const cl::Error& error) {
    fail(*this, "waiting for the device", error);
  }
  events.clear();
  return times;
}

Device::Device(const std::string& selector) : Device(select_device(selector)) {}

Device::Device(const DeviceInfo& info) : state_(std::make_unique<State>()) {
  state_->info = info;
  try {
    state_->context = cl::Context(info.handle);
    state_->queue = cl::CommandQueue(state_->context, info.handle, CL_QUEUE_PROFILING_ENABLE);
    state_->pool = std::make_unique<MemoryPool>(state_->context, state_->memory);
  } catch (const cl::Error& error) {
    fail(*state_, "opening the device", error);
  }
  state_->vector_width = info.kind == DeviceKind::cpu ? 8 : 1;
}

Device::~Device() = default;
Device::Device(Device&&) noexcept = default;
Device& Device::operator=(Device&&) noexcept = default;
const DeviceInfo& Device::info() const { return state_->info; }

}  // namespace meniscus
