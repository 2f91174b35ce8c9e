// Numbers for keys.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace meniscus {

/// A key whose every bit bears on the highest ones: times 2^64 / the golden ratio.
inline std::uint64_t spread_bits(std::uint64_t key) { return key * 0x9e3779b97f4a7c15; }

/// Numbers keys in the order in which they come first: a hash table in one piece of memory, which
/// only grows. Several times as fast as one with a node for each key.
class KeyTable {
 public:
  static constexpr std::uint32_t kNone = 0xffffffff;

  std::uint32_t size() const { return size_; }

  /// The number of a key, the next one if it is new.
  std::uint32_t add(std::uint64_t key) {
    if (2 * (std::size_t{size_} + 1) > slots_.size()) grow();
    Slot& slot = slots_[place_of(key)];
    if (slot.number == kNone) slot = {key, size_++};
    return slot.number;
  }

  /// The number of a key, or kNone.
  std::uint32_t find(std::uint64_t key) const {
    return slots_.empty() ? kNone : slots_[place_of(key)].number;
  }

 private:
  struct Slot {
    std::uint64_t key = 0;
    std::uint32_t number = kNone;
  };

  // Of the key, or of the empty slot where it would be put.
  std::size_t place_of(std::uint64_t key) const {
    std::size_t place = static_cast<std::size_t>(spread_bits(key) >> shift_);
    while (slots_[place].number != kNone && slots_[place].key != key)
      place = (place + 1) & (slots_.size() - 1);
    return place;
  }

  void grow() {
    constexpr std::size_t kLeast = 16;
    const std::size_t wanted = slots_.empty() ? kLeast : 2 * slots_.size();
    const std::vector<Slot> before = std::exchange(slots_, std::vector<Slot>(wanted));
    shift_ = 64 - std::countr_zero(slots_.size());
    for (const Slot& slot : before)
      if (slot.number != kNone) slots_[place_of(slot.key)] = slot;
  }

  std::vector<Slot> slots_;
  int shift_ = 0;  // that leaves as many bits as slots have
  std::uint32_t size_ = 0;
};

}  // namespace meniscus
