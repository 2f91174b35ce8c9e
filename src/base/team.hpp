// team: the processes that work on one frame together.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "meniscus/error.hpp"
#include "meniscus/source.hpp"  // which says that it is not for others

namespace meniscus {

/// Carries bytes between processes. Their numbers, the ranks, run from 0 to size() - 1. All call
/// the same functions in the same order, with the same sizes. Nothing here throws: a process that
/// can no longer be reached ends all of them.
class Channel {
 public:
  virtual ~Channel() = default;
  virtual int rank() const = 0;  // of this process
  virtual int size() const = 0;  // processes

  /// Each place's least value over all ranks, or their sum, in all of them.
  virtual void minimum(std::uint32_t* values, std::size_t count) = 0;
  virtual void sum(std::int64_t* values, std::size_t count) = 0;
  /// Copies what rank `from` has to all.
  virtual void broadcast(void* bytes, std::size_t size, int from) = 0;
  /// One rank sends what another receives.
  virtual void send(const void* bytes, std::size_t size, int to) = 0;
  virtual void receive(void* bytes, std::size_t size, int from) = 0;
};

/// What another process failed with.
struct TeamError : Error {
  using Error::Error;
};

/// Processes that work on one frame together; without a channel this one alone, for which nothing
/// here does anything. All ranks call the same functions in the same order. Each call first waits
/// for all, and throws TeamError in all of them when one has called fail() meanwhile.
class Team {
 public:
  /// No message is larger than `largest` bytes.
  explicit Team(Channel* channel = nullptr, std::size_t largest = std::size_t{1} << 30)
      : channel_(channel), largest_(largest) {}

  int rank() const { return channel_ ? channel_->rank() : 0; }
  int size() const { return channel_ ? channel_->size() : 1; }
  bool leads() const { return rank() == 0; }
  double waited_ms() const { return waited_ms_; }  // in calls of this team, so far

  /// Waits until all are here.
  void meet();

  /// Ends the work of all with an error of this process and returns the message that is to be
  /// shown: the lowest failed rank's, with its host unless it is rank 0. Further calls change
  /// nothing.
  std::string fail(const std::string& message);

  /// Each place's least value over all ranks, or their sum, in all of them. Sizes are the same.
  void minimum(std::vector<std::uint32_t>& values);
  void sum(std::vector<std::int64_t>& values);

  /// Rank 0's value, in all.
  template <class T>
  T from_first(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    T common = value;
    share_bytes(&common, sizeof common);
    return common;
  }
  std::string from_first(const std::string& text);

  /// Calls take(rank, values) in rank `to` with what each rank has, in the ranks' order. Takes
  /// `mine`.
  template <class T, class Take>
  void gather(std::vector<T>&& mine, const Take& take, int to = 0) {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::vector<std::int64_t> counts = counts_of(mine.size());
    for (int from = 0; from < size(); ++from) {
      if (from == to) {
        if (rank() == to) take(from, std::move(mine));
        continue;
      }
      std::vector<T> values;
      if (rank() == to)
        values.resize(static_cast<std::size_t>(counts[static_cast<std::size_t>(from)]));
      meet();  // nobody sends what `to` has no room for
      if (rank() == from) {
        send_bytes(mine.data(), mine.size() * sizeof(T), to);
        mine = {};
      } else if (rank() == to) {
        receive_bytes(values.data(), values.size() * sizeof(T), from);
        take(from, std::move(values));
      }
    }
  }

  /// What all ranks have, in the ranks' order, in all.
  template <class T>
  std::vector<T> joined(std::vector<T> mine) {
    std::vector<T> all;
    gather(std::move(mine), [&](int, std::vector<T>&& values) {
      if (all.empty()) {
        all = std::move(values);
        return;
      }
      const std::size_t before = all.size();
      all.resize(before + values.size());
      std::copy(values.begin(), values.end(), all.begin() + static_cast<std::ptrdiff_t>(before));
    });
    all.resize(from_first(all.size()));
    share_bytes(all.data(), all.size() * sizeof(T));
    return all;
  }

 private:
  class Waiting;  // adds to waited_ms_ while it lives
  void agree(bool failed, const std::string& message);
  std::vector<std::int64_t> counts_of(std::size_t mine);  // of all ranks
  void share_bytes(void* bytes, std::size_t size);        // rank 0's
  void send_bytes(const void* bytes, std::size_t size, int to);
  void receive_bytes(void* bytes, std::size_t size, int from);

  Channel* channel_;
  std::size_t largest_;
  double waited_ms_ = 0;
  bool failed_ = false;
  std::string message_;
};

/// The team of a process that works alone.
Team& alone();

}  // namespace meniscus
