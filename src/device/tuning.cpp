#include "device/tuning.hpp"

#include <cstdio>
#include <string>

#include "device/device.hpp"
#include "device/program_cache.hpp"
#include "meniscus/meniscus.hpp"

namespace meniscus {
namespace {

std::string key_of(const DeviceInfo& info) {
  std::string key = "tuning\n";
  key += identity_of(info) + version() + "\n";
  return key;
}

bool is_sound(const Tuning& tuning) {
  const bool power_of_two = tuning.group > 0 && (tuning.group & (tuning.group - 1)) == 0;
  return (tuning.vector_width == 1 || tuning.vector_width == 8) && power_of_two &&
         tuning.group <= 1024;
}

}  // namespace

Tuning default_tuning(const DeviceInfo& info) {
  const bool ends_loops = info.platform == "rusticl";
  return {info.kind == DeviceKind::cpu && !ends_loops ? 8 : 1, kRowGroup};
}

Tuning tuning_of(const DeviceInfo& info) {
  Tuning kept;
  const std::string text = find_program(key_of(info));
  if (std::sscanf(text.c_str(), "width %d groups of %zu", &kept.vector_width, &kept.group) == 2 &&
      is_sound(kept))
    return kept;
  return default_tuning(info);
}

bool keep_tuning(const DeviceInfo& info, const Tuning& tuning) {
  const std::string text = "width " + std::to_string(tuning.vector_width) + " groups of " +
                           std::to_string(tuning.group) + "\n";
  keep_program(key_of(info), text);
  return find_program(key_of(info)) == text;
}

void forget_tuning(const DeviceInfo& info) { drop_program(key_of(info)); }

}  // namespace meniscus
