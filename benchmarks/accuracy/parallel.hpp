// Independent jobs on all processors.
#pragma once

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace meniscus::accuracy {

/// Calls job(k) for k in [0, count), each once, in any order. Jobs must not throw.
template <class Job>
void for_each_index(int count, const Job& job) {
  std::atomic<int> next{0};
  const auto work = [&] {
    for (int k; (k = next++) < count;) job(k);
  };
  std::vector<std::jthread> helpers;
  const int processors = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  for (int k = 1; k < std::min(processors, count); ++k) helpers.emplace_back(work);
  work();
}

}  // namespace meniscus::accuracy
