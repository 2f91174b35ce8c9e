#include <array>

#include "meniscus/types.hpp"

namespace meniscus {
namespace {

struct Entry {
  const char* name;
  std::int64_t Counts::*count;
};

constexpr std::array kCounts{
    Entry{"particles", &Counts::particles}, Entry{"in view", &Counts::in_view},
    Entry{"splash", &Counts::splash},       Entry{"visible", &Counts::visible},
    Entry{"triangles", &Counts::triangles}, Entry{"groups", &Counts::groups},
    Entry{"fits", &Counts::fits},           Entry{"representatives", &Counts::representatives},
    Entry{"spray", &Counts::spray},         Entry{"pixels", &Counts::pixels},
    Entry{"whitewater", &Counts::whitewater},
};

}  // namespace

std::vector<std::pair<std::string, std::int64_t>> named(const Counts& counts) {
  std::vector<std::pair<std::string, std::int64_t>> all;
  for (const Entry& entry : kCounts)
    if (counts.*entry.count >= 0) all.emplace_back(entry.name, counts.*entry.count);
  return all;
}

}  // namespace meniscus
