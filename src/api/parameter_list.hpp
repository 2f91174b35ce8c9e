// Every tunable number with its name on the command line, its unit, range and effect: the one list
// behind --help, the EXR header and the checks.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "meniscus/parameters.hpp"

namespace meniscus {

struct ParameterEntry {
  std::string group;  // heading in --help
  std::string name;   // "footprint": the option is --footprint
  std::variant<double*, int*> value;
  std::string unit;  // "particle radii", "pixels", "cells", "" ...
  double least, most;
  bool above;  // the value must exceed `least` instead of reaching it
  std::string effect;
  std::string methods = {};  // that use it: "fit, groups and stable"; empty: all

  /// The effect, with the methods where the default is not among them.
  std::string description() const;

  double get() const {
    return std::holds_alternative<int*>(value) ? *std::get<int*>(value) : *std::get<double*>(value);
  }
};

/// The entries point into `parameters`.
std::vector<ParameterEntry> parameter_list(Parameters& parameters);

/// The names of the methods of which has_layers() is true: those that are made of fits.
std::vector<std::string> methods_with_layers();

}  // namespace meniscus
