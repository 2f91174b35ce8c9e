// Independent jobs on all processors.
#pragma once

#include "base/parallel.hpp"

namespace meniscus::accuracy {

/// Calls job(k) for k in [0, count), each once, in any order.
template <class Job>
void for_each_index(int count, const Job& job) {
  parallel_for(static_cast<std::size_t>(count), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) job(static_cast<int>(k));
  });
}

}  // namespace meniscus::accuracy
