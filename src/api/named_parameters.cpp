#include "meniscus/named_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "api/parameter_list.hpp"
#include "base/printed.hpp"
#include "meniscus/error.hpp"

namespace meniscus {
namespace {

// How many letters must be put in, taken away or changed to make one word of the other.
std::size_t distance(const std::string& from, const std::string& to) {
  std::vector<std::size_t> row(to.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= from.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= to.size(); ++j) {
      const std::size_t changed = diagonal + (from[i - 1] == to[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, changed});
    }
  }
  return row.back();
}

}  // namespace

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
    const auto nearest = std::min_element(entries.begin(), entries.end(),
                                          [&](const ParameterEntry& a, const ParameterEntry& b) {
                                            return distance(a.name, name) < distance(b.name, name);
                                          });
    // A name that shares hardly a letter would mislead.
    const bool is_near = 3 * distance(nearest->name, name) <= std::max<std::size_t>(3, name.size());
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
