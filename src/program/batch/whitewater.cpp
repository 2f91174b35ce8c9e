#include "program/batch/whitewater.hpp"

#include <charconv>
#include <cmath>
#include <optional>

#include "io/readers.hpp"
#include "meniscus/error.hpp"
#include "meniscus/io.hpp"
#include "meniscus/source.hpp"

namespace meniscus {
namespace {

std::optional<double> number_in(const std::string& text) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || at != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

// Takes "@ATTRIBUTE=NUMBER" from the end of the path; a name may have an @ of its own.
void take_attribute(WhitewaterInput& input) {
  const std::size_t at = input.path.rfind('@');
  if (at == std::string::npos) return;
  const std::string condition = input.path.substr(at + 1);
  const std::size_t sign = condition.rfind('=');
  if (sign == std::string::npos || sign == 0) return;
  if (is_particle_file(condition)) return;  // a name with an @ and an = of its own
  const auto value = number_in(condition.substr(sign + 1));
  if (!value)
    throw InvalidArgument("whitewater " + input.path +
                          ": wanted a number behind the =, e.g. @type=1");
  input.attribute = condition.substr(0, sign);
  input.value = *value;
  input.path.resize(at);
}

// The error of a file, which knows nothing of whose radius it is.
[[noreturn]] void rethrow_with_own_setting(const InputError& error) {
  Notice notice = error.notice;
  const std::string water = setting("particle-radius");
  if (const std::size_t at = notice.text.find(water); at != std::string::npos)
    notice.text.replace(at, water.size(), setting("whitewater-radius"));
  throw InputError(notice);
}

}  // namespace

WhitewaterInput parse_whitewater(const std::string& text) {
  const std::size_t sign = text.find('=');
  WhitewaterInput input;
  for (const WhitewaterType type : kWhitewaterTypes) {
    if (sign == std::string::npos || text.substr(0, sign) != to_string(type)) continue;
    input.type = type;
    input.path = text.substr(sign + 1);
    take_attribute(input);
    if (!input.path.empty()) return input;
  }
  throw InvalidArgument("whitewater " + text +
                        ": must be foam=FILE, spray=FILE or bubble=FILE, or e.g. "
                        "foam=FILE@type=1 for those of its particles whose type is 1");
}

std::vector<WhitewaterInput> parse_whitewater(const std::vector<std::string>& texts) {
  std::vector<WhitewaterInput> inputs;
  for (const std::string& text : texts) {
    inputs.push_back(parse_whitewater(text));
    for (std::size_t k = 0; k + 1 < inputs.size(); ++k)
      require(inputs[k].type != inputs.back().type,
              "whitewater " + text + ": " + to_string(inputs.back().type) +
                  " is given twice (a * in a name stands for the parts of one frame)");
  }
  return inputs;
}

Whitewater::Whitewater(const std::vector<WhitewaterInput>& inputs, double radius) {
  for (const WhitewaterInput& input : inputs) {
    WhitewaterSource source{.type = input.type, .value = input.value, .name = input.path};
    if (input.path.empty()) {
      particles_.push_back(source_of(Particles{}));
    } else {
      ReadOptions reading{.particle_radius = radius};
      if (!input.attribute.empty()) reading.attributes = {input.attribute};
      try {
        particles_.push_back(open_particles(input.path, reading));
      } catch (const InputError& error) {
        rethrow_with_own_setting(error);
      }
      if (const auto names = particles_.back()->attributes(); !input.attribute.empty()) {
        if (names.size() != 1)
          throw InputError(input.path + ": attribute " + input.attribute + " has " +
                           std::to_string(names.size()) + " components, must be one number");
        source.attribute = names.front();
      }
    }
    source.particles = particles_.back().get();
    sources_.push_back(std::move(source));
  }
}

}  // namespace meniscus
