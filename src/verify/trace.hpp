// Watches launches: what each leaves in its buffers, compared with the canonical bits.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "device/device.hpp"
#include "meniscus/error.hpp"
#include "verify/canonical.hpp"
#include "verify/repro.hpp"
#include "verify/saved_launch.hpp"

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
  std::string stage;        // of the first launch, or of the first that differs
  int launches = 0;         // compared
  int differing = 0;        // of them
  int unknown = 0;          // launches whose inputs were, or would have been, different already
  std::string why_unknown;  // of the first of them, in words
  int unsteady = 0;         // launches that do not leave the same bits in every run
  int left_out = 0;         // launches that a guard did not allow
  double ulp = 0;           // largest difference of floats; infinity: of a number from none
  std::string first;        // in words: the first difference
  std::string first_unsteady;
  std::string reproducer;  // the folder of one; empty: none was written
  double ms = 0;           // on the device
};

/// What a Tracer does beside comparing.
struct Watching {
  int repeat = 1;                      // every launch is run so often, and must leave the same bits
  Reproducers* reproducers = nullptr;  // gets launches that fail
};

/// Watches the launches on a device while it lives: buffers begin with zeros, none is used again.
/// With a canonical trace, every launch is compared with its place in it. What differs is put right
/// where the canonical values are known, so that the next kernel starts from the right inputs and
/// is judged by what it does itself. Where they are not known, the launch throws BeyondRepair:
/// kernels that are given wrong lists may write anywhere. In the place of a launch that is left out
/// the canonical values are put, too.
class Tracer : public LaunchObserver {
 public:
  /// Records only; `values`, when given, receives what the launches wrote.
  explicit Tracer(Device& device, std::map<std::uint64_t, std::vector<std::uint8_t>>* values);
  /// Compares. `values` holds what is known of the written values.
  Tracer(Device& device, const Trace& canonical,
         const std::map<std::uint64_t, std::vector<std::uint8_t>>& values, Watching watching = {});
  ~Tracer() override;
  Tracer(const Tracer&) = delete;
  Tracer& operator=(const Tracer&) = delete;

  void before(const KernelLaunch& launch) override;
  void after(const KernelLaunch& launch) override;
  void left_out(const KernelLaunch& launch) override;

  const Trace& trace() const { return trace_; }
  const std::map<std::string, KernelFindings>& findings() const { return findings_; }
  /// The first launch that differs, or whose inputs do, in words, with its stage; empty: none does.
  const std::string& first_difference() const { return first_difference_; }
  /// In words, when launches were missing, too many or other ones than the canonical; else empty.
  std::string other_launches() const;

 private:
  // What is known of what a launch leaves in one of its buffers.
  struct Wanted {
    std::uint64_t hash = 0;
    const Bytes* values = nullptr;  // null: not known
  };
  std::vector<Bytes> read(const KernelLaunch& launch);
  void put(const KernelLaunch& launch, const std::vector<Bytes>& contents);
  void compare(const KernelLaunch& launch, const std::vector<Bytes>& found);
  void run_more(const KernelLaunch& launch, const std::vector<Bytes>& found);
  std::string place() const;                            // of the launch, in words
  std::string named(const KernelLaunch& launch) const;  // with its stage, kernel and place
  const TracedLaunch* expected_launch(const KernelLaunch& launch);
  std::vector<Wanted> wanted(const KernelLaunch& launch, const TracedLaunch& canonical) const;
  void reproduce(const KernelLaunch& launch, const std::vector<Wanted>& wanted,
                 const std::vector<Bytes>& found, const std::string& what);
  void count_unknown(const TracedLaunch& launch, const std::string& why);
  /// `what` the launch left that cannot be put right.
  [[noreturn]] void give_up_here(const std::string& what);

  Device& device_;
  const Trace* canonical_ = nullptr;
  const std::map<std::uint64_t, Bytes>* known_ = nullptr;
  std::map<std::uint64_t, Bytes>* values_ = nullptr;
  Watching watching_;
  Trace trace_;
  std::vector<std::string> names_;  // of the launch's arguments
  std::vector<Bytes> contents_;     // of its buffers before it
  std::map<std::string, KernelFindings> findings_;
  std::string first_difference_, other_launches_;
};

}  // namespace meniscus::verify
