// Which arrays of a file are the attributes that are asked for.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "io/layout.hpp"

namespace meniscus {

struct NamedArray {
  std::string name;
  std::size_t components = 1;
};

struct AttributePick {
  std::size_t array = 0, component = 0;
  std::string name;  // of the attribute
};

/// What attributes asked for are called that a vector gives: NAME for one component, NAME.X,
/// NAME.Y, NAME.Z for three, else NAME.0, NAME.1 ...
std::string component_name(const std::string& name, std::size_t component, std::size_t components);

/// The attributes in the order asked for. A name in any case stands for the array of that name, or
/// for the columns NAME followed by x y z or 0 1 2 after one of : _ . Each is called as it is asked
/// for. Throws InputError that names the file's arrays where none fits.
std::vector<AttributePick> pick_attributes(const std::string& file,
                                           const std::vector<NamedArray>& arrays,
                                           const std::vector<std::string>& asked);

/// The same of the columns of a table.
std::vector<AttributePick> pick_attributes(const std::string& file,
                                           const std::vector<std::string>& columns,
                                           const std::vector<std::string>& asked);

/// The names of arrays for a message, cut where they get long.
std::string listed(const std::vector<DataArray>& arrays);

}  // namespace meniscus
