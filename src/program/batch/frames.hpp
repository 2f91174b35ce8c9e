// Which frames of a sequence are meant, and which of them this process takes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace meniscus {

/// The frames that a list such as "1-240", "1-240x2", "1,5,10-20" or "10-1x-3" names, in its order,
/// each once. Frames are whole numbers from 0 to kLastFrame; the step after x may be left out.
/// Throws InvalidArgument, naming the part that is wrong.
std::vector<std::int64_t> parse_frames(const std::string& list);

/// The shortest such list of these frames, ascending: "1-3,7,10-20x2". For messages.
std::string frame_list(std::vector<std::int64_t> frames);

/// All frames from the first to the last one, by the step that all of these keep, which ascend: 0,
/// 10, 30 are of 0, 10, 20, 30. Empty where they are less than two, or where that makes more than a
/// million frames: a stray number is no range.
std::vector<std::int64_t> whole_range(const std::vector<std::int64_t>& frames);

/// Part `index` of `count` of a sequence, counted from 1.
struct Shard {
  int index = 1, count = 1;
};

/// "2/8". Throws InvalidArgument.
Shard parse_shard(const std::string& text);

/// Every count-th item, from the index-th on: neighbours cost much the same, so that each shard
/// gets its part of the expensive ones.
template <class Item>
std::vector<Item> items_of(const Shard& shard, const std::vector<Item>& items) {
  std::vector<Item> mine;
  for (std::size_t k = static_cast<std::size_t>(shard.index) - 1; k < items.size();
       k += static_cast<std::size_t>(shard.count))
    mine.push_back(items[k]);
  return mine;
}

}  // namespace meniscus
