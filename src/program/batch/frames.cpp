#include "program/batch/frames.hpp"

#include <algorithm>
#include <charconv>
#include <numeric>
#include <unordered_set>

#include "meniscus/error.hpp"
#include "meniscus/io.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kMost = 10'000'000;  // frames; a typing error names more

// Reads text from left to right.
struct Cursor {
  const char* at;
  const char* end;

  bool number(std::int64_t& value) {
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc()) return false;
    at = next;
    return true;
  }
  bool take(char c) {
    if (at == end || *at != c) return false;
    ++at;
    return true;
  }
};

// "first", "first-last" or "first-lastxstep".
void add_range(const std::string& list, const std::string& part, std::vector<std::int64_t>& frames,
               std::unordered_set<std::int64_t>& known) {
  const auto wrong = [&](const std::string& why) {
    return InvalidArgument("frames " + list + ": " + why + " (e.g. 1-240, 1-240x2, 1,5,10-20)");
  };
  Cursor text{part.data(), part.data() + part.size()};
  std::int64_t first = 0, last = 0;
  bool good = text.number(first);
  last = first;
  const bool range = good && text.take('-');
  if (range) good = text.number(last);
  std::int64_t step = last < first ? -1 : 1;
  if (good && range && text.take('x')) good = text.number(step);
  if (!good || text.at != text.end)
    throw wrong("\"" + part + "\" is no frame and no range of frames");
  if (first < 0 || last < 0) throw wrong("\"" + part + "\" goes below frame 0");
  if (std::max({first, last, step}) > kLastFrame || step < -kLastFrame)
    throw wrong("\"" + part + "\" goes beyond frame " + std::to_string(kLastFrame));
  if (step == 0 || (last != first && (last > first) != (step > 0)))
    throw wrong("the step of \"" + part + "\" never reaches its end");
  if (static_cast<std::uint64_t>((last - first) / step) >= kMost - frames.size())
    throw wrong("\"" + part + "\" names more than " + std::to_string(kMost) + " frames");
  for (std::int64_t frame = first; step > 0 ? frame <= last : frame >= last; frame += step)
    if (known.insert(frame).second) frames.push_back(frame);
}

}  // namespace

std::vector<std::int64_t> parse_frames(const std::string& list) {
  std::vector<std::int64_t> frames;
  std::unordered_set<std::int64_t> known;
  for (std::size_t begin = 0; begin <= list.size();) {
    const std::size_t end = std::min(list.find(',', begin), list.size());
    add_range(list, list.substr(begin, end - begin), frames, known);
    begin = end + 1;
  }
  return frames;
}

std::string frame_list(std::vector<std::int64_t> frames) {
  std::sort(frames.begin(), frames.end());
  std::string text;
  for (std::size_t k = 0; k < frames.size();) {
    std::size_t last = k;  // of the longest run with one step
    const std::int64_t step = k + 1 < frames.size() ? frames[k + 1] - frames[k] : 1;
    while (last + 1 < frames.size() && frames[last + 1] - frames[last] == step) ++last;
    if (last == k + 1 && step != 1) last = k;  // two frames apart are no range
    if (!text.empty()) text += ',';
    text += std::to_string(frames[k]);
    if (last > k) {
      text += last == k + 1 ? ',' : '-';
      text += std::to_string(frames[last]);
      if (step != 1) text.append("x").append(std::to_string(step));
    }
    k = last + 1;
  }
  return text;
}

std::vector<std::int64_t> whole_range(const std::vector<std::int64_t>& frames) {
  constexpr std::int64_t kMostInRange = 1'000'000;
  std::vector<std::int64_t> range;
  if (frames.size() < 2) return range;
  const std::int64_t first = frames.front(), last = frames.back();
  std::int64_t step = 0;
  for (const std::int64_t frame : frames) step = std::gcd(step, frame - first);
  if ((last - first) / step < kMostInRange)
    for (std::int64_t frame = first; frame <= last; frame += step) range.push_back(frame);
  return range;
}

Shard parse_shard(const std::string& text) {
  Cursor cursor{text.data(), text.data() + text.size()};
  std::int64_t index = 0, count = 0;
  if (!cursor.number(index) || !cursor.take('/') || !cursor.number(count) ||
      cursor.at != cursor.end || index < 1 || index > count || count > 1'000'000)
    throw InvalidArgument("shard " + text + ": must be k/N with k from 1 to N, e.g. 2/8, or slurm");
  return {static_cast<int>(index), static_cast<int>(count)};
}

}  // namespace meniscus
