#include "device/tuning.hpp"

#include <cstdio>
#include <string>

#include "device/device.hpp"
#include "device/program_cache.hpp"
#include "meniscus/extract.hpp"

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

const char* to_string(DiscForm form) { return form == DiscForm::bins ? "bins" : "minima"; }

Tuning default_tuning(const DeviceInfo& info) {
  const bool ends_loops = info.platform == "rusticl";
  return {info.kind == DeviceKind::cpu && !ends_loops ? 8 : 1, kRowGroup,
          info.kind == DeviceKind::cpu ? DiscForm::bins : DiscForm::minima};
}

Tuning tuning_of(const DeviceInfo& info) {
  Tuning kept;
  const std::string text = find_program(key_of(info));
  char discs[16] = "";
  if (std::sscanf(text.c_str(), "width %d groups of %zu discs by %15s", &kept.vector_width,
                  &kept.group, discs) != 3)
    return default_tuning(info);
  for (const DiscForm form : {DiscForm::bins, DiscForm::minima})
    if (to_string(form) == std::string(discs)) {
      kept.discs = form;
      if (is_sound(kept)) return kept;
    }
  return default_tuning(info);
}

bool keep_tuning(const DeviceInfo& info, const Tuning& tuning) {
  const std::string text = "width " + std::to_string(tuning.vector_width) + " groups of " +
                           std::to_string(tuning.group) + " discs by " + to_string(tuning.discs) +
                           "\n";
  keep_program(key_of(info), text);
  return find_program(key_of(info)) == text;
}

void forget_tuning(const DeviceInfo& info) { drop_program(key_of(info)); }

}  // namespace meniscus
