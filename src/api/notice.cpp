#include "meniscus/notice.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace meniscus {
namespace {

constexpr std::array kNames{
    std::pair{Code::other, "other"},
    std::pair{Code::not_finite, "not_finite"},
    std::pair{Code::coinciding, "coinciding"},
    std::pair{Code::bad_velocities, "bad_velocities"},
    std::pair{Code::bad_attribute, "bad_attribute"},
    std::pair{Code::bad_radius, "bad_radius"},
    std::pair{Code::crowded, "crowded"},
    std::pair{Code::too_far, "too_far"},
    std::pair{Code::coarse_positions, "coarse_positions"},
    std::pair{Code::no_particles, "no_particles"},
    std::pair{Code::none_in_view, "none_in_view"},
    std::pair{Code::none_shown, "none_shown"},
    std::pair{Code::radius_estimated, "radius_estimated"},
    std::pair{Code::radius_assumed, "radius_assumed"},
    std::pair{Code::radius_too_small, "radius_too_small"},
    std::pair{Code::radius_too_large, "radius_too_large"},
    std::pair{Code::radius_needed, "radius_needed"},
    std::pair{Code::parameter_out_of_range, "parameter_out_of_range"},
    std::pair{Code::not_whole, "not_whole"},
    std::pair{Code::unknown_parameter, "unknown_parameter"},
    std::pair{Code::unknown_map, "unknown_map"},
    std::pair{Code::unknown_method, "unknown_method"},
    std::pair{Code::memory_too_small, "memory_too_small"},
    std::pair{Code::missing_file, "missing_file"},
    std::pair{Code::extracted_again, "extracted_again"},
};

// What encloses a setting's name. No file's name that the library prints has them.
constexpr char kBegin = '\x01', kEnd = '\x02';

bool is_name(const std::string& text) {
  return std::all_of(text.begin(), text.end(),
                     [](char c) { return (c >= 'a' && c <= 'z') || c == '-'; });
}

}  // namespace

const char* to_string(Code code) {
  const auto* const found = std::find_if(kNames.begin(), kNames.end(),
                                         [&](const auto& entry) { return entry.first == code; });
  return found == kNames.end() ? "other" : found->second;
}

std::string setting(const std::string& name) { return kBegin + name + kEnd; }

std::string worded(const std::string& text, std::string (*named)(const std::string& setting)) {
  std::string made;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t begin = text.find(kBegin, at);
    const std::size_t end = begin == std::string::npos ? begin : text.find(kEnd, begin);
    if (end == std::string::npos) return made + text.substr(at);
    const std::string name = text.substr(begin + 1, end - begin - 1);
    made += text.substr(at, begin - at);
    made += is_name(name) ? named(name) : text.substr(begin, end + 1 - begin);
    at = end + 1;
  }
  return made;
}

std::string to_string(const Notice& notice) {
  return worded(notice.text, [](const std::string& name) {
    std::string word = name;
    std::replace(word.begin(), word.end(), '-', '_');
    return word;
  });
}

}  // namespace meniscus
