// Which frames of a sequence one process does.
#pragma once

#include <string>

#include "program/batch/frames.hpp"
#include "program/cli/extract_options.hpp"

namespace meniscus::cli {

struct ShardChoice {
  Shard shard;
  std::string origin;   // in words
  std::string warning;  // empty: none
};

/// The one of --shard, else the task of a Slurm array, else all frames. Throws usage_error.
ShardChoice choose_shard(const ExtractOptions& options);

/// The part of a shard that one of several processes takes.
Shard part_of(const Shard& shard, int rank, int size);

}  // namespace meniscus::cli
