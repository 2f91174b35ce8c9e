// The numbers of Parameters by their names, for what offers them to people.
#pragma once

#include <string>
#include <vector>

#include "meniscus/export.hpp"
#include "meniscus/parameters.hpp"

namespace meniscus MENISCUS_API {

/// A number that can be turned. Its name is that of the program's option: "support" is --support.
struct NamedParameter {
  std::string name;
  std::string group;  // heading in --help
  std::string unit;   // "particle radii", "pixels" ...; empty: none
  std::string effect;
  double value = 0;            // by default
  double least = 0, most = 0;  // its range
  bool above = false;          // the value must exceed `least` instead of reaching it
  bool whole = false;          // a whole number
};

/// All of them, in the order of --help.
std::vector<NamedParameter> named_parameters();

/// Sets the one of that name. Throws InvalidArgument for an unknown name, with the nearest
/// one, a value out of its range, or a fraction where whole numbers are wanted.
void set_parameter(Parameters& parameters, const std::string& name, double value);

}  // namespace MENISCUS_API
