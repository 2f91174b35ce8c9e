// Loops on all processors.
#include "base/parallel.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

namespace meniscus {
namespace {

TEST(ParallelFor, VisitsEveryIndexOnce) {
  for (const std::size_t n : {0, 1, 7, 64, 65, 100'000}) {
    std::vector<int> visits(n, 0);
    parallel_for(n, 64, [&](std::size_t begin, std::size_t end) {
      EXPECT_LT(begin, end);
      for (std::size_t i = begin; i < end; ++i) ++visits[i];
    });
    EXPECT_EQ(visits, std::vector<int>(n, 1));
  }
}

TEST(ParallelFor, IsOneCallUpToTheGrain) {
  int calls = 0;
  parallel_for(64, 64, [&](std::size_t begin, std::size_t end) {
    ++calls;
    EXPECT_EQ(begin, 0u);
    EXPECT_EQ(end, 64u);
  });
  EXPECT_EQ(calls, 1);
}

TEST(ParallelFor, PassesOnWhatIsThrown) {
  EXPECT_THROW(parallel_for(1000, 10,
                            [](std::size_t begin, std::size_t) {
                              if (begin == 0) throw std::runtime_error("first");
                            }),
               std::runtime_error);
}

TEST(OnThreads, LoopsKeepToTheNumberOfThreads) {
  const auto threads_in = [](unsigned threads) {
    return on_threads(threads, [] {
      std::set<std::thread::id> seen;
      std::mutex adding;
      parallel_for(2000, 1, [&](std::size_t, std::size_t) {
        const std::scoped_lock lock(adding);
        seen.insert(std::this_thread::get_id());
      });
      return seen;
    });
  };
  EXPECT_EQ(threads_in(1), std::set{std::this_thread::get_id()});
  EXPECT_LE(threads_in(2).size(), 2u);
  EXPECT_THROW(on_threads(1, []() -> int { throw std::runtime_error("in there"); }),
               std::runtime_error);
}

TEST(ParallelBoth, CallsEachOnceAndNeverTheOneWithinTheOther) {
  static thread_local bool within = false;  // a thread is in first()
  for (int run = 0; run < 200; ++run) {
    std::atomic<int> first{0}, second{0}, nested{0}, inner{0};
    parallel_both(
        [&] {
          within = true;
          ++first;
          parallel_for(64, 1, [&](std::size_t begin, std::size_t end) {
            inner += static_cast<int>(end - begin);
          });
          within = false;
        },
        [&] {
          nested += within;
          ++second;
        });
    EXPECT_EQ(first, 1);
    EXPECT_EQ(second, 1);
    EXPECT_EQ(inner, 64);
    EXPECT_EQ(nested, 0);
  }
}

TEST(ParallelBoth, PassesOnWhatIsThrown) {
  EXPECT_THROW(parallel_both([] {}, [] { throw std::runtime_error("second"); }),
               std::runtime_error);
}

TEST(ParallelFor, KeepsToTheLimitOfThreads) {
  limit_threads(1);
  std::atomic<int> inside{0}, most{0};
  parallel_for(1000, 1, [&](std::size_t, std::size_t) {
    const int now = ++inside;
    if (now > most) most = now;
    --inside;
  });
  EXPECT_EQ(most, 1);
}

}  // namespace
}  // namespace meniscus
