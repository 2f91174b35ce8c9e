#include "base/team.hpp"

#include <algorithm>
#include <chrono>
#include <limits>

#include "base/elapsed.hpp"
#include "base/host_name.hpp"
#include "meniscus/source.hpp"

namespace meniscus {
namespace {

// Calls work(first, count) for parts of `size` items that are at most `largest`.
template <class Work>
void in_parts(std::size_t size, std::size_t largest, const Work& work) {
  for (std::size_t first = 0; first < size; first += largest)
    work(first, std::min(largest, size - first));
}

}  // namespace

class Team::Waiting {
 public:
  explicit Waiting(Team& team) : team_(team) {}
  ~Waiting() { team_.waited_ms_ += milliseconds_since(begin_); }

 private:
  Team& team_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

// The lowest rank that failed tells all. What it says is not split: it is short.
void Team::agree(bool failed, const std::string& message) {
  const Waiting waiting(*this);
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t first = failed ? static_cast<std::uint32_t>(rank()) : kNone;
  channel_->minimum(&first, 1);
  if (first == kNone) return;
  const int from = static_cast<int>(first);
  failed_ = true;
  message_ = message;
  if (from > 0) message_ += " (rank " + std::to_string(from) + " on " + host_name() + ")";
  std::uint64_t length = message_.size();
  channel_->broadcast(&length, sizeof length, from);
  message_.resize(length);
  channel_->broadcast(message_.data(), length, from);
}

void Team::meet() {
  if (!channel_) return;
  if (!failed_) agree(false, "");
  if (failed_) throw TeamError(message_);
}

std::string Team::fail(const std::string& message) {
  if (!channel_) return message;
  if (!failed_) agree(true, message);
  return message_;
}

void Team::minimum(std::vector<std::uint32_t>& values) {
  meet();
  if (!channel_) return;
  const Waiting waiting(*this);
  in_parts(values.size(), largest_ / sizeof(std::uint32_t),
           [&](std::size_t first, std::size_t n) { channel_->minimum(values.data() + first, n); });
}

void Team::sum(std::vector<std::int64_t>& values) {
  meet();
  if (!channel_) return;
  const Waiting waiting(*this);
  in_parts(values.size(), largest_ / sizeof(std::int64_t),
           [&](std::size_t first, std::size_t n) { channel_->sum(values.data() + first, n); });
}

std::string Team::from_first(const std::string& text) {
  std::string common = text;
  common.resize(from_first(text.size()));
  share_bytes(common.data(), common.size());
  return common;
}

std::vector<std::int64_t> Team::counts_of(std::size_t mine) {
  std::vector<std::int64_t> counts(static_cast<std::size_t>(size()));
  counts[static_cast<std::size_t>(rank())] = static_cast<std::int64_t>(mine);
  sum(counts);
  return counts;
}

void Team::share_bytes(void* bytes, std::size_t size) {
  meet();
  if (!channel_) return;
  const Waiting waiting(*this);
  in_parts(size, largest_, [&](std::size_t first, std::size_t n) {
    channel_->broadcast(static_cast<char*>(bytes) + first, n, 0);
  });
}

void Team::send_bytes(const void* bytes, std::size_t size, int to) {
  const Waiting waiting(*this);
  in_parts(size, largest_, [&](std::size_t first, std::size_t n) {
    channel_->send(static_cast<const char*>(bytes) + first, n, to);
  });
}

void Team::receive_bytes(void* bytes, std::size_t size, int from) {
  const Waiting waiting(*this);
  in_parts(size, largest_, [&](std::size_t first, std::size_t n) {
    channel_->receive(static_cast<char*>(bytes) + first, n, from);
  });
}

Team& alone() {
  static Team team;
  return team;
}

Team& ParticleSource::team() const { return alone(); }

}  // namespace meniscus
