// Loops on all processors. The only files that name the library behind them (oneTBB) are this one
// and parallel.cpp.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <cstddef>

namespace meniscus {

/// Calls work(begin, end) for ranges that together make [0, n), each index once, on as many threads
/// as there are; one call where there are not more than `grain`. How the range is cut changes from
/// run to run, so what `work` writes must not depend on it. Passes on what `work` throws.
template <class Work>
void parallel_for(std::size_t n, std::size_t grain, const Work& work) {
  if (n <= grain) {
    if (n > 0) work(std::size_t{0}, n);
    return;
  }
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, grain),
                    [&](const auto& range) { work(range.begin(), range.end()); });
}

/// Calls first() and second(), at the same time where there is a thread for it. A thread that waits
/// for loops of the one does not take up the other.
template <class First, class Second>
void parallel_both(const First& first, const Second& second) {
  parallel_for(2, 1, [&](std::size_t begin, std::size_t end) {
    if (begin == 0) tbb::this_task_arena::isolate(first);
    if (end == 2) tbb::this_task_arena::isolate(second);
  });
}

/// work(), whose loops keep to so many threads, the calling one among them. 0: no limit.
template <class Work>
auto on_threads(unsigned threads, const Work& work) {
  if (threads == 0) return work();
  return tbb::task_arena(static_cast<int>(threads)).execute(work);
}

/// How many threads the loops of this thread keep to: for on_threads() in a thread that works for
/// it.
unsigned threads_here();

/// Limits parallel_for to so many threads from now on, the calling one among them.
void limit_threads(int threads);

}  // namespace meniscus
