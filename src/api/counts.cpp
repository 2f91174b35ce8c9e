#include "api/counts.hpp"

#include <array>

#include "meniscus/error.hpp"

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
};

}  // namespace

NamedCounts named(const Counts& counts) {
  NamedCounts all;
  for (const Entry& entry : kCounts)
    if (counts.*entry.count >= 0) all.emplace_back(entry.name, counts.*entry.count);
  return all;
}

std::int64_t Counts::*count_named(const std::string& name) {
  for (const Entry& entry : kCounts)
    if (name == entry.name) return entry.count;
  throw Error("no count is called " + name);
}

}  // namespace meniscus
