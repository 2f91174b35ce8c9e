#include "base/parallel.hpp"

#include <tbb/global_control.h>

#include <memory>

namespace meniscus {

void limit_threads(int threads) {
  static std::unique_ptr<tbb::global_control> limit;
  limit.reset();
  limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                static_cast<std::size_t>(threads));
}

}  // namespace meniscus
