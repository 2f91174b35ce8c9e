#include "meniscus/named_parameters.hpp"

#include <algorithm>
#include <cmath>

#include "api/parameter_list.hpp"
#include "base/edit_distance.hpp"
#include "base/printed.hpp"
#include "meniscus/error.hpp"

namespace meniscus {

std::vector<NamedParameter> named_parameters() {
  Parameters defaults;
  std::vector<NamedParameter> named;
  for (const ParameterEntry& entry : parameter_list(defaults))
    named.push_back({entry.name, entry.group, entry.unit, entry.description(), entry.get(),
                     entry.least, entry.most, entry.above,
                     std::holds_alternative<int*>(entry.value)});
  return named;
}

void set_parameter(Parameters& parameters, const std::string& name, double value) {
  const std::vector<ParameterEntry> entries = parameter_list(parameters);
  const auto entry = std::find_if(entries.begin(), entries.end(),
                                  [&](const ParameterEntry& one) { return one.name == name; });
  if (entry == entries.end()) {
    const auto nearest = std::min_element(
        entries.begin(), entries.end(), [&](const ParameterEntry& a, const ParameterEntry& b) {
          return edit_distance(a.name, name) < edit_distance(b.name, name);
        });
    // A name that shares hardly a letter would mislead.
    const bool is_near =
        3 * edit_distance(nearest->name, name) <= std::max<std::size_t>(3, name.size());
    throw InvalidArgument(Notice{.code = Code::unknown_parameter,
                                 .text = "there is no parameter " + name + "; " +
                                         (is_near ? "the nearest name is " + nearest->name
                                                  : "named_parameters() lists those there are"),
                                 .subject = name});
  }
  if (int* const* whole = std::get_if<int*>(&entry->value)) {
    if (!(std::abs(value) <= 1e9 && value == std::trunc(value)))
      throw InvalidArgument(
          Notice{.code = Code::not_whole,
                 .text = setting(name) + printed(" is %g, must be a whole number", value),
                 .subject = name,
                 .found = value});
    **whole = static_cast<int>(value);
  } else {
    *std::get<double*>(entry->value) = value;
  }
  check(parameters);
}

}  // namespace meniscus
