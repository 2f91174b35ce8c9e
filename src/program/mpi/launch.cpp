#include "program/mpi/launch.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "base/grouped.hpp"

namespace meniscus {
namespace {

std::unique_ptr<Channel> channel;
std::optional<Team> team;

std::optional<int> number_in(const char* variable) {
  const char* const text = std::getenv(variable);
  if (!text || !*text) return std::nullopt;
  return std::atoi(text);
}

// Beside the program, where it was built, or in the folder of its installation's modules; else the
// place where it should be.
std::string module_path() {
  namespace fs = std::filesystem;
  constexpr const char* kName = "meniscus_mpi.so";
  const fs::path folder = fs::read_symlink("/proc/self/exe").parent_path();
  const fs::path beside = folder / kName;
  return fs::exists(beside) ? beside : (folder / MENISCUS_MODULES / kName).lexically_normal();
}

void open_channel(const Launch& started) {
  const std::string what = "started by mpirun or srun as " +
                           counted(started.size, "process", "es") + " that work together";
  void* const module = dlopen(module_path().c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!module)
    throw Error(what + ", but " + dlerror() +
                " (build with -DMENISCUS_MPI=ON, or start one process)");
  const auto open = reinterpret_cast<Channel* (*)()>(dlsym(module, "meniscus_open_channel"));
  if (!open) throw Error(what + ", but meniscus_mpi.so is of another version (build it again)");
  channel.reset(open());
  if (channel->size() != started.size)
    throw Error(what + ", but MPI finds " + counted(channel->size(), "process", "es") +
                " (use the mpirun of the Open MPI that meniscus was built with)");
}

}  // namespace

Launch launch() {
  const auto first = [](auto... variables) {
    std::optional<int> number;
    for (const char* variable : {variables...})
      if (!number) number = number_in(variable);
    return number;
  };
  const int rank = first("OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK").value_or(-1);
  if (rank < 0) return {};
  return {rank,
          std::max(rank + 1,
                   first("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS").value_or(1))};
}

Team& launched_team() {
  if (team) return *team;
  const Launch started = launch();
  if (started.size == 1) return alone();
  open_channel(started);
  return team.emplace(channel.get());
}

bool has_team() { return team.has_value(); }

std::string end_team(const std::string& error) {
  if (!team) return error;
  if (!error.empty()) return team->fail(error);
  try {
    team->meet();
  } catch (const TeamError& other) {
    return other.what();
  }
  return "";
}

void leave_team() {
  if (!channel) return;
  std::uint32_t nothing = 0;
  channel->minimum(&nothing, 1);
  team.reset();
  channel.reset();
}

}  // namespace meniscus
