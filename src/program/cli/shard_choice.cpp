#include "program/cli/shard_choice.hpp"

#include <algorithm>
#include <cstdlib>

#include "program/cli/options.hpp"

namespace meniscus::cli {

ShardChoice choose_shard(const ExtractOptions& options) {
  const bool from_slurm = options.shard == "slurm";
  if (!options.shard.empty() && !from_slurm)
    return {as_usage([&] { return parse_shard(options.shard); }), "from --shard"};
  const char* const id = std::getenv("SLURM_ARRAY_TASK_ID");
  const char* const count = std::getenv("SLURM_ARRAY_TASK_COUNT");
  if (!id || !count) {
    if (from_slurm)
      throw usage_error(
          "--shard slurm: SLURM_ARRAY_TASK_ID and SLURM_ARRAY_TASK_COUNT are not set, must be a "
          "task of a Slurm array (or give --shard k/N)");
    return {};
  }
  // They may be this task's own, made from its number, or those of all tasks together.
  if (!from_slurm && !options.frames.empty())
    throw usage_error("--frames " + options.frames + " in task " + id +
                      " of a Slurm array: give --shard 1/1 if these frames are this task's own, or "
                      "--shard slurm to split them among the tasks of the array");
  const char* const first = std::getenv("SLURM_ARRAY_TASK_MIN");
  const char* const last = std::getenv("SLURM_ARRAY_TASK_MAX");
  const char* const step = std::getenv("SLURM_ARRAY_TASK_STEP");
  const auto number = [](const char* text, long otherwise) {
    return text ? std::strtol(text, nullptr, 10) : otherwise;
  };
  const auto place_of = [&](const char* task) {
    return (number(task, 0) - number(first, 0)) / std::max(1l, number(step, 1)) + 1;
  };
  const long place = place_of(id), tasks = number(count, 0);
  if (place_of(last ? last : id) > tasks)
    throw usage_error("SLURM_ARRAY_TASK_ID is " + std::string(id) + " of an array of " + count +
                      " tasks that has gaps, which says nothing about parts (give --shard k/N)");
  ShardChoice choice{as_usage([&] { return parse_shard(std::to_string(place) + "/" + count); }),
                     "from SLURM_ARRAY_TASK_ID (--shard 1/1 for all)",
                     {}};
  if (!from_slurm && tasks == 1 && number(id, 0) > 1)  // one of an earlier array again?
    choice.warning = std::string("task ") + id +
                     " is the only one of its Slurm array and does all frames (for one part of N "
                     "give --shard k/N, for all --shard slurm)";
  return choice;
}

Shard part_of(const Shard& shard, int rank, int size) {
  return {shard.index + shard.count * rank, shard.count * size};
}

}  // namespace meniscus::cli
