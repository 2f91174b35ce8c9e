// Finding OpenCL devices and choosing one.
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <filesystem>

#include "base/comma_separated.hpp"
#include "base/grouped.hpp"
#include "device/host_signals.hpp"
#include "device/installation.hpp"
#include "device/opencl.hpp"
#include "device/opencl_error.hpp"
#include "meniscus/error.hpp"

namespace meniscus {
namespace {

// Whether a folder is this user's, and nobody else's business.
bool is_private(const std::string& folder) {
  struct stat status {};
  return lstat(folder.c_str(), &status) == 0 && S_ISDIR(status.st_mode) &&
         status.st_uid == geteuid() && (status.st_mode & (S_IRWXG | S_IRWXO)) == 0;
}

// The folder among the temporary files, where anyone may have made one of its name before; what
// PoCL finds in its cache it runs. Then it gets a name that nobody knows. Empty: there is none.
std::string private_temporary_folder() {
  std::error_code error;
  const std::filesystem::path all = std::filesystem::temp_directory_path(error);
  if (error) return "";
  std::string folder = (all / ("meniscus-pocl-" + std::to_string(geteuid()))).string();
  if (mkdir(folder.c_str(), S_IRWXU) == 0 || (errno == EEXIST && is_private(folder))) return folder;
  folder += "-XXXXXX";
  return mkdtemp(folder.data()) ? folder : "";
}

// PoCL crashes when it cannot write its kernel cache. It looks at POCL_CACHE_DIR, then
// XDG_CACHE_HOME, then HOME/.cache; when none of them can be written, give it a temporary folder
// before the first OpenCL call.
void give_pocl_a_cache() {
  namespace fs = std::filesystem;
  const auto writable = [](const fs::path& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) return false;
    std::string probe = (folder / ".meniscus-XXXXXX").string();
    const int file = mkstemp(probe.data());
    if (file < 0) return false;
    ::close(file);
    fs::remove(probe, error);
    return true;
  };
  if (const char* chosen = std::getenv("POCL_CACHE_DIR")) {
    if (writable(chosen)) return;
  } else if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache && *cache) {
    if (writable(fs::path(cache) / "pocl")) return;
  } else if (const char* home = std::getenv("HOME"); home && *home) {
    if (writable(fs::path(home) / ".cache" / "pocl")) return;
  }
  const std::string folder = private_temporary_folder();
  if (folder.empty() || !writable(folder))
    throw DeviceError(
        "no folder for PoCL's kernel cache can be written: set POCL_CACHE_DIR to one");
  setenv("POCL_CACHE_DIR", folder.c_str(), 1);
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string trimmed(std::string text) {
  while (!text.empty() && (text.back() == '\0' || text.back() == ' ')) text.pop_back();
  return text;
}

void ask(DeviceInfo& info) {
  const cl::Device& handle = handle_of(info);
  info.name = trimmed(handle.getInfo<CL_DEVICE_NAME>());
  info.vendor = trimmed(handle.getInfo<CL_DEVICE_VENDOR>());
  info.version = trimmed(handle.getInfo<CL_DEVICE_VERSION>());
  info.driver = trimmed(handle.getInfo<CL_DRIVER_VERSION>());
  const cl_device_type type = handle.getInfo<CL_DEVICE_TYPE>();
  info.kind = type & CL_DEVICE_TYPE_GPU           ? DeviceKind::gpu
              : type & CL_DEVICE_TYPE_ACCELERATOR ? DeviceKind::accelerator
              : type & CL_DEVICE_TYPE_CPU         ? DeviceKind::cpu
                                                  : DeviceKind::other;
  info.compute_units = handle.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
  info.global_memory = handle.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
  info.local_memory = handle.getInfo<CL_DEVICE_LOCAL_MEM_SIZE>();
  info.largest_buffer = handle.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
  info.largest_group = handle.getInfo<CL_DEVICE_MAX_WORK_GROUP_SIZE>();
  if (!handle.getInfo<CL_DEVICE_AVAILABLE>())
    info.problem = "not available";
  else if (!handle.getInfo<CL_DEVICE_COMPILER_AVAILABLE>())
    info.problem = "has no compiler";
  else if (!handle.getInfo<CL_DEVICE_ENDIAN_LITTLE>())
    info.problem = "is big-endian";
  // clover aborts the process at its first build (shared experience with Mesa 22.3).
  else if (lower(info.platform) == "clover")
    info.problem = "Clover aborts when it builds a kernel; use rusticl";
}

DeviceInfo describe_device(const cl::Device& handle, const std::string& platform) {
  DeviceInfo info;
  info.handle = std::make_shared<DeviceHandle>(DeviceHandle{handle});
  info.platform = platform;
  try {
    ask(info);
  } catch (const cl::Error& error) {
    info.problem = describe(error);
  }
  info.usable = info.problem.empty();
  return info;
}

// The devices of one platform, numbered from `first` on.
std::vector<DeviceInfo> devices_of(const cl::Platform& platform, int first) {
  std::vector<DeviceInfo> devices;
  const std::string name = trimmed(platform.getInfo<CL_PLATFORM_NAME>());
  std::vector<cl::Device> handles;
  try {
    platform.getDevices(CL_DEVICE_TYPE_ALL, &handles);
  } catch (const cl::Error& error) {
    throw DeviceError("platform " + name + ": " + describe(error));
  }
  if (handles.empty()) throw DeviceError("platform " + name + " has no device");
  for (const cl::Device& handle : handles) {
    devices.push_back(describe_device(handle, name));
    devices.back().index = first++;
  }
  return devices;
}

std::string listed(const std::vector<std::string>& problems) {
  std::string text;
  for (const std::string& problem : problems) text += "; " + problem;
  return text;
}

std::string names(const std::vector<DeviceInfo>& devices) {
  return comma_separated(devices, [](const DeviceInfo& device) {
    return std::to_string(device.index) + " \"" + device.name + "\"" +
           (device.usable ? "" : " (" + device.problem + ")");
  });
}

// All devices; `problems` receives those of platforms.
std::vector<DeviceInfo> find_devices(std::vector<std::string>& problems) {
  check_not_forked();
  give_pocl_a_cache();
  // Intel's CPU runtime (2026.2) changes the sums of fit_particles and fit_heights when it makes
  // vectors of 8 or 16 work-items (verify found it). What is slow one by one has vectors of its
  // own.
  setenv(kIntelVectorizer, "1", 0);
  const HostSignals signals;
  std::vector<cl::Platform> platforms;
  try {
    cl::Platform::get(&platforms);
  } catch (const cl::Error& error) {
    platforms.clear();
    // The loader reports an empty list as an error.
    if (error.err() != CL_PLATFORM_NOT_FOUND_KHR) problems.push_back(describe(error));
  }
  if (platforms.empty())
    throw DeviceError("no OpenCL platform was found" + listed(problems) +
                      listed(installation_problems()) +
                      "; install one, e.g. `apt-get install pocl-opencl-icd`, which runs on any "
                      "CPU");
  std::vector<DeviceInfo> devices;
  for (const cl::Platform& platform : platforms) {
    // A platform without devices, or one that fails, is no reason to fail with it.
    try {
      for (DeviceInfo& device : devices_of(platform, static_cast<int>(devices.size())))
        devices.push_back(std::move(device));
    } catch (const DeviceError& error) {
      problems.push_back(error.what());
    } catch (const cl::Error& error) {
      problems.push_back("a platform: " + describe(error));
    }
  }
  return devices;
}

}  // namespace

const char* to_string(DeviceKind kind) {
  switch (kind) {
    case DeviceKind::cpu:
      return "CPU";
    case DeviceKind::gpu:
      return "GPU";
    case DeviceKind::accelerator:
      return "accelerator";
    case DeviceKind::other:
      break;
  }
  return "other";
}

std::vector<DeviceInfo> list_devices(std::vector<std::string>* problems) {
  std::vector<std::string> found;
  const std::vector<DeviceInfo> devices = find_devices(found);
  if (problems) {
    *problems = std::move(found);
    for (std::string& problem : installation_problems()) problems->push_back(std::move(problem));
  }
  return devices;
}

DeviceInfo select_device(const std::string& selector, std::string* why) {
  std::vector<std::string> problems;
  const std::vector<DeviceInfo> devices = find_devices(problems);
  const auto rank = [](const DeviceInfo& d) {
    return d.kind == DeviceKind::gpu ? 0 : d.kind == DeviceKind::accelerator ? 1 : 2;
  };
  const std::string wanted = lower(selector);
  const bool is_index =
      !wanted.empty() && wanted.size() < 7 &&
      std::all_of(wanted.begin(), wanted.end(), [](char c) { return c >= '0' && c <= '9'; });
  const DeviceInfo* best = nullptr;
  for (const DeviceInfo& device : devices) {
    const bool matches = wanted.empty()    ? true
                         : is_index        ? device.index == std::stoi(wanted)
                         : wanted == "cpu" ? device.kind == DeviceKind::cpu
                         : wanted == "gpu"
                             ? device.kind == DeviceKind::gpu
                             : lower(device.name).find(wanted) != std::string::npos ||
                                   lower(device.platform).find(wanted) != std::string::npos;
    if (!matches) continue;
    if (!device.usable) {
      if (is_index)
        throw DeviceError("device " + selector + " \"" + device.name +
                          "\" cannot be used: " + device.problem);
      continue;
    }
    if (!best || rank(device) < rank(*best) ||
        (rank(device) == rank(*best) && device.compute_units > best->compute_units))
      best = &device;
  }
  if (!best) {
    std::string what = selector.empty() ? "no usable OpenCL device was found"
                                        : "no usable OpenCL device matches \"" + selector + "\"";
    if (!devices.empty()) what += "; there are: " + names(devices);
    throw DeviceError(what + listed(problems) + listed(installation_problems()));
  }
  if (why)
    *why = selector.empty() ? std::string("fastest kind found (") + to_string(best->kind) + ", " +
                                  counted(best->compute_units, "compute unit") + ")"
                            : "matches \"" + selector + "\"";
  return *best;
}

std::vector<DeviceInfo> divided(const DeviceInfo& info, int frames) {
  require(frames >= 1, "divided: " + std::to_string(frames) + " parts, wanted at least 1");
  std::vector<DeviceInfo> devices(static_cast<std::size_t>(frames), info);
  const unsigned units = info.compute_units;
  const unsigned parts = std::min(static_cast<unsigned>(frames), units);
  if (info.kind != DeviceKind::cpu || parts < 2) return devices;
  std::vector<cl_device_partition_property> wanted{CL_DEVICE_PARTITION_BY_COUNTS};
  for (unsigned k = 0; k < parts; ++k) wanted.push_back(units / parts + (k < units % parts));
  wanted.insert(wanted.end(), {CL_DEVICE_PARTITION_BY_COUNTS_LIST_END, 0});
  std::vector<cl::Device> handles;
  try {
    cl::Device(handle_of(info)).createSubDevices(wanted.data(), &handles);
  } catch (const cl::Error&) {
    return devices;  // few drivers can
  }
  if (handles.size() != parts) return devices;
  for (std::size_t k = 0; k < devices.size(); ++k) {
    devices[k].handle = std::make_shared<DeviceHandle>(DeviceHandle{handles[k % parts]});
    devices[k].compute_units = handle_of(devices[k]).getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
    devices[k].is_part = true;
  }
  return devices;
}

}  // namespace meniscus
