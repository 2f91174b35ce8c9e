// Threads for the native versions, which wait between the runs and do not spin.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace meniscus::bench {

class Workers {
 public:
  /// `threads` in all, the calling one among them.
  explicit Workers(int threads);
  ~Workers();

  /// Calls work(begin, end) for pieces of [0, count) of at most `piece` items, each once.
  void run(std::size_t count, std::size_t piece,
           const std::function<void(std::size_t begin, std::size_t end)>& work);

 private:
  void take_pieces();

  std::mutex mutex_;
  std::condition_variable begin_, end_;
  std::size_t round_ = 0;
  int busy_ = 0;
  bool stop_ = false;
  std::atomic<std::size_t> next_{0};
  std::size_t count_ = 0, piece_ = 1;
  const std::function<void(std::size_t, std::size_t)>* work_ = nullptr;
  std::vector<std::jthread> helpers_;
};

}  // namespace meniscus::bench
