// A team of threads, for tests of what several processes do together.
#pragma once

#include <algorithm>
#include <barrier>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/team.hpp"

namespace meniscus {

/// What the threads of a team share.
struct Exchange {
  explicit Exchange(int ranks) : shown(static_cast<std::size_t>(ranks)), all(ranks) {}
  std::vector<void*> shown;  // by each rank
  std::barrier<> all;
  std::mutex mutex;
  std::condition_variable arrived;
  std::map<std::pair<int, int>, std::deque<std::string>> sent;  // from, to
  std::size_t largest = 0;                                      // message so far, bytes
};

class ThreadChannel : public Channel {
 public:
  ThreadChannel(Exchange& exchange, int rank) : exchange_(exchange), rank_(rank) {}
  int rank() const override { return rank_; }
  int size() const override { return static_cast<int>(exchange_.shown.size()); }

  void minimum(std::uint32_t* values, std::size_t count) override {
    reduce(values, count, [](auto a, auto b) { return std::min(a, b); });
  }
  void sum(std::int64_t* values, std::size_t count) override {
    reduce(values, count, [](auto a, auto b) { return a + b; });
  }
  void broadcast(void* bytes, std::size_t size, int from) override {
    show(bytes, size);
    if (from != rank_ && size > 0)
      std::memcpy(bytes, exchange_.shown[static_cast<std::size_t>(from)], size);
    exchange_.all.arrive_and_wait();
  }
  void send(const void* bytes, std::size_t size, int to) override {
    const std::lock_guard lock(exchange_.mutex);
    note(size);
    exchange_.sent[{rank_, to}].emplace_back(static_cast<const char*>(bytes), size);
    exchange_.arrived.notify_all();
  }
  void receive(void* bytes, std::size_t size, int from) override {
    std::unique_lock lock(exchange_.mutex);
    auto& queue = exchange_.sent[{from, rank_}];
    exchange_.arrived.wait(lock, [&] { return !queue.empty(); });
    if (queue.front().size() != size) std::abort();  // as MPI would
    std::memcpy(bytes, queue.front().data(), size);
    queue.pop_front();
  }

 private:
  void note(std::size_t bytes) { exchange_.largest = std::max(exchange_.largest, bytes); }

  void show(void* bytes, std::size_t size) {
    exchange_.shown[static_cast<std::size_t>(rank_)] = bytes;
    if (rank_ == 0) note(size);
    exchange_.all.arrive_and_wait();
  }

  template <class T, class Join>
  void reduce(T* values, std::size_t count, const Join& join) {
    show(values, count * sizeof(T));
    std::vector<T> result(count);
    for (std::size_t k = 0; k < count; ++k) {
      result[k] = static_cast<T*>(exchange_.shown[0])[k];
      for (std::size_t rank = 1; rank < exchange_.shown.size(); ++rank)
        result[k] = join(result[k], static_cast<T*>(exchange_.shown[rank])[k]);
    }
    exchange_.all.arrive_and_wait();
    std::copy(result.begin(), result.end(), values);
    exchange_.all.arrive_and_wait();
  }

  Exchange& exchange_;
  int rank_;
};

struct TeamOutcome {
  std::vector<std::string> errors;  // that each rank ended with; empty: none
  std::size_t largest = 0;          // message, bytes
};

/// Calls work(team) on `ranks` threads at once, each a rank of one team whose messages have at most
/// `largest` bytes.
inline TeamOutcome as_team(int ranks, const std::function<void(Team&)>& work,
                           std::size_t largest = std::size_t{1} << 30) {
  Exchange exchange(ranks);
  TeamOutcome outcome;
  outcome.errors.resize(static_cast<std::size_t>(ranks));
  std::vector<std::thread> threads;
  for (int rank = 0; rank < ranks; ++rank)
    threads.emplace_back([&, rank] {
      ThreadChannel channel(exchange, rank);
      Team team(&channel, largest);
      try {
        work(team);
        team.meet();
      } catch (const std::exception& error) {
        outcome.errors[static_cast<std::size_t>(rank)] = team.fail(error.what());
      }
    });
  for (std::thread& thread : threads) thread.join();
  outcome.largest = exchange.largest;
  return outcome;
}

}  // namespace meniscus
