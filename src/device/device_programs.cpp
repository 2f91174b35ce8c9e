// What a device's state does for kernels: their sources put together, built or found where they
// were kept.
#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstdlib>
#include <sstream>

#include "base/content_hash.hpp"
#include "base/elapsed.hpp"
#include "device/building.hpp"
#include "device/device.hpp"
#include "device/installation.hpp"
#include "device/kernel_sources.hpp"
#include "device/opencl_error.hpp"
#include "device/program_cache.hpp"

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
    "density.cl particle_fit.cl edges.cl roundness.cl fairing.cl choose_groups.cl"};

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

}  // namespace

// Binaries where the platform has no cache of its own. PoCL would compile every kernel a second
// time to give a binary away, for groups of any size, which it does not launch. Nothing where
// kernels are run to be looked at.
Keeps kept_of(const DeviceInfo& info) {
  if (info.platform == "Oclgrind") return Keeps::nothing;
  constexpr std::array kOwnCache{kPocl, "rusticl", "NVIDIA CUDA"};
  const bool own = std::find(kOwnCache.begin(), kOwnCache.end(), info.platform) != kOwnCache.end();
  return own ? Keeps::notes : Keeps::binaries;
}

bool compiles_at_launch(const DeviceInfo& info) { return info.platform == kPocl; }

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

}  // namespace meniscus
