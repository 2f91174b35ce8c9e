// Building programs when a device is used for the first time.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "meniscus/device.hpp"

namespace meniscus {

/// What a program is built from, as launch() takes it: the kernel's file after those whose
/// functions it uses, and what the compiler is told.
struct ProgramName {
  std::string file, options;
  bool operator==(const ProgramName&) const = default;
};

/// One thread of the process builds the program of a key at a time. Others wait here, and then find
/// it in a cache. PoCL has a cache on disk and one lock for each context, so that several contexts
/// build different programs at the same time.
class BuildTurn {
 public:
  explicit BuildTurn(std::string key);  // waits while another thread has the turn of this key
  ~BuildTurn();
  BuildTurn(const BuildTurn&) = delete;
  BuildTurn& operator=(const BuildTurn&) = delete;

  /// Notes that the program was built by this process.
  void built();

 private:
  std::string key_;
};

/// Whether this process built the program of a key.
bool was_built_here(const std::string& key);

enum class Keeps;  // device.hpp

/// What is kept of the programs that a device's runtime builds.
Keeps kept_of(const DeviceInfo& info);

/// Whether a device's runtime compiles a kernel when it is launched first, as PoCL does.
bool compiles_at_launch(const DeviceInfo& info);

/// Builds programs for a device on threads of its own, in contexts of its own, so that they lie in
/// the runtime's cache when they are wanted. It does so for PoCL alone, where it was measured, and
/// not for programs that were built before. A build that fails is left for whoever wants the
/// program.
class BuildAhead {
 public:
  BuildAhead(Device& device, std::vector<ProgramName> programs);
  ~BuildAhead();  // lets builds under way end and begins no others
  BuildAhead(const BuildAhead&) = delete;
  BuildAhead& operator=(const BuildAhead&) = delete;

 private:
  void build();

  DeviceInfo info_;
  std::vector<ProgramName> programs_;
  std::atomic<std::size_t> next_{0};
  std::vector<std::jthread> threads_;
};

}  // namespace meniscus
