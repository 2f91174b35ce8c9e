// Watches launches: what each leaves in its buffers, compared with the canonical bits.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "device/device.hpp"
#include "meniscus/error.hpp"
#include "verify/canonical.hpp"

namespace meniscus::verify {

/// The names of a kernel's arguments, from its text. Empty when `file` has no such kernel.
const std::vector<std::string>& argument_names(const std::string& file, const std::string& kernel);

/// A launch left what is wrong and cannot be put right: what comes after it would work on that.
struct BeyondRepair : Error {
  BeyondRepair()
      : Error("a launch left other bits than the canonical ones, which are not at hand") {}
};

/// What was seen of one kernel.
struct KernelFindings {
  std::string stage;  // of the first launch, or of the first that differs
  int launches = 0;   // compared
  int differing = 0;  // of them
  int unknown = 0;    // launches whose inputs were, or would have been, different already
  double ulp = 0;     // largest difference of floats; infinity: of a number from none
  std::string first;  // in words: the first difference
  double ms = 0;      // on the device
};

/// Watches the launches on a device while it lives: buffers begin with zeros, none is used again.
/// With a canonical trace, every launch is compared with its place in it. What differs is put right
/// where the canonical values are known, so that the next kernel starts from the right inputs and
/// is judged by what it does itself. Where they are not known, the launch throws BeyondRepair:
/// kernels that are given wrong lists may write anywhere.
class Tracer : public LaunchObserver {
 public:
  /// Records only; `values`, when given, receives what the launches wrote.
  explicit Tracer(Device& device, std::map<std::uint64_t, std::vector<std::uint8_t>>* values);
  /// Compares. `values` holds what is known of the written values.
  Tracer(Device& device, const Trace& canonical,
         const std::map<std::uint64_t, std::vector<std::uint8_t>>& values);
  ~Tracer() override;
  Tracer(const Tracer&) = delete;
  Tracer& operator=(const Tracer&) = delete;

  void before(const KernelLaunch& launch) override;
  void after(const KernelLaunch& launch) override;

  const Trace& trace() const { return trace_; }
  const std::map<std::string, KernelFindings>& findings() const { return findings_; }
  /// The first launch that differs, in words, with its stage; empty: none does.
  const std::string& first_difference() const { return first_difference_; }
  /// In words, when launches were missing, too many or other ones than the canonical; else empty.
  std::string other_launches() const;

 private:
  using Bytes = std::vector<std::uint8_t>;
  std::vector<Bytes> read(const KernelLaunch& launch);
  void compare(const KernelLaunch& launch, const std::vector<Bytes>& found);

  Device& device_;
  const Trace* canonical_ = nullptr;
  const std::map<std::uint64_t, Bytes>* known_ = nullptr;
  std::map<std::uint64_t, Bytes>* values_ = nullptr;
  Trace trace_;
  std::vector<std::string> names_;  // of the launch's arguments
  std::vector<Bytes> contents_;     // of its buffers before it
  std::map<std::string, KernelFindings> findings_;
  std::string first_difference_, other_launches_;
};

}  // namespace meniscus::verify
