// OpenCL devices: which there are, and opening one.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "meniscus/export.hpp"
#include "meniscus/notice.hpp"

namespace meniscus MENISCUS_API {

enum class DeviceKind { cpu, gpu, accelerator, other };

/// "CPU", "GPU", "accelerator" or "other".
const char* to_string(DeviceKind kind);

struct MENISCUS_INTERNAL DeviceHandle;

/// What `meniscus devices` shows of one OpenCL device.
struct DeviceInfo {
  int index = 0;  // position in list_devices()
  std::string name, platform, vendor, version, driver;
  DeviceKind kind = DeviceKind::other;
  unsigned compute_units = 0;
  std::uint64_t global_memory = 0;             // bytes
  std::uint64_t local_memory = 0;              // bytes
  std::uint64_t largest_buffer = 0;            // bytes
  std::uint64_t largest_group = 0;             // work-items
  bool usable = false;                         // can run the kernels
  std::string problem;                         // why it is not usable
  bool is_part = false;                        // has processors of its own, see divided()
  std::shared_ptr<const DeviceHandle> handle;  // OpenCL's, src/device/opencl.hpp
};

/// All devices of all platforms, in the order the OpenCL loader gives them. Platforms that fail
/// are skipped. Throws DeviceError when there is no OpenCL platform at all.
///
///   problems  when given, receives a line for each platform that gives no device and for each
///             vendor's library that gives no platform: which, and why
std::vector<DeviceInfo> list_devices(std::vector<std::string>* problems = nullptr);

/// The device that `selector` names: an index, `cpu`, `gpu`, or a part of a name (any case).
/// Empty: the fastest kind found: GPU, then accelerator, then CPU; among equals most compute
/// units, then the lower index. `why`, when given, receives the reason in words.
/// Throws DeviceError naming the devices there are.
DeviceInfo select_device(const std::string& selector = "", std::string* why = nullptr);

/// Devices for so many frames that are extracted at the same time: parts of a CPU with about as
/// many compute units each, to which the host's loops of such a frame keep, too, so that no frame
/// waits for another one's threads; or, where `info` cannot be divided so (few compute units,
/// GPUs), as many times `info` itself. What is computed is the same.
/// Throws InvalidArgument unless parts >= 1.
std::vector<DeviceInfo> divided(const DeviceInfo& info, int parts);

/// An opened device: context, queue, built kernels. Not for use by two threads at once.
class Device {
 public:
  /// Opens the device that `selector` names (see select_device). Throws DeviceError.
  explicit Device(const std::string& selector = "");
  /// Opens one of list_devices() or divided(). Throws DeviceError.
  explicit Device(const DeviceInfo& info);
  ~Device();
  Device(Device&&) noexcept;
  Device& operator=(Device&&) noexcept;

  const DeviceInfo& info() const;

  /// From now on `call` is called at the beginning of each stage of extract() on this device, with
  /// the stage's name, by the thread that extracts. What it throws ends the extraction and comes
  /// out of extract(); the device can be used on. An empty function: no more calls.
  void on_stage(std::function<void(const std::string& stage)> call);

  /// From now on `call` is called with each notice of extract(), extract_closed() and
  /// draw_whitewater() on this device as soon as it is known, once each, by the thread that
  /// extracts; that the radius does not fit the particles, for one, before the work that takes
  /// long. Surface::notices has all of them afterwards. Also told is what was known of a frame that
  /// then fails. What `call` throws ends the extraction and comes out of it; the device can be used
  /// on. It may take its time, and must not extract on the same device or use its callbacks. Where
  /// several processes share a frame, the first one's is told all, and none may throw. An empty
  /// function: no more calls.
  void on_notice(std::function<void(const Notice& notice)> call);

  struct MENISCUS_INTERNAL State;  // src/device/device.hpp
  State& state() { return *state_; }

 private:
  std::unique_ptr<State> state_;
};

}  // namespace MENISCUS_API
