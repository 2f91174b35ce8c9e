#include "base/parallel.hpp"

#include <tbb/global_control.h>

#include <memory>

namespace meniscus {

unsigned threads_here() { return static_cast<unsigned>(tbb::this_task_arena::max_concurrency()); }

void limit_threads(int threads) {
  static std::unique_ptr<tbb::global_control> limit;
  limit.reset();
  limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                static_cast<std::size_t>(threads));
}

}  // namespace meniscus
