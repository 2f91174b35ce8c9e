#include "device/building.hpp"

#include <algorithm>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <set>
#include <utility>

#include "device/device.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kThreads = 2;

struct Builds {
  std::mutex mutex;
  std::condition_variable over;
  std::set<std::string> under_way, built;  // keys
};

// Stays when the process ends: threads may wait for each other here while a library ends it.
Builds& builds() {
  static Builds& all = *new Builds;
  return all;
}

}  // namespace

BuildTurn::BuildTurn(std::string key) : key_(std::move(key)) {
  std::unique_lock lock(builds().mutex);
  builds().over.wait(lock, [&] { return !builds().under_way.contains(key_); });
  builds().under_way.insert(key_);
}

BuildTurn::~BuildTurn() {
  {
    const std::lock_guard lock(builds().mutex);
    builds().under_way.erase(key_);
  }
  builds().over.notify_all();
}

void BuildTurn::built() {
  const std::lock_guard lock(builds().mutex);
  builds().built.insert(key_);
}

bool was_built_here(const std::string& key) {
  const std::lock_guard lock(builds().mutex);
  return builds().built.contains(key);
}

BuildAhead::BuildAhead(Device& device, std::vector<ProgramName> programs) : info_(device.info()) {
  if (!device.state().compiles_at_launch) return;
  for (ProgramName& program : programs)
    if (!device.state().is_kept(program.file, program.options))
      programs_.push_back(std::move(program));
  for (std::size_t k = 0; k < std::min(kThreads, programs_.size()); ++k)
    threads_.emplace_back([this] { build(); });
}

BuildAhead::~BuildAhead() { next_ = programs_.size(); }

void BuildAhead::build() try {
  Device device(info_);
  for (std::size_t k = next_++; k < programs_.size(); k = next_++)
    device.state().program(programs_[k].file, programs_[k].options);
} catch (const std::exception&) {
  // Whoever wants the program meets the same error, and can say so.
}

}  // namespace meniscus
